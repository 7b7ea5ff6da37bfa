// Draws what a map holds: ground and scale, coverage, ellipses, paths, nodes, and what is being drawn.
"use strict";
elusive.drawFloor = function (floor, pen, width, height) {
  const spec = floor.spec;
  const colour = (name) => elusive.css(floor.root, name);
  const view = (floor.view = new elusive.View(spec.extent, width, height, 26));
  pen.clearRect(0, 0, width, height);
  elusive.axes(pen, view, spec.extent, colour("--ew-grid"), colour("--ew-quiet"));
  elusive.shapes(floor, pen, view);
  if (spec.heat) elusive.heat(pen, view, spec);
  pen.globalAlpha = 0.12;
  elusive.fill(pen, view, spec.corners, spec.heat ? "rgba(0,0,0,0)" : colour("--ew-accent"));
  pen.globalAlpha = 1;
  elusive.line(pen, view, spec.corners, colour("--ew-ink"), 1.5, true);
  for (const [x, y, along, across, angle] of spec.ellipses || []) {
    pen.beginPath();
    pen.ellipse(view.x(x), view.y(y), along * view.scale, across * view.scale, -angle, 0, 2 * Math.PI);
    pen.strokeStyle = spec.heat ? "#ffffff" : colour("--ew-accent");
    pen.globalAlpha = spec.ellipses.length > 300 ? 0.18 : 0.5;
    pen.lineWidth = 1;
    pen.stroke();
    pen.globalAlpha = 1;
  }
  (spec.paths || []).forEach((path, number) => {
    const line = elusive.track(number);
    elusive.line(pen, view, path, line, 2);
    const there = path.filter((point) => point && point[0] !== null);
    for (const point of there) elusive.dot(pen, view.x(point[0]), view.y(point[1]), 1.6, line, true);
    if (there.length) {
      elusive.word(pen, `${number + 1}`, view.x(there[0][0]) + 6, view.y(there[0][1]) - 6, line, 13, colour("--ew-paper"));
      elusive.dot(pen, view.x(there[0][0]), view.y(there[0][1]), 4.5, line, true);
    }
  });
  for (const node of spec.nodes || []) {
    const held = floor.dragged && floor.dragged.node === node;
    const [x, y] = held ? [floor.dragged.x, floor.dragged.y] : [node.x, node.y];
    pen.fillStyle = node.selected ? colour("--ew-warn") : colour("--ew-ink");
    pen.strokeStyle = colour("--ew-paper");
    pen.lineWidth = 1;
    pen.beginPath();
    pen.rect(view.x(x) - 4.5, view.y(y) - 4.5, 9, 9);
    pen.fill();
    pen.stroke();
    if (spec.nodes.length <= 24 || node.selected) {
      pen.font = "11px system-ui, sans-serif";
      pen.fillText(node.name, view.x(x) + 7, view.y(y) - 6);
    }
  }
  elusive.line(pen, view, floor.points, colour("--ew-warn"), 2, false);
  for (const point of floor.points) elusive.dot(pen, view.x(point[0]), view.y(point[1]), 3, colour("--ew-warn"), true);
  if (floor.cursor) elusive.cross(pen, view.x(floor.cursor[0]), view.y(floor.cursor[1]), 9, colour("--ew-warn"));
};

elusive.fill = function (pen, view, corners, colour) {
  pen.beginPath();
  corners.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](view.x(x), view.y(y)));
  pen.closePath();
  pen.fillStyle = colour;
  pen.fill();
};

elusive.heat = function (pen, view, spec) {
  const { rows, columns, most, values, x0, y0, voxel } = spec.heat;
  const table = elusive.table("heat");
  const side = voxel * view.scale;
  values.forEach((value, at) => {
    if (value < 0) return;
    const [row, column] = [Math.floor(at / columns), at % columns];
    pen.fillStyle = value ? `rgb(${elusive.bytes(table, Math.round(40 + (215 * value) / most))})` : "#7f8794";
    pen.fillRect(view.x(x0 + column * voxel), view.y(y0 + (row + 1) * voxel), side + 0.6, side + 0.6);
  });
};

elusive.axes = function (pen, view, extent, grid, ink) {
  const [x0, x1, y0, y1] = extent;
  const raw = Math.max(x1 - x0, y1 - y0) / 6;
  const step = [1, 2, 5, 10].map((k) => k * 10 ** Math.floor(Math.log10(raw))).find((k) => k >= raw);
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = ink;
  pen.strokeStyle = grid;
  pen.lineWidth = 1;
  pen.beginPath();
  pen.textAlign = "center";
  for (let x = Math.ceil(x0 / step) * step; x <= x1 + 1e-9; x += step) {
    pen.moveTo(view.x(x), view.y(y0)); pen.lineTo(view.x(x), view.y(y1));
    pen.fillText(`${Number(x.toFixed(6))}`, view.x(x), view.y(y0) + 15);
  }
  pen.textAlign = "right";
  for (let y = Math.ceil(y0 / step) * step; y <= y1 + 1e-9; y += step) {
    pen.moveTo(view.x(x0), view.y(y)); pen.lineTo(view.x(x1), view.y(y));
    pen.fillText(`${Number(y.toFixed(6))}`, view.x(x0) - 4, view.y(y) + 4);
  }
  pen.stroke();
  pen.textAlign = "left";
  pen.fillText("x, y [m]", view.x(x0) - 20, view.y(y1) - 8);
};
