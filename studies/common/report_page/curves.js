// Tables of numbers as small charts over their first column. A line in each shows where one is: the player's time, if they
// are over time; a click or a drag sets it.
"use strict";

const CHART = { width: 380, height: 190, left: 52, right: 10, top: 10, bottom: 36 };

function svgElement(name, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== undefined) element.textContent = text;
  return element;
}

function drawCurves(table, host, player) {
  const section = document.createElement("section");
  section.innerHTML = '<h2></h2><div class="grid"></div>';
  section.querySelector("h2").textContent = table.title;
  if (table.constant) section.append(Object.assign(document.createElement("p"), { className: "constant", textContent: table.constant }));
  host.append(section);
  const follows = player && table.isTime;
  const choose = follows ? (time) => { player.pause(); player.show(player.times[player.nearest(time)]); } : (x) => show(x);
  const curves = table.curves.map((curve) => new Curve(curve, table.along, section.querySelector(".grid"), choose));
  const show = (x) => curves.forEach((curve) => curve.show(x));
  if (follows) player.listeners.push(show);
  show(follows ? player.time : table.along.values.at(-1));
}

class Curve {
  constructor(curve, along, host, chooseTime) {
    const times = along.values;
    Object.assign(this, { curve, along, times });
    const element = document.createElement("div");
    element.className = "curve";
    element.innerHTML = "<h3><span></span><output></output></h3>";
    element.querySelector("span").textContent = withUnit(curve.name, curve.unit === "-" ? "" : `[${curve.unit}]`);
    this.output = element.querySelector("output");
    host.append(element);
    const finite = curve.values.some(Number.isFinite) ? curve.values.filter(Number.isFinite) : [0];
    let low = Math.min(...finite), high = Math.max(...finite);
    if (!(high - low < 0.05 * Math.abs(high))) [low, high] = [Math.min(low, 0), Math.max(high, low)]; // else zero is far off
    if (!(high > low)) high = low + 1;
    this.span = high - low;
    const start = Math.min(...times), end = Math.max(...times) > start ? Math.max(...times) : start + 1;
    const { width, height, right, top, bottom } = CHART;
    const ticksX = niceTicks(start, end, 6), ticksY = niceTicks(low, high, 4);
    const left = Math.max(CHART.left, 10 + 6.5 * Math.max(...ticksY.map((v) => shown(v, this.span).length)));
    this.left = left;
    this.x = (t) => left + ((t - start) / (end - start)) * (width - left - right);
    this.y = (v) => height - bottom - ((v - low) / (1.05 * (high - low))) * (height - top - bottom);
    this.svg = svgElement("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": curve.name });
    this.grid(ticksX, ticksY);
    const points = curve.values.map((v, k) => (Number.isFinite(v) ? `${this.x(times[k]).toFixed(1)},${this.y(v).toFixed(1)}` : "")).filter(Boolean);
    this.svg.append(svgElement("polyline", { points: points.join(" "), fill: "none", stroke: "#0b559f", "stroke-width": 1.6, "stroke-linejoin": "round" }));
    this.line = svgElement("line", { y1: top, y2: height - bottom, stroke: "#d8321e", "stroke-width": 1 });
    this.dot = svgElement("circle", { r: 3.2, fill: "#d8321e", stroke: "#fff" });
    this.svg.append(this.line, this.dot);
    element.append(this.svg);
    const choose = (event) => {
      const box = this.svg.getBoundingClientRect(), px = ((event.clientX - box.left) * width) / box.width;
      chooseTime(start + ((px - left) / (width - left - right)) * (end - start));
    };
    this.svg.onpointerdown = (event) => { this.svg.setPointerCapture(event.pointerId); choose(event); };
    this.svg.onpointermove = (event) => { if (event.buttons) choose(event); };
    this.show(times[0]);
  }

  grid(ticksX, ticksY) {
    const { width, height, right, bottom } = CHART, left = this.left;
    for (const t of ticksX) {
      this.svg.append(svgElement("text", { x: this.x(t), y: height - bottom + 15, "text-anchor": "middle" }, shown(t, spanOf(ticksX))));
    }
    this.svg.append(svgElement("text", { x: (left + width - right) / 2, y: height - 4, "text-anchor": "middle" }, `${this.along.name} [${this.along.unit}]`));
    for (const v of ticksY) {
      this.svg.append(svgElement("line", { x1: left, x2: width - right, y1: this.y(v), y2: this.y(v), stroke: "#e3e7eb" }));
      this.svg.append(svgElement("text", { x: left - 6, y: this.y(v) + 4, "text-anchor": "end" }, shown(v, this.span)));
    }
  }

  show(time) {
    let k = 0; // the last one at or before, so that it fits what the player shows
    while (k < this.times.length - 1 && this.times[k + 1] <= time * (1 + 1e-9)) k++;
    const value = this.curve.values[k];
    this.line.setAttribute("x1", this.x(this.times[k]));
    this.line.setAttribute("x2", this.x(this.times[k]));
    this.dot.setAttribute("cx", this.x(this.times[k]));
    this.dot.setAttribute("cy", Number.isFinite(value) ? this.y(value) : -10);
    this.output.textContent = withUnit(shown(value, this.span), this.curve.unit);
  }
}
