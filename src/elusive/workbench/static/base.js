// What every canvas of the workbench shares: colours, metres to pixels, marks. Plain JavaScript, no build step.
"use strict";
const elusive = (window.elusive = window.elusive || { made: {} });

elusive.HEAT = ["#0b0724", "#3b0f6f", "#8c2981", "#de4968", "#fe9f6d", "#fcfdbf"];
elusive.TRACKS = ["#e8590c", "#4c8dff", "#a371f7", "#e64980", "#12b886", "#f2b705", "#15aabf", "#94a3b8"];
elusive.CONFIRMED = "#2fbf71";
elusive.CANDIDATE = "#ff6b6b";

elusive.rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

// 256 colours as RGBA: a ramp between anchors, or one colour a label (0 is the ground)
elusive.table = function (kind) {
  const table = new Uint32Array(256);
  const bytes = new Uint8ClampedArray(table.buffer);
  for (let value = 0; value < 256; value++) {
    let colour;
    if (kind === "labels") {
      colour = value ? elusive.rgb(elusive.TRACKS[(value - 1) % elusive.TRACKS.length]) : elusive.rgb("#0b0724");
    } else if (kind === "grey") {
      colour = [value, value, value];
    } else {
      const anchors = elusive.HEAT.map(elusive.rgb);
      const at = (value / 255) * (anchors.length - 1);
      const low = Math.min(Math.floor(at), anchors.length - 2);
      colour = anchors[low].map((part, k) => part + (at - low) * (anchors[low + 1][k] - part));
    }
    bytes.set([...colour, 255], 4 * value);
  }
  return table;
};

elusive.css = (element, name) => getComputedStyle(element).getPropertyValue(name).trim();

// makes an element with attributes and children
elusive.make = function (tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};

// fits a canvas to its box, in device pixels; tells its size in CSS pixels
elusive.fit = function (canvas) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return { pen, width, height };
};

// metres (or pixels of an image) to pixels of a canvas; aspect kept, y upwards unless told otherwise
elusive.View = class {
  constructor(extent, width, height, margin = 0, down = false) {
    const [x0, x1, y0, y1] = extent;
    this.scale = Math.min((width - 2 * margin) / (x1 - x0), (height - 2 * margin) / (y1 - y0));
    this.left = (width - this.scale * (x1 - x0)) / 2 - this.scale * x0;
    this.up = down ? 1 : -1;
    this.top = down
      ? (height - this.scale * (y1 - y0)) / 2 - this.scale * y0
      : (height + this.scale * (y1 - y0)) / 2 + this.scale * y0;
  }
  x(x) { return this.left + this.scale * x; }
  y(y) { return this.top + this.up * this.scale * y; }
  back(px, py) { return [(px - this.left) / this.scale, (py - this.top) / (this.up * this.scale)]; }
};

elusive.line = function (pen, view, points, colour, width = 1.5, close = false) {
  pen.beginPath();
  let broken = true;
  for (const point of points) {
    if (!point || point[0] === null) { broken = true; continue; }
    pen[broken ? "moveTo" : "lineTo"](view.x(point[0]), view.y(point[1]));
    broken = false;
  }
  if (close) pen.closePath();
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.lineJoin = pen.lineCap = "round";
  pen.stroke();
};

elusive.cross = function (pen, x, y, size, colour) {
  for (const [style, width] of [["rgba(0,0,0,.6)", 3.4], [colour, 1.6]]) {
    pen.beginPath();
    pen.moveTo(x - size, y); pen.lineTo(x + size, y);
    pen.moveTo(x, y - size); pen.lineTo(x, y + size);
    pen.strokeStyle = style; pen.lineWidth = width; pen.stroke();
  }
};

elusive.dot = function (pen, x, y, radius, colour, filled) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.lineWidth = filled ? 1 : 2;
  pen.strokeStyle = filled ? "rgba(0,0,0,.7)" : colour;
  if (filled) { pen.fillStyle = colour; pen.fill(); }
  pen.stroke();
};

elusive.word = function (pen, text, x, y, colour, size = 12, halo = "rgba(0,0,0,.75)") {
  pen.font = `600 ${size}px system-ui, sans-serif`;
  pen.lineWidth = 3;
  pen.lineJoin = "round";
  pen.strokeStyle = halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
};
