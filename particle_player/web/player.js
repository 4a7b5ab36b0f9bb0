// The player: all panels share time, quantity, colours and the part of the plane that they show.
"use strict";

const PLAY_SECONDS = 12; // at speed 1

class Player {
  constructor(data, movies) {
    this.data = data;
    this.find = (id) => document.getElementById(id);
    this.views = movies.map((movie) => new View(movie, data.limits, this.find("panels")));
    // The panel with most frames gives the steps of the slider.
    this.times = movies.reduce((a, b) => (b.times.length > a.times.length ? b : a)).times;
    this.time = this.times[0];
    this.marked = this.pinned = -1;
    this.listeners = [];
    this.choices();
    this.controls();
    this.views.forEach((view) => this.mouse(view));
    this.find("player").hidden = false;
    this.wholeView();
    new ResizeObserver(() => this.resize()).observe(this.find("panels"));
    this.resize();
  }

  choices() {
    const fill = (id, entries) => {
      for (const [value, text] of entries) this.find(id).add(new Option(text, value));
      return this.find(id);
    };
    const quantity = fill("quantity", Object.entries(this.data.quantities).map(([key, q]) => [key, q.name]));
    const map = fill("map", Object.keys(this.data.maps).map((name) => [name, name]));
    quantity.onchange = () => {
      map.value = this.data.quantities[quantity.value].colours;
      this.recolour();
    };
    map.onchange = () => this.recolour();
    this.find("mesh").onchange = () => this.draw();
    quantity.value = this.data.first;
    map.value = this.data.quantities[this.data.first].colours;
    this.colours = this.colourTable(map.value);
    this.drawScale();
  }

  controls() {
    const slider = this.find("time");
    slider.max = this.times.length - 1;
    slider.oninput = () => {
      this.pause();
      this.show(this.times[slider.value]);
    };
    this.find("play").onclick = () => this.toggle();
    this.find("reset").onclick = () => this.wholeView();
    this.find("full").onclick = () => this.fullScreen();
    document.addEventListener("keydown", (event) => {
      if (event.target.matches("select, button") || event.ctrlKey || event.metaKey || event.altKey) return;
      const act = { " ": () => this.toggle(), f: () => this.fullScreen(), ArrowRight: () => this.stepBy(1), ArrowLeft: () => this.stepBy(-1) };
      if (!act[event.key]) return;
      event.preventDefault();
      act[event.key]();
    });
  }

  fullScreen() {
    if (document.fullscreenElement) document.exitFullscreen();
    else this.find("player").requestFullscreen();
  }

  // --- time ---

  nearest(time) {
    let best = 0;
    this.times.forEach((t, k) => { if (Math.abs(t - time) < Math.abs(this.times[best] - time)) best = k; });
    return best;
  }

  show(time) {
    this.time = Math.min(Math.max(time, this.times[0]), this.times.at(-1));
    this.find("time").value = this.nearest(this.time);
    const [name, unit] = this.data.slider;
    this.find("clock").textContent = `${name} = ${this.time.toFixed(this.decimals())} ${unit}`;
    this.listeners.forEach((listener) => listener(this.time));
    this.draw();
  }

  decimals() {
    const step = (this.times.at(-1) - this.times[0]) / Math.max(1, this.times.length - 1);
    return step > 0 ? Math.min(6, Math.max(0, -Math.floor(Math.log10(step)))) : 2;
  }

  stepBy(steps) {
    this.pause();
    this.show(this.times[Math.min(Math.max(this.nearest(this.time) + steps, 0), this.times.length - 1)]);
  }

