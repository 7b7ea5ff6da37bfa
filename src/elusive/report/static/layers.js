// One painter a kind of layer: painter(layer, pen, view, at), `at` being the time, its colours and the chosen track.
// A layer with times has show "all", "past", "now" or "near"; one of a track is faint while another track is chosen.
"use strict";
elusive.layers = {};

// indices of a layer's entries that are shown
elusive.shown = function (layer, count, at) {
  const times = layer.times;
  if (!times || (layer.show || "all") === "all") return [0, count];
  if (layer.show === "past") return [0, elusive.upTo(times, at.t)];
  const t = layer.show === "now" ? at.t : times.length ? times[elusive.nearest(times, at.t)] : 0;
  if (layer.show === "near" && Math.abs(t - at.t) > (layer.reach ?? Infinity)) return [0, 0];
  return [elusive.upTo(times, t - 2e-6 - 1e-9), elusive.upTo(times, t)];
};

elusive.layers.image = function (layer, pen, view, at) {
  const [x0, x1, y0, y1] = layer.extent;
  const [left, right] = [view.X(x0), view.X(x1)].sort((a, b) => a - b);
  const [top, bottom] = [view.Y(y0), view.Y(y1)].sort((a, b) => a - b);
  if (right < view.left || left > view.right || bottom < view.top || top > view.bottom) return;
  const image = elusive.imageOf(layer, at);
  if (!image) return;
  pen.imageSmoothingEnabled = Boolean(layer.smooth);
  pen.save();
  if (layer.within) (elusive.trace(pen, layer.within, view), pen.clip());
  pen.drawImage(image, left, top, right - left, bottom - top);
  pen.restore();
};

elusive.frameOf = (layer, t) =>
  (layer.pictures?.length ?? layer.frames) > 1 ? Math.max(0, elusive.upTo(layer.times, t) - 1) : 0;

// bytes of the frame that is shown; null while they are not there
elusive.frameBytes = function (layer, at) {
  const frame = elusive.frameOf(layer, at.t);
  if (layer.pictures)
    return layer.pictures.length && at.t > layer.times[0] - 1e-6 ? elusive.unpacked(layer.pictures, frame) : null;
  const size = layer.rows * layer.columns;
  return at.block(layer.block)?.subarray(frame * size, (frame + 1) * size);
};

elusive.imageOf = function (layer, at) {
  const bytes = elusive.frameBytes(layer, at);
  const held = layer.held;
  if (!bytes) return null;
  if (held && held.bytes.buffer === bytes.buffer && held.bytes.byteOffset === bytes.byteOffset && held.dark === at.dark)
    return held.canvas;
  const { rows, columns } = layer;
  const canvas = held ? held.canvas : elusive.make("canvas", { width: columns, height: rows });
  const pen = canvas.getContext("2d");
  const pixels = pen.createImageData(columns, rows);
  const words = new Uint32Array(pixels.data.buffer);
  const table = elusive.table(layer.colours, at.css, layer.unknown);
  for (let row = 0; row < rows; row++) {
    const to = (layer.down ? row : rows - 1 - row) * columns; // the first row of a map is in the south
    for (let column = 0; column < columns; column++) words[to + column] = table[bytes[row * columns + column]];
  }
  pen.putImageData(pixels, 0, 0);
  layer.held = { bytes, dark: at.dark, canvas };
  return canvas;
};

// the number under a place; null outside, and where nothing is known
elusive.valueAt = function (layer, x, y, at) {
  const [x0, x1, y0, y1] = layer.extent;
  const column = Math.floor(((x - x0) / (x1 - x0)) * layer.columns);
  const row = Math.floor(((y - y0) / (y1 - y0)) * layer.rows);
  const bytes = elusive.frameBytes(layer, at);
  if (!bytes || !(column >= 0 && row >= 0 && column < layer.columns && row < layer.rows)) return null;
  const byte = bytes[row * layer.columns + column];
  if (layer.unknown && byte === 255) return null;
  return layer.low + (byte / (layer.unknown ? 254 : 255)) * (layer.high - layer.low);
};

// rings of x and y in turn; an edge along a side of `cut` is where the shape was cut off, not its border
elusive.trace = function (pen, rings, view, cut = null) {
  pen.beginPath();
  for (const ring of rings) {
    const count = ring.length;
    const along = (i, j) =>
      cut &&
      ((ring[i] === ring[j] && (ring[i] === cut[0] || ring[i] === cut[1])) ||
        (ring[i + 1] === ring[j + 1] && (ring[i + 1] === cut[2] || ring[i + 1] === cut[3])));
    pen.moveTo(view.X(ring[0]), view.Y(ring[1]));
    for (let i = 2; i <= count; i += 2) {
      const j = i % count;
      pen[along(i - 2, j) ? "moveTo" : "lineTo"](view.X(ring[j]), view.Y(ring[j + 1]));
    }
    if (!cut) pen.closePath();
  }
};

elusive.layers.area = function (layer, pen, view, at) {
  if (layer.fill) {
    elusive.trace(pen, layer.rings, view);
    pen.fillStyle = at.ink(layer.fill);
    pen.globalAlpha = layer.fillAlpha ?? 1;
    pen.fill("evenodd");
    pen.globalAlpha = 1;
  }
  if (!layer.colour) return;
  elusive.trace(pen, layer.rings, view, layer.cut);
  pen.strokeStyle = at.ink(layer.colour);
  pen.lineWidth = layer.width || 1.2;
  pen.setLineDash(layer.dash || []);
  pen.stroke();
  pen.setLineDash([]);
};

