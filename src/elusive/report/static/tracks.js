// The painter of a track, and what a figure asks of one.
"use strict";
elusive.SURE = 2.4477; // deviations of an ellipse that holds 95 %

elusive.living = (track, t) =>
  track.times.length > 0 && t >= track.times[0] - 1e-9 && t <= track.times[track.times.length - 1] + 1e-9;

// a track: what is to come faintly, dotted while it is not confirmed, its place and ellipse now, its number
elusive.layers.track = function (layer, pen, view, at) {
  const share = at.share(layer);
  const n = elusive.upTo(layer.times, at.t);
  const lives = elusive.living(layer, at.t);
  const from = layer.trail ? elusive.upTo(layer.times, at.t - layer.trail) : 0;
  const points = layer.x.map((x, i) => (x === null ? null : [view.X(x), view.Y(layer.y[i])]));
  const sure = points.map((p, i) => (!layer.sure || layer.sure[i] ? p : null));
  const colour = (pen.strokeStyle = pen.fillStyle = at.ink(layer.colour));
  if (at.on("whole paths")) {
    pen.globalAlpha = share * Math.max(0.12, Math.min(0.35, 2.4 / at.tracks));
    elusive.polyline(pen, points, 1.5);
  }
  if (lives || !layer.trail) {
    pen.globalAlpha = share;
    elusive.polyline(pen, points.slice(from, n), 1.5, [1, 4]);
    elusive.polyline(pen, sure.slice(from, n), share < 1 ? 1.5 : 2.4);
  }
  if (layer.flagged) {
    pen.strokeStyle = at.css("--forbidden");
    pen.lineWidth = 1.5;
    for (let i = from; i < n; i++) if (layer.flagged[i] && points[i]) elusive.marker(pen, "ring", ...points[i], 4.5);
  }
  pen.globalAlpha = share;
  const i = n - 1;
  if (lives && points[i]) {
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.8;
    if (layer.sx && layer.sx[i] !== null && at.on("ellipses")) elusive.ellipse(layer, i, pen, view);
    pen.lineWidth = 1.8;
    elusive.marker(pen, layer.box ? "box" : !layer.sure || layer.sure[i] ? "dot" : "ring", ...points[i], 4);
    if (layer.text !== "") {
      const right = points[i][0] > view.right - 30; // so that no number leaves the panel
      pen.textAlign = right ? "right" : "left";
      const aside = layer.box ? 15 : 8;
      elusive.word(
        pen,
        layer.text ?? layer.track,
        points[i][0] + (right ? -aside : aside),
        Math.max(view.top + 13, points[i][1] - 9),
        colour,
        at.css("--halo"),
      );
      pen.textAlign = "left";
    }
  }
  pen.globalAlpha = 1;
};

elusive.ellipse = function (layer, i, pen, view) {
  const [a, b, c] = [layer.sx[i] ** 2, layer.sy[i] ** 2, layer.cxy ? layer.cxy[i] : 0];
  const [middle, apart] = [(a + b) / 2, Math.hypot((a - b) / 2, c)];
  const half = [middle + apart, middle - apart].map((v) =>
    Math.max(1, elusive.SURE * view.sx * Math.sqrt(Math.max(0, v))),
  );
  const angle = 0.5 * Math.atan2(2 * c, a - b);
  pen.beginPath();
  pen.ellipse(view.X(layer.x[i]), view.Y(layer.y[i]), half[0], half[1], view.sy < 0 ? -angle : angle, 0, 7);
  pen.stroke();
};
