// One panel of the player. Particles are discs written into a picture by hand; a second buffer keeps which particle each
// pixel shows, so that the mouse finds it at once. This needs no graphics card and takes some milliseconds for 100,000 particles.
"use strict";

const MARGIN = { left: 44, right: 12, top: 10, bottom: 34 };

class View {
  constructor(movie, colourLimits, host) {
    this.movie = movie;
    this.limits = colourLimits;
    this.element = document.createElement("div");
    this.element.className = "panel";
    this.element.innerHTML = '<h3></h3><div class="view"><canvas></canvas><canvas></canvas></div>';
    this.element.querySelector("h3").textContent = movie.title;
    host.append(this.element);
    this.box = this.element.querySelector(".view");
    [this.picture, this.overlay] = this.element.querySelectorAll("canvas");
  }

  resize(height) {
    const width = this.box.clientWidth;
    this.box.style.height = `${height}px`;
    // Twice the pixels of the screen where these are coarse: the browser's scaling then smooths the edges of the discs.
    const ratio = window.devicePixelRatio || 1;
    this.ratio = ratio < 1.5 ? 2 * ratio : ratio;
    for (const canvas of [this.picture, this.overlay]) {
      canvas.width = Math.round(width * this.ratio);
      canvas.height = Math.round(height * this.ratio);
    }
    this.context = this.picture.getContext("2d");
    this.image = this.context.createImageData(this.picture.width, this.picture.height);
    this.pixels = new Uint32Array(this.image.data.buffer);
    this.shownParticle = new Int32Array(this.pixels.length);
    this.width = width;
    this.height = height;
  }

  // World to picture: px = ox + s x, py = oy - s y, in pixels of the screen.
  place(camera) {
    const w = this.width - MARGIN.left - MARGIN.right, h = this.height - MARGIN.top - MARGIN.bottom;
    this.s = camera.zoom * Math.min(w / camera.width, h / camera.height);
    this.ox = MARGIN.left + w / 2 - this.s * camera.x;
    this.oy = MARGIN.top + h / 2 + this.s * camera.y;
  }

  frameAt(time) {
    const times = this.movie.times, last = times.length - 1;
    let k = 0;
    while (k < last && times[k + 1] <= time) k++;
    return { k, fraction: k < last ? Math.max(0, (time - times[k]) / (times[k + 1] - times[k])) : 0 };
  }

  draw(time, key, colours) {
    const { k, fraction } = (this.now = this.frameAt(time));
    this.pixels.fill(0);
    this.shownParticle.fill(-1);
    const { x, y, radius } = this.movie.fields, field = this.movie.fields[key];
    const n = this.movie.count, r = this.ratio, at = k * n, next = fraction > 0 ? at + n : at;
    const [low, high] = this.limits[key], toColour = field ? 256 / (high - low) : 0;
    const order = this.backToFront(k), light = this.movie.fields.light;
    for (let place = 0; place < n; place++) {
      const i = order ? order[place] : place;
      const xa = x.values[at + i];
      if (xa === ABSENT) continue;
      const f = x.values[next + i] === ABSENT ? 0 : fraction, j = f > 0 ? next : at;
      const px = r * (this.ox + this.s * (x.low + x.step * (xa + f * (x.values[j + i] - xa))));
      const ya = y.values[at + i], py = r * (this.oy - this.s * (y.low + y.step * (ya + f * (y.values[j + i] - ya))));
      const size = Math.max(0.7, r * this.s * (radius.low + radius.step * radius.values[at + i]));
      let colour = 0xffc0c0c0;
      if (field) {
        const va = field.values[at + i], value = field.low + field.step * (va + f * (field.values[j + i] - va));
        const c = (value - low) * toColour;
        colour = colours[c < 0 ? 0 : c > 255 ? 255 : c | 0];
      }
      if (light) colour = shaded(colour, light.low + light.step * light.values[at + i]);
      this.disc(px, py, size, colour, i);
    }
    this.context.putImageData(this.image, 0, 0);
  }

  // Particles of a body at frame k in the order of their depth, sorted by counting its 16 bits; null in the plane.
  backToFront(k) {
    const depth = this.movie.fields.depth, n = this.movie.count;
    if (!depth || this.sorted?.k === k) return depth ? this.sorted.order : null;
    const starts = new Uint32Array(65537), order = new Uint32Array(n);
    for (let i = 0; i < n; i++) starts[depth.values[k * n + i] + 1]++;
    for (let level = 0; level < 65536; level++) starts[level + 1] += starts[level];
    for (let i = 0; i < n; i++) order[starts[depth.values[k * n + i]]++] = i;
    this.sorted = { k, order };
    return order;
  }

  disc(px, py, size, colour, i) {
    const w = this.picture.width, h = this.picture.height;
    const first = Math.max(0, Math.ceil(py - size)), last = Math.min(h - 1, Math.floor(py + size));
    for (let row = first; row <= last; row++) {
      const half = Math.sqrt(size * size - (row - py) * (row - py));
      const a = row * w + Math.max(0, Math.ceil(px - half)), b = row * w + Math.min(w - 1, Math.floor(px + half));
      for (let p = a; p <= b; p++) {
        this.pixels[p] = colour;
        this.shownParticle[p] = i;
      }
    }
  }

