// What lies beneath a map: a raster of P(water), and polygons and lines, {rings | line, fill, stroke, width, dashed}.
"use strict";
elusive.WATER = ["#c9a24b", "#f5efdc", "#7fb2d9"]; // land, even, water
elusive.UNKNOWN = 255; // of a raster's bytes; the others are shares of 254

elusive.waterColour = function (share) {
  const [low, even, high] = elusive.WATER.map(elusive.rgb);
  const [from, to, at] = share < 0.5 ? [low, even, 2 * share] : [even, high, 2 * share - 1];
  return from.map((part, k) => part + at * (to[k] - part));
};

elusive.shapes = function (floor, pen, view) {
  const { spec } = floor;
  if (!spec.raster && !spec.shapes) return;
  const [x0, x1, y0, y1] = spec.extent;
  pen.save();
  pen.beginPath();
  pen.rect(view.x(x0), view.y(y1), view.x(x1) - view.x(x0), view.y(y0) - view.y(y1));
  pen.clip();
  if (spec.raster) elusive.raster(floor, pen, view, spec.raster);
  const colour = (name) => (name.startsWith("--") ? elusive.css(floor.root, name) : name);
  for (const shape of spec.shapes || []) {
    pen.beginPath();
    for (const ring of shape.rings || [shape.line]) {
      ring.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](view.x(x), view.y(y)));
      if (shape.rings) pen.closePath();
    }
    pen.globalAlpha = shape.alpha || 1;
    if (shape.fill) { pen.fillStyle = colour(shape.fill); pen.fill("evenodd"); }
    pen.setLineDash(shape.dashed ? [5, 4] : []);
    if (shape.stroke) { pen.strokeStyle = colour(shape.stroke); pen.lineWidth = shape.width || 1; pen.stroke(); }
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }
  pen.restore();
};

// the raster comes by URL, once; its first row is in the south
elusive.raster = function (floor, pen, view, told) {
  const held = floor.water;
  if (!held || held.url !== told.url) {
    floor.water = { url: told.url, image: null };
    elusive.fetchRaster(told).then((image) => {
      if (floor.water.url === told.url) { floor.water.image = image; floor.draw(); }
    });
    return;
  }
  if (!held.image) return;
  const [x0, x1, y0, y1] = told.extent;
  pen.imageSmoothingEnabled = true;
  pen.drawImage(held.image, view.x(x0), view.y(y1), view.x(x1) - view.x(x0), view.y(y0) - view.y(y1));
};

elusive.fetchRaster = async function (told) {
  const answer = await fetch(told.url);
  if (!answer.ok) return null;
  const values = new Uint8Array(await answer.arrayBuffer());
  const image = elusive.make("canvas", { width: told.columns, height: told.rows });
  const pen = image.getContext("2d");
  const pixels = pen.createImageData(told.columns, told.rows);
  values.forEach((value, at) => {
    const [row, column] = [Math.floor(at / told.columns), at % told.columns];
    const known = value !== elusive.UNKNOWN;
    const colour = known ? elusive.waterColour(value / 254) : [0, 0, 0];
    pixels.data.set([...colour, known ? 255 : 0], 4 * ((told.rows - 1 - row) * told.columns + column));
  });
  pen.putImageData(pixels, 0, 0);
  return image;
};
