// One frame of an image as a surface that can be turned: painter's algorithm over the cells, far ones first.
"use strict";
elusive.Surface = class {
  constructor(panel, layer) {
    [this.panel, this.layer, this.yaw, this.pitch, this.active] = [panel, layer, -0.7, 0.75, false];
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(0.15, Math.min(1.5, this.pitch + pitch));
  }

  draw(pen, width, height, at) {
    const { layer } = this;
    const { rows, columns } = layer;
    const block = at.block(layer.block);
    if (!block) return;
    const start = elusive.frameOf(layer, at.t) * rows * columns;
    const words = elusive.table(layer.colours, at.css);
    const colours = Array.from(words, (word) => `rgb(${word & 255},${(word >> 8) & 255},${(word >> 16) & 255})`);
    const every = Math.max(1, Math.ceil(Math.max(rows, columns) / 64));
    const [r, c] = [Math.floor((rows - 1) / every) + 1, Math.floor((columns - 1) / every) + 1];
    const value = (i, j) => block[start + i * every * columns + j * every];
    const [cos, sin, tilt, rise] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.sin(this.pitch), Math.cos(this.pitch)];
    const scale = 0.68 * Math.min(width, height * 1.15);
    const [px, py, depth, cells] = [new Float32Array(r * c), new Float32Array(r * c), new Float32Array(r * c), []];
    for (let i = 0; i < r; i++) {
      for (let j = 0; j < c; j++) {
        const [x, y] = [j / (c - 1) - 0.5, i / (r - 1) - 0.5];
        const [across, away, k] = [cos * x - sin * y, sin * x + cos * y, i * c + j];
        px[k] = width / 2 + scale * across;
        py[k] = height * 0.56 - scale * (away * tilt + (0.55 * value(i, j) * rise) / 255);
        depth[k] = away;
        if (i + 1 < r && j + 1 < c) cells.push(k);
      }
    }
    cells.sort((a, b) => depth[b] - depth[a]);
    pen.fillStyle = colours[0];
    pen.fillRect(0, 0, width, height);
    pen.lineWidth = 0.4;
    pen.strokeStyle = "rgba(255,255,255,.13)";
    for (const k of cells) {
      const [i, j] = [Math.floor(k / c), k % c];
      pen.beginPath();
      for (const corner of [k, k + 1, k + c + 1, k + c]) pen.lineTo(px[corner], py[corner]);
      pen.closePath();
      pen.fillStyle = colours[Math.max(value(i, j), value(i + 1, j + 1))];
      pen.fill();
      pen.stroke();
    }
  }
};