  // Number of the particle at a point of the screen, -1 for none.
  particleAt(clientX, clientY) {
    const box = this.box.getBoundingClientRect();
    const column = Math.floor((clientX - box.left) * this.ratio), row = Math.floor((clientY - box.top) * this.ratio);
    if (column < 0 || row < 0 || column >= this.picture.width || row >= this.picture.height) return -1;
    return this.shownParticle[row * this.picture.width + column];
  }

  screenOf(i, k = this.now.k, fraction = this.now.fraction) {
    const { x, y } = this.movie.fields, n = this.movie.count;
    return [this.ox + this.s * valueAt(x, n, i, k, fraction), this.oy - this.s * valueAt(y, n, i, k, fraction)];
  }

  decorate(showMesh, marked, pinned) {
    const c = this.overlay.getContext("2d"), scene = this.movie.scene;
    c.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    c.clearRect(0, 0, this.width, this.height);
    c.save();
    c.beginPath();
    c.rect(MARGIN.left, 0, this.width - MARGIN.left, this.height - MARGIN.bottom);
    c.clip();
    if (showMesh && scene.mesh) this.segments(c, scene.mesh, "rgba(60,70,80,.45)", 0.6);
    this.segments(c, scene.outline, "#8c8c8c", 1);
    this.segments(c, scene.boundary, "#111", 1.4);
    this.segments(c, this.bodies(), "#1d3a5f", 2.2);
    if (pinned >= 0) this.path(c, pinned);
    for (const i of [marked, pinned]) if (i >= 0) this.ring(c, i);
    c.restore();
    this.axes(c);
  }

  // Rigid surfaces at the time that is shown.
  bodies() {
    const { k, fraction } = this.now, all = this.movie.bodies;
    return fraction > 0 ? all[k].map((a, i) => a + fraction * (all[k + 1][i] - a)) : all[k];
  }

  segments(c, xy, colour, width) {
    c.beginPath();
    for (let i = 0; i < xy.length; i += 4) {
      c.moveTo(this.ox + this.s * xy[i], this.oy - this.s * xy[i + 1]);
      c.lineTo(this.ox + this.s * xy[i + 2], this.oy - this.s * xy[i + 3]);
    }
    c.strokeStyle = colour;
    c.lineWidth = width;
    c.stroke();
  }

  path(c, i) {
    for (const [colour, width] of [["#fff", 4], ["#d8321e", 2]]) {
      c.beginPath();
      for (let k = 0; k < this.movie.times.length; k++) c.lineTo(...this.screenOf(i, k, 0));
      c.strokeStyle = colour;
      c.lineWidth = width;
      c.stroke();
    }
  }

  ring(c, i) {
    const [px, py] = this.screenOf(i);
    for (const [colour, width] of [["#fff", 4], ["#d8321e", 2]]) {
      c.beginPath();
      c.arc(px, py, 6, 0, 7);
      c.strokeStyle = colour;
      c.lineWidth = width;
      c.stroke();
    }
  }

  axes(c) {
    const right = this.width - MARGIN.right, bottom = this.height - MARGIN.bottom;
    c.font = "11px Arial, 'DejaVu Sans', sans-serif";
    c.fillStyle = c.strokeStyle = "#5d6875";
    c.lineWidth = 1;
    c.textAlign = "center";
    const ticksX = niceTicks((MARGIN.left - this.ox) / this.s, (right - this.ox) / this.s, this.width / 90);
    const ticksY = niceTicks((this.oy - bottom) / this.s, (this.oy - MARGIN.top) / this.s, this.height / 60);
    c.beginPath();
    c.moveTo(MARGIN.left, MARGIN.top);
    c.lineTo(MARGIN.left, bottom);
    c.lineTo(right, bottom);
    for (const x of ticksX) {
      const px = this.ox + this.s * x;
      c.moveTo(px, bottom);
      c.lineTo(px, bottom + 4);
      c.fillText(shown(x, spanOf(ticksX)), px, bottom + 15);
    }
    c.fillText(this.movie.axes[0], (MARGIN.left + right) / 2, bottom + 29);
    c.textAlign = "right";
    for (const y of ticksY) {
      const py = this.oy - this.s * y;
      c.moveTo(MARGIN.left, py);
      c.lineTo(MARGIN.left - 4, py);
      c.fillText(shown(y, spanOf(ticksY)), MARGIN.left - 7, py + 4);
    }
    c.stroke();
    c.save();
    c.translate(11, (MARGIN.top + bottom) / 2);
    c.rotate(-Math.PI / 2);
    c.textAlign = "center";
    c.fillText(this.movie.axes[1], 0, 0);
    c.restore();
    if (this.movie.view) this.directions(c);
  }

  // The axes x, y and z of a body, in the upper right corner.
  directions(c) {
    const [right, up] = this.movie.view, x = this.width - MARGIN.right - 42, y = MARGIN.top + 42;
    c.textAlign = "center";
    ["x", "y", "z"].forEach((name, axis) => {
      c.beginPath();
      c.moveTo(x, y);
      c.lineTo(x + 28 * right[axis], y - 28 * up[axis]);
      c.stroke();
      c.fillText(name, x + 36 * right[axis], y - 36 * up[axis] + 4);
    });
  }
}

function shaded(colour, light) {
  const part = (shift) => Math.min(255, Math.round(light * ((colour >> shift) & 255))) << shift;
  return ((255 << 24) | part(16) | part(8) | part(0)) >>> 0;
}