elusive.layers.line = function (layer, pen, view, at) {
  const points = layer.x.map((x, i) => (x === null || layer.y[i] === null ? null : [view.X(x), view.Y(layer.y[i])]));
  const stepped = layer.step
    ? points.flatMap((p, i) => (i && p && points[i - 1] ? [[p[0], points[i - 1][1]], p] : [p]))
    : points;
  const alpha = at.share(layer) * (layer.alpha ?? 1);
  pen.strokeStyle = pen.fillStyle = at.ink(layer.colour);
  pen.globalAlpha = layer.times ? 0.45 * alpha : alpha;
  elusive.polyline(pen, stepped, layer.width || 1.8, layer.dash);
  if (layer.times) {
    const n = elusive.upTo(layer.times, at.t);
    pen.globalAlpha = alpha;
    elusive.polyline(pen, points.slice(0, n), layer.width || 1.8, layer.dash);
    const here = layer.head && elusive.placeAt(layer, at.t);
    pen.globalAlpha = 1;
    if (here) {
      pen.lineWidth = 1.8;
      elusive.marker(pen, layer.head, view.X(here[0]), view.Y(here[1]), 5);
      if (layer.text)
        elusive.word(
          pen,
          layer.text,
          view.X(here[0]) + 9,
          view.Y(here[1]) + 12,
          at.ink(layer.colour),
          at.css("--paper"),
        );
    }
  }
  pen.globalAlpha = 1;
};

// place on a path at a time, between its points; null before its start, after its end and in a gap
elusive.placeAt = function (path, t) {
  const n = elusive.upTo(path.times, t);
  if (!n || t > path.times[path.times.length - 1] + 1e-9 || path.x[n - 1] === null) return null;
  const m = Math.min(n, path.times.length - 1);
  if (path.x[m] === null || path.times[m] <= path.times[n - 1]) return [path.x[n - 1], path.y[n - 1]];
  const s = (t - path.times[n - 1]) / (path.times[m] - path.times[n - 1]);
  return [path.x[n - 1] + s * (path.x[m] - path.x[n - 1]), path.y[n - 1] + s * (path.y[m] - path.y[n - 1])];
};

elusive.layers.points = function (layer, pen, view, at) {
  const [first, after] = elusive.shown(layer, layer.x.length, at);
  const kind = layer.marker || "dot";
  pen.globalAlpha = (layer.alpha ?? 1) * at.share(layer);
  pen.lineWidth = layer.width || 1.6;
  pen.fillStyle = pen.strokeStyle = at.ink(layer.colour);
  for (let i = first; i < after; i++) {
    if (layer.x[i] === null || layer.y[i] === null) continue;
    if (layer.colours) pen.fillStyle = pen.strokeStyle = at.ink(layer.colours[i]);
    const [x, y] = [view.X(layer.x[i]), view.Y(layer.y[i])];
    const size = layer.radius ? layer.radius * Math.abs(view.sx) : layer.size || 3;
    if (kind === "dot" && size < 2.5) pen.fillRect(x - size, y - size, 2 * size, 2 * size);
    else elusive.marker(pen, kind, x, y, size);
    if (layer.texts && layer.texts[i] !== "") {
      // on the same side of all, or two neighbours' would meet; but no name leaves the panel
      pen.font = elusive.font(12);
      pen.textAlign = x + 8 + pen.measureText(layer.texts[i]).width > view.right ? "right" : "left";
      elusive.word(
        pen,
        layer.texts[i],
        x + (pen.textAlign === "left" ? 8 : -8),
        y - 9,
        pen.fillStyle,
        at.css("--halo"),
        12,
      );
      pen.textAlign = "left";
    }
  }
  pen.globalAlpha = 1;
};

elusive.layers.segments = function (layer, pen, view, at) {
  const [first, after] = elusive.shown(layer, layer.ends.length, at);
  pen.globalAlpha = layer.alpha ?? 1;
  for (let i = first; i < after; i++) {
    const [a, b, c, d] = layer.ends[i];
    pen.strokeStyle = at.ink(layer.colours ? layer.colours[i] : layer.colour);
    elusive.polyline(pen, [[view.X(a), view.Y(b)], [view.X(c), view.Y(d)]], layer.width || 1); // prettier-ignore
  }
  pen.globalAlpha = 1;
};

elusive.layers.ellipses = function (layer, pen, view, at) {
  const [first, after] = elusive.shown(layer, layer.of.length, at);
  pen.globalAlpha = layer.alpha ?? 1;
  pen.strokeStyle = at.ink(layer.colour);
  pen.lineWidth = layer.width || 1;
  for (let i = first; i < after; i++) {
    const [x, y, along, across, angle] = layer.of[i];
    pen.beginPath();
    pen.ellipse(view.X(x), view.Y(y), along * view.sx, across * view.sx, -angle, 0, 7);
    pen.stroke();
  }
  pen.globalAlpha = 1;
};

elusive.layers.spans = function (layer, pen, view, at) {
  pen.fillStyle = at.ink(layer.colour);
  pen.globalAlpha = layer.alpha ?? 0.14;
  for (const [from, to] of layer.spans)
    pen.fillRect(view.X(from), view.top, Math.max(1, view.X(to) - view.X(from)), view.bottom - view.top);
  pen.globalAlpha = 1;
};

elusive.layers.bars = function (layer, pen, view, at) {
  pen.fillStyle = at.ink(layer.colour);
  layer.x.forEach((x, i) => {
    const [left, right] = [view.X(x + layer.from * layer.width), view.X(x + layer.to * layer.width)];
    pen.fillRect(left, view.Y(layer.y[i]), Math.max(1, right - left - 1), view.Y(0) - view.Y(layer.y[i]));
  });
};
