// One frame as a surface that can be turned: painter's algorithm over the cells, far ones first.
"use strict";
elusive.Surface = class {
  constructor(canvas, redraw) {
    [this.yaw, this.pitch] = [-0.7, 0.75];
    this.turning = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.active) return;
      this.turning = [event.clientX, event.clientY];
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.turning) return;
      this.turn((event.clientX - this.turning[0]) / 120, (event.clientY - this.turning[1]) / 120);
      this.turning = [event.clientX, event.clientY];
      redraw();
    });
    for (const ended of ["pointerup", "pointercancel"]) canvas.addEventListener(ended, () => { this.turning = null; });
    this.active = false;
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(0.15, Math.min(1.5, this.pitch + pitch));
  }

  // values: a frame of `rows` x `columns` bytes, first row at the least y
  draw(pen, width, height, values, rows, columns, colours, ground) {
    const every = Math.max(1, Math.ceil(Math.max(rows, columns) / 64));
    const [r, c] = [Math.floor((rows - 1) / every) + 1, Math.floor((columns - 1) / every) + 1];
    const [cos, sin, tilt, rise] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    const scale = 0.68 * Math.min(width, height * 1.15);
    const px = new Float32Array(r * c), py = new Float32Array(r * c), depth = new Float32Array(r * c);
    for (let i = 0; i < r; i++) {
      for (let j = 0; j < c; j++) {
        const x = j / (c - 1) - 0.5, y = i / (r - 1) - 0.5, z = values[i * every * columns + j * every] / 255;
        const across = cos * x - sin * y, away = sin * x + cos * y;
        px[i * c + j] = width / 2 + scale * across;
        py[i * c + j] = height * 0.56 - scale * (away * tilt + 0.55 * z * rise);
        depth[i * c + j] = away;
      }
    }
    const cells = [];
    for (let i = 0; i + 1 < r; i++) for (let j = 0; j + 1 < c; j++) cells.push(i * c + j);
    cells.sort((a, b) => depth[b] - depth[a]);
    pen.fillStyle = ground;
    pen.fillRect(0, 0, width, height);
    pen.lineWidth = 0.4;
    for (const at of cells) {
      const [i, j] = [Math.floor(at / c), at % c];
      const value = Math.max(
        values[i * every * columns + j * every], values[(i + 1) * every * columns + (j + 1) * every],
      );
      pen.beginPath();
      pen.moveTo(px[at], py[at]);
      for (const next of [at + 1, at + c + 1, at + c]) pen.lineTo(px[next], py[next]);
      pen.closePath();
      pen.fillStyle = colours[value];
      pen.fill();
      pen.strokeStyle = "rgba(255,255,255,.13)";
      pen.stroke();
    }
  }
};
