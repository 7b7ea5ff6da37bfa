// What every drawing shares: numbers and times in words, colours, marks, blocks of bytes. Classic scripts, one global.
"use strict";
window.elusive = {};

// makes an element with attributes and children
elusive.make = function (tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
};

// how many of the ascending times are not after t
elusive.upTo = function (times, t) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t + 1e-9) low = middle + 1;
    else high = middle;
  }
  return low;
};

elusive.nearest = function (times, t) {
  const after = elusive.upTo(times, t);
  return after && (after === times.length || t - times[after - 1] <= times[after] - t) ? after - 1 : after;
};

// round numbers from low to high, about so many, no closer than least; two at least, for one alone tells no scale
elusive.ticks = function (low, high, count, least = 0, steps = []) {
  const rough = Math.max((high - low) / Math.max(1, count), least, 1e-12);
  const power = 10 ** Math.floor(Math.log10(rough) + 1e-9);
  const round = [1, 2, 5, 10].map((m) => m * power);
  const step = (rough > 1 && steps.find((one) => one >= 0.999 * rough)) || round.find((one) => one >= 0.999 * rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
    found.push(Number((k * step).toPrecision(12)));
  return found.length < 2 && step > least && count < 16 ? elusive.ticks(low, high, 1.5 * count, least, steps) : found;
};

elusive.OF_CLOCKS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200, 10800, 21600, 43200, 86400];

// a number with as many digits as a step of it needs
elusive.digits = (step) => Math.max(0, Math.min(6, Math.ceil(-Math.log10(Math.max(step, 1e-9)))));

// times in words: frames, seconds, hours of a long recording, or the time of day (UTC) where they are UNIX times
elusive.clockOf = function (times, unit) {
  const span = times.length > 1 ? times[times.length - 1] - times[0] : 0;
  const gap = times.length > 1 ? span / (times.length - 1) : 1;
  const digits = times.every((t) => Number.isInteger(t)) ? 0 : gap < 0.095 ? 2 : 1;
  const two = (value, places) => value.toFixed(places).padStart(places ? 3 + places : 2, "0");
  const hours = (t, places) => {
    const whole = Number(t.toFixed(places));
    return (
      [Math.floor(whole / 3600), Math.floor((whole % 3600) / 60)].map((v) => two(v, 0)).join(":") +
      ":" +
      two(whole % 60, places)
    );
  };
  if (unit !== "s") return { say: (t) => `frame ${t}`, tick: (t) => `${t}`, unit: "frame", least: 1 };
  if (times[0] >= 1e9) {
    const say = (t) => new Date(1000 * t).toISOString().slice(0, 10) + " " + hours(t % 86400, digits) + " UTC";
    return { say, tick: (t) => hours(t % 86400, span < 5 ? 1 : 0), unit: "UTC", least: 0, steps: elusive.OF_CLOCKS };
  }
  if (span >= 7200) {
    const say = (t) => hours(t, digits);
    return { say, tick: (t) => hours(t, 0), unit: "h:min:s", least: 0, steps: elusive.OF_CLOCKS };
  }
  return { say: (t) => `${t.toFixed(digits)} s`, tick: (t) => `${t}`, unit: "s", least: 0 };
};

// ---- colours
elusive.isDark = function () {
  const set = document.body.classList;
  return (
    set.contains("body--dark") || (!set.contains("body--light") && matchMedia("(prefers-color-scheme: dark)").matches)
  );
};
elusive.rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
elusive.lighter = (hex) =>
  "#" + elusive.rgb(hex).map((v) => Math.round(0.45 * 255 + 0.55 * v).toString(16).padStart(2, "0")).join(""); // prettier-ignore
elusive.LABELS = ["#e8590c", "#4c8dff", "#a371f7", "#e64980", "#12b886", "#f2b705", "#15aabf", "#94a3b8"];
elusive.RAMPS = {
  grey: ["#000000", "#ffffff"],
  dim: ["#000000", "#7a7a7a"],
  heat: ["#0b0724", "#3b0f6f", "#8c2981", "#de4968", "#fe9f6d", "#fcfdbf"],
  score: ["#0d1428", "#2563af", "#ecf6ff"],
  water: ["--land", "--balance", "--water"],
};