  toggle() {
    if (this.playing) return this.pause();
    if (this.time >= this.times.at(-1)) this.time = this.times[0];
    this.playing = true;
    this.find("play").innerHTML = "&#10074;&#10074;";
    let before = performance.now();
    const span = this.times.at(-1) - this.times[0];
    const tick = (now) => {
      if (!this.playing) return;
      this.show(this.time + ((now - before) / 1000) * this.find("speed").value * (span / PLAY_SECONDS));
      before = now;
      if (this.time >= this.times.at(-1)) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  // Stops at a stored time, so that what the mouse reads are computed values, not ones between two times.
  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.find("play").innerHTML = "&#9654;";
    this.show(this.times[this.nearest(this.time)]);
  }

  // --- colours ---

  colourTable(name) {
    const rgb = Uint8Array.from(atob(this.data.maps[name]), (c) => c.charCodeAt(0));
    return Uint32Array.from({ length: 256 }, (_, i) => (255 << 24) | (rgb[3 * i + 2] << 16) | (rgb[3 * i + 1] << 8) | rgb[3 * i]);
  }

  recolour() {
    this.colours = this.colourTable(this.find("map").value);
    this.drawScale();
    this.draw();
  }

  drawScale() {
    const key = this.find("quantity").value, quantity = this.data.quantities[key], [low, high] = this.data.limits[key];
    const context = this.find("scale-bar").getContext("2d"), strip = context.createImageData(256, 1);
    new Uint32Array(strip.data.buffer).set(this.colours);
    context.putImageData(strip, 0, 0);
    const css = (c) => `rgb(${c & 255},${(c >> 8) & 255},${(c >> 16) & 255})`;
    this.find("scale-low").style.background = low === 0 ? "none" : css(this.colours[0]);
    this.find("scale-high").style.background = css(this.colours[255]);
    this.find("scale-ticks").replaceChildren(...niceTicks(low, high, 8).map((value) => {
      const tick = document.createElement("span");
      tick.style.left = `${(100 * (value - low)) / (high - low)}%`;
      tick.textContent = shown(value);
      return tick;
    }));
    this.find("scale-label").textContent = `${quantity.name} [${quantity.unit}]`;
  }

  // --- what part of the plane is shown ---

  wholeView() {
    const [[x0, y0], [x1, y1]] = this.data.extent;
    this.camera = { x: (x0 + x1) / 2, y: (y0 + y1) / 2, width: x1 - x0, height: y1 - y0, zoom: 1 };
    this.draw();
  }

  resize() {
    const full = document.fullscreenElement === this.find("player");
    const width = this.views[0].box.clientWidth - MARGIN.left - MARGIN.right;
    const free = full ? window.innerHeight - 210 : 0.68 * window.innerHeight;
    const wanted = (width * this.camera.height) / this.camera.width + MARGIN.top + MARGIN.bottom;
    const height = Math.round(full ? free : Math.min(Math.max(wanted, 200), Math.max(free, 260)));
    if (this.views[0].width === this.views[0].box.clientWidth && this.views[0].height === height) return;
    this.views.forEach((view) => view.resize(height));
    this.show(this.time);
  }

  mouse(view) {
    let from = null, moved = 0;
    const box = view.box;
    box.onpointerdown = (event) => {
      from = [event.clientX, event.clientY];
      moved = 0;
      box.setPointerCapture(event.pointerId);
    };
    box.onpointermove = (event) => {
      if (!from) return this.hover(view, event);
      const dx = event.clientX - from[0], dy = event.clientY - from[1];
      moved += Math.abs(dx) + Math.abs(dy);
      this.camera.x -= dx / view.s;
      this.camera.y += dy / view.s;
      from = [event.clientX, event.clientY];
      this.draw();
    };
    box.onpointerup = (event) => {
      if (from && moved < 4) {
        const i = view.particleAt(event.clientX, event.clientY);
        this.pinned = i === this.pinned ? -1 : i;
        this.draw();
      }
      from = null;
    };
    box.onpointercancel = () => { from = null; };
    box.onpointerleave = () => this.hover(view, null);
    box.ondblclick = () => this.wholeView();
    box.addEventListener("wheel", (event) => this.zoom(view, event), { passive: false });
  }

  zoom(view, event) {
    event.preventDefault();
    const box = view.box.getBoundingClientRect();
    const x = (event.clientX - box.left - view.ox) / view.s, y = (view.oy - event.clientY + box.top) / view.s;
    const factor = Math.min(Math.max(Math.exp(-0.0015 * event.deltaY), 0.5), 2);
    const zoom = Math.min(Math.max(this.camera.zoom * factor, 0.5), 400), kept = this.camera.zoom / zoom;
    this.camera = { ...this.camera, zoom, x: x + (this.camera.x - x) * kept, y: y + (this.camera.y - y) * kept };
    this.draw();
  }

  hover(view, event) {
    const tip = this.find("tip"), i = event ? view.particleAt(event.clientX, event.clientY) : -1;
    if (i !== this.marked) {
      this.marked = i;
      this.decorate();
    }
    tip.hidden = i < 0;
    if (i < 0) return;
    tip.textContent = this.describe(view, i);
    const right = event.clientX + 16 + tip.offsetWidth > window.innerWidth;
    tip.style.left = `${event.clientX + (right ? -16 - tip.offsetWidth : 16)}px`;
    tip.style.top = `${Math.min(event.clientY + 12, window.innerHeight - tip.offsetHeight - 8)}px`;
  }

  describe(view, i) {
    const { k, fraction } = view.now, { fields, count, ids } = view.movie;
    const at = (name) => valueAt(fields[name], count, i, k, fraction);
    const along = placeIn(view.movie, ["x", "y", "depth"].map((name) => (fields[name] ? at(name) : 0)));
    const place = along.map((value, axis) => shown(value, 65534 * fields[view.movie.view ? "x" : "xy"[axis]].step)).join(", ");
    const lines = [`particle ${ids ? ids[i] : i}`, `at (${place}) m`];
    for (const [key, q] of Object.entries(this.data.quantities)) {
      if (fields[key]) lines.push(`${q.name}: ${withUnit(shown(at(key)), q.unit)}`);
    }
    return lines.join("\n");
  }

  // --- drawing ---

  draw() {
    if (!this.views[0].pixels) return;
    const key = this.find("quantity").value;
    for (const view of this.views) {
      view.place(this.camera);
      view.draw(this.time, key, this.colours);
    }
    this.decorate();
  }

  decorate() {
    const within = (view, i) => (i < view.movie.count ? i : -1);
    for (const view of this.views) view.decorate(this.find("mesh").checked, within(view, this.marked), within(view, this.pinned));
  }
}

// Coordinates of a point of the picture: two in the plane, three of a body from its place in the picture and its depth.
function placeIn(movie, [x, y, depth]) {
  const view = movie.view;
  return view ? [0, 1, 2].map((axis) => x * view[0][axis] + y * view[1][axis] + depth * view[2][axis]) : [x, y];
}

// The player with all movies at their end; null where there are none. What goes wrong is said on the page, too.
async function startPlayer(data) {
  try {
    const movies = [];
    for (const movie of data.movies) movies.push(await readMovie(movie));
    if (!movies.length) return null;
    const player = new Player(data, movies);
    player.show(player.times.at(-1));
    return player;
  } catch (error) {
    const note = document.createElement("p");
    note.className = "problem";
    note.textContent = `The moving picture cannot be shown: ${error.message}. A browser from 2023 or later is needed.`;
    document.querySelector("main").prepend(note);
    throw error;
  }
}
