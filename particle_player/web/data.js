// Reads what the page carries: numbers quantised to 16 bits, stored as differences from frame to frame, deflated, in base64.
"use strict";

const ABSENT = 65535; // a particle that is not there (yet, or any more)

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// One field over time: low bytes of all frames, then high bytes; each frame after the first is a difference modulo 2^16.
async function readField(field, frames, count) {
  const bytes = await inflate(field.data);
  const total = frames * count;
  const values = new Uint16Array(total);
  for (let i = 0; i < total; i++) {
    const difference = bytes[i] | (bytes[total + i] << 8);
    values[i] = i < count ? difference : values[i - count] + difference;
  }
  return { values, low: field.low, step: (field.high - field.low) / 65534 };
}

async function readMovie(movie) {
  const fields = {};
  for (const [name, field] of Object.entries(movie.fields)) fields[name] = await readField(field, movie.times.length, movie.count);
  return { ...movie, fields };
}

// Value of a field for particle i between frames k and k + 1; NaN where the particle is absent.
function valueAt(field, count, i, k, fraction) {
  const a = field.values[k * count + i];
  if (a === ABSENT) return NaN;
  const b = fraction > 0 ? field.values[(k + 1) * count + i] : a;
  return field.low + field.step * (b === ABSENT ? a : a + fraction * (b - a));
}

function niceTicks(low, high, most) {
  const raw = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 2.5, 5, 10].map((f) => f * power).find((s) => s >= raw * (1 - 1e-9));
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}

// A number in four digits, or in as many as it takes where numbers differ by a small part of their size only, as
// coordinates of a map do: two digits more than their span needs.
function shown(value, span = 0) {
  if (!Number.isFinite(value)) return "\u2013";
  const size = Math.abs(value);
  let text;
  if (span > 0 && size > 100 * span) text = String(+value.toFixed(Math.min(20, Math.max(0, 2 - Math.floor(Math.log10(span))))));
  else text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(2) : String(+value.toPrecision(4));
  return text.replace("-", "\u2212");
}

const spanOf = (numbers) => numbers.at(-1) - numbers[0];

const withUnit = (text, unit) => (unit === "-" || unit === "" ? text : `${text} ${unit}`);