// 256 colours as RGBA words; a layer of which the last byte stands for the unknown has one fewer on its ramp
elusive.table = function (kind, css, unknown) {
  const words = new Uint32Array(256);
  const bytes = new Uint8ClampedArray(words.buffer);
  const anchors = (elusive.RAMPS[kind] || []).map((one) => elusive.rgb(one.startsWith("--") ? css(one) : one));
  for (let value = 0; value < 256; value++) {
    let colour = [0, 0, 0, 255];
    if (kind === "labels") colour = [...elusive.rgb(value ? elusive.LABELS[(value - 1) % 8] : "#0b0724"), 255];
    else if (kind === "glow") colour = [...elusive.rgb(css("--glow")), 0.9 * value];
    else {
      const place = (Math.min(1, value / (unknown ? 254 : 255)) || 0) * (anchors.length - 1);
      const low = Math.min(Math.floor(place), anchors.length - 2);
      anchors[low].forEach((part, k) => (colour[k] = part + (place - low) * (anchors[low + 1][k] - part)));
    }
    bytes.set(colour, 4 * value);
  }
  if (unknown) bytes.set([...elusive.rgb(css("--unknown")), 255], 4 * 255);
  return words;
};

elusive.gradient = function (words) {
  const bytes = new Uint8ClampedArray(words.buffer);
  const stops = [0, 51, 102, 153, 204, 254].map(
    (v) => `rgba(${[...bytes.slice(4 * v, 4 * v + 3), bytes[4 * v + 3] / 255].join(",")})`,
  );
  return `linear-gradient(90deg, ${stops.join(", ")})`;
};

// ---- bytes: as they are, or packed into a report
elusive.bytes = async function (block) {
  if (block instanceof Uint8Array) return block;
  const packed = Uint8Array.from(atob(block.deflate), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

// ---- marks
elusive.polyline = function (pen, points, width, dash = []) {
  pen.lineWidth = width;
  pen.lineJoin = pen.lineCap = "round";
  pen.setLineDash(dash);
  pen.beginPath();
  let open = false;
  for (const point of points) {
    if (point) pen[open ? "lineTo" : "moveTo"](point[0], point[1]);
    open = Boolean(point);
  }
  pen.stroke();
  pen.setLineDash([]);
};

elusive.CORNERS = {
  square: [[-1, -1], [1, -1], [1, 1], [-1, 1]],
  diamond: [[0, -1.4], [1.4, 0], [0, 1.4], [-1.4, 0]],
  triangle: [[0, -1.3], [1.1, 0.9], [-1.1, 0.9]],
}; // prettier-ignore
elusive.marker = function (pen, kind, x, y, r) {
  pen.beginPath();
  if (kind === "cross" || kind === "plus") {
    const s = kind === "cross" ? 0.75 * r : 0;
    const ends = s ? [[-s, -s, s, s], [-s, s, s, -s]] : [[-r, 0, r, 0], [0, -r, 0, r]]; // prettier-ignore
    for (const [a, b, c, d] of ends) {
      pen.moveTo(x + a, y + b);
      pen.lineTo(x + c, y + d);
    }
    pen.stroke();
  } else if (elusive.CORNERS[kind]) {
    for (const [a, b] of elusive.CORNERS[kind]) pen.lineTo(x + r * a, y + r * b);
    pen.fill();
  } else if (kind === "box") {
    pen.strokeRect(x - 3 * r, y - 3 * r, 6 * r, 6 * r);
  } else {
    pen.arc(x, y, r, 0, 7);
    pen[kind === "ring" ? "stroke" : "fill"]();
  }
};

elusive.font = (size) => `600 ${size}px system-ui, sans-serif`;
elusive.word = function (pen, text, x, y, colour, halo, size = 13) {
  pen.font = elusive.font(size);
  pen.lineJoin = "round";
  pen.lineWidth = 3.5;
  pen.strokeStyle = halo;
  pen.strokeText(text, x, y);
  pen.fillStyle = colour;
  pen.fillText(text, x, y);
};
