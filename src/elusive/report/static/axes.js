// What tells numbers about a panel: axes with units, scale bar, ruler, colour bar, longitude and latitude.
"use strict";
elusive.axes = function (panel, pen, view, at, height) {
  const { spec, figure } = panel;
  const [[x0, y0], [x1, y1]] = [view.back(view.left, view.bottom), view.back(view.right, view.top)];
  const clock = spec.x.time ? figure.clock : null;
  const wide = view.right - view.left;
  const xs = elusive.ticks(
    x0,
    x1,
    Math.max(2, Math.min(8, wide / (clock ? 95 : 80))),
    clock ? clock.least : spec.x.least,
    clock?.steps,
  );
  const ys = elusive.ticks(
    Math.min(y0, y1),
    Math.max(y0, y1),
    Math.max(2, (view.bottom - view.top) / 36),
    spec.y.least,
  );
  pen.font = `${view.small ? 10 : 11}px system-ui, sans-serif`;
  pen.fillStyle = at.css("--soft");
  pen.strokeStyle = at.css("--line");
  pen.lineWidth = 1;
  pen.beginPath();
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const y of ys) {
    if (!spec.bare) (pen.moveTo(view.left, view.Y(y)), pen.lineTo(view.right, view.Y(y)));
    pen.fillText(`${y}`, view.left - 5, view.Y(y));
  }
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const x of xs) {
    if (spec.plane && !spec.bare) (pen.moveTo(view.X(x), view.top), pen.lineTo(view.X(x), view.bottom));
    const words = clock ? clock.tick(x) : `${x}`;
    const half = 0.5 * pen.measureText(words).width;
    pen.fillText(words, Math.max(view.left + half - 6, Math.min(view.right + 6 - half, view.X(x))), view.bottom + 5);
  }
  pen.stroke();
  if (view.small) return;
  const named = (axis, unit) => (unit ? `${axis.title || ""} [${unit}]`.trim() : axis.title || "");
  pen.fillText(named(spec.x, clock ? clock.unit : spec.x.unit), 0.5 * (view.left + view.right), height - 14);
  pen.save();
  pen.translate(10, 0.5 * (view.top + view.bottom));
  pen.rotate(-Math.PI / 2);
  pen.textBaseline = "middle";
  pen.fillText(named(spec.y, spec.y.unit), 0, 0, view.bottom - view.top);
  pen.restore();
  [pen.textAlign, pen.textBaseline] = ["left", "alphabetic"];
};

elusive.scaleBar = function (pen, view, at) {
  const most = Math.max(1e-3, (0.25 * (view.right - view.left)) / view.sx);
  const power = 10 ** Math.floor(Math.log10(most));
  const length = power * [5, 2, 1].find((m) => m * power <= most);
  const [long, x, y] = [length * view.sx, view.right - 12 - length * view.sx, view.bottom - 10];
  const ends = [[x, y - 4], [x, y], [x + long, y], [x + long, y - 4]]; // prettier-ignore
  // no box behind it, which would hide what lies there
  for (const [colour, width] of [
    ["--halo", 5],
    ["--ink", 2],
  ]) {
    // prettier-ignore
    pen.strokeStyle = colour === "--halo" ? at.css(colour) : at.ink(colour);
    elusive.polyline(pen, ends, width);
  }
  const words = length >= 1000 ? `${length / 1000} km` : `${Number(length.toPrecision(1))} m`;
  pen.textAlign = "center";
  elusive.word(pen, words, x + long / 2, y - 7, at.ink("--ink"), at.css("--halo"), 11);
  pen.textAlign = "left";
};

// length and course between two places
elusive.rule = function (panel, pen, view, at) {
  const [[a, b], [c, d]] = panel.measured;
  const unit = panel.spec.x.unit || "";
  pen.strokeStyle = pen.fillStyle = at.css("--accent");
  elusive.polyline(pen, [[view.X(a), view.Y(b)], [view.X(c), view.Y(d)]], 2); // prettier-ignore
  for (const [x, y] of panel.measured) elusive.marker(pen, "dot", view.X(x), view.Y(y), 3.5);
  const course = ((Math.atan2(c - a, panel.spec.down ? b - d : d - b) * 180) / Math.PI + 360) % 360;
  const far = Math.hypot(c - a, d - b);
  const words =
    `${far.toFixed(elusive.digits(1 / view.sx))} ${unit}` +
    (unit === "m" ? `, ${course.toFixed(0).padStart(3, "0")}°` : "");
  panel.figure.root.dataset.measured = words;
  elusive.word(
    pen,
    words,
    Math.min(view.X(c) + 8, view.right - 110),
    Math.max(view.top + 16, view.Y(d) - 8),
    at.css("--accent"),
    at.css("--halo"),
  );
};

elusive.colourBar = function (panel, at) {
  const image = panel.spec.layers.find((one) => one.type === "image" && one.unit !== undefined && at.on(one.name));
  const key = image ? `${image.colours} ${at.dark}` : "";
  if (panel.barred === key) return;
  panel.barred = key;
  panel.bar.replaceChildren();
  if (!image) return;
  const scale = elusive.make("i", { class: "scale" });
  scale.style.background = elusive.gradient(elusive.table(image.colours, at.css, image.unknown));
  const words = (v) => Number(v.toPrecision(3)).toString();
  const name = image.unit ? "" : `${image.name || ""} `;
  panel.bar.append(`${name}${words(image.low)}`, scale, `${words(image.high)} ${image.unit}`);
};

// longitude and latitude by a polynomial of x and y
elusive.degrees = function (p, x, y) {
  const [u, v] = [(x - p.x) / p.half, (y - p.y) / p.half];
  let [lon, lat, k] = [0, 0, 0];
  for (let i = 0; i <= p.degree; i++)
    for (let j = 0; j <= p.degree - i; j++, k++)
      [lon, lat] = [lon + p.lon[k] * u ** i * v ** j, lat + p.lat[k] * u ** i * v ** j];
  lon = ((((lon + 180) % 360) + 360) % 360) - 180;
  return `${Math.abs(lat).toFixed(5)}° ${lat < 0 ? "S" : "N"}, ${Math.abs(lon).toFixed(5)}° ${lon < 0 ? "W" : "E"}`;
};
