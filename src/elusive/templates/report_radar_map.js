const at = id => document.getElementById(id);
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");
const rgb = colour => [1, 3, 5].map(i => parseInt(colour.slice(i, i + 2), 16));
const lighter = colour => "#" + rgb(colour).map(v => Math.round(.45 * 255 + .55 * v).toString(16).padStart(2, "0")).join("");
const colourOf = path => dark.matches ? lighter(path.colour) : path.colour;
const SURE = 2.4477;  // deviations of an ellipse that holds 95 %
const T = D.times.length, [WEST, EAST, SOUTH, NORTH] = D.extent;
const gap = T > 1 ? (D.times[T - 1] - D.times[0]) / (T - 1) : 1;
let now = T - 1, chosen = D.paths.length === 1 ? D.paths[0] : null, timer = null, view = null;

// ---- what is where at a time
function upTo(times, t) {  // how many of the ascending times are not after t
  let low = 0, high = times.length;
  while (low < high) { const m = (low + high) >> 1; times[m] <= t + 1e-9 ? low = m + 1 : high = m; }
  return low;
}
const plotTimes = D.plots.map(p => p[0]), truthTimes = D.truth ? D.truth.map(p => p[0]) : [];
const living = (path, t) => path.times.length && t >= path.times[0] - 1e-9 && t <= path.times[path.times.length - 1] + 1e-9;
const indexAt = (path, t) => Math.max(0, upTo(path.times, t) - 1);
function truthAt(t) {
  const n = upTo(truthTimes, t);
  if (!n || t > truthTimes[truthTimes.length - 1] + 1e-9) return null;
  const [t0, x0, y0] = D.truth[n - 1], [t1, x1, y1] = D.truth[Math.min(n, D.truth.length - 1)], s = t1 > t0 ? (t - t0) / (t1 - t0) : 0;
  return [x0 + s * (x1 - x0), y0 + s * (y1 - y0)];
}
const cloudsOf = new Map(D.paths.map(path => [path.track, D.clouds.filter(c => c.track === path.track)]));
function cloudAt(path, t) {
  let best = null;
  for (const c of cloudsOf.get(path.track)) if (best === null || Math.abs(c.time - t) < Math.abs(best.time - t)) best = c;
  return best;
}
const seconds = t => gap < .95 || t % 1 ? t.toFixed(gap < .095 ? 2 : 1) : String(t);
function degrees(x, y) {
  const P = D.degrees, u = (x - P.x) / P.half, v = (y - P.y) / P.half;
  let lon = 0, lat = 0, k = 0;
  for (let i = 0; i <= P.degree; i++) for (let j = 0; j <= P.degree - i; j++, k++) { const term = u ** i * v ** j; lon += P.lon[k] * term; lat += P.lat[k] * term; }
  lon = ((lon + 180) % 360 + 360) % 360 - 180;
  return Math.abs(lat).toFixed(5) + "° " + (lat < 0 ? "S" : "N") + ", " + Math.abs(lon).toFixed(5) + "° " + (lon < 0 ? "W" : "E");
}

// ---- the chart: shapes once, pictures once a colour scheme
const land = new Path2D(), shore = new Path2D();
if (D.chart) {
  const W = D.chart.window ?? [];
  // an edge along the side of the window is where the land was cut, not shore
  const cut = (r, i, j) => (r[i] === r[j] && (r[i] === W[0] || r[i] === W[1])) || (r[i + 1] === r[j + 1] && (r[i + 1] === W[2] || r[i + 1] === W[3]));
  for (const r of D.chart.land) {
    land.moveTo(r[0], r[1]);
    for (let i = 2; i < r.length; i += 2) land.lineTo(r[i], r[i + 1]);
    land.closePath();
    shore.moveTo(r[0], r[1]);
    for (let i = 2; i <= r.length; i += 2) { const j = i % r.length; cut(r, i - 2, j) ? shore.moveTo(r[j], r[j + 1]) : shore.lineTo(r[j], r[j + 1]); }
  }
}
const rasters = D.chart ? D.chart.rasters.map(one => ({ extent: one.extent, image: new Image(), url: one.url, drawn: null })) : [];
let unknowns = false;
function colourRaster(one) {
  const c = one.drawn ?? document.createElement("canvas"), w = c.width = one.image.width, h = c.height = one.image.height, g = c.getContext("2d", { willReadFrequently: true });
  g.drawImage(one.image, 0, 0);
  const pixels = g.getImageData(0, 0, w, h), p = pixels.data, stops = ["--land", "--balance", "--water"].map(name => rgb(css(name))), bare = rgb(css("--unknown"));
  for (let i = 0; i < p.length; i += 4) {
    const grey = p[i], k = grey < 127 ? 0 : 1;
    unknowns ||= grey === 255;
    for (let j = 0; j < 3; j++) p[i + j] = grey === 255 ? bare[j] : stops[k][j] + (grey / 127 - k) * (stops[k + 1][j] - stops[k][j]);
  }
  g.putImageData(pixels, 0, 0); one.drawn = c;
}

// ---- one painter for both maps; a view has its middle [m] and its scale [pixels a metre]
function paint(canvas, V, height, close) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = height;
  canvas.style.height = h + "px"; canvas.width = w * ratio; canvas.height = h * ratio;
  const g = canvas.getContext("2d"), k = V.scale, t = D.times[now];
  const X = x => w / 2 + (x - V.x) * k, Y = y => h / 2 - (y - V.y) * k;
  const plain = () => g.setTransform(ratio, 0, 0, ratio, 0, 0);
  const metres = () => g.setTransform(ratio * k, 0, 0, -ratio * k, ratio * X(0), ratio * Y(0));
  plain(); g.fillStyle = D.chart ? css("--water") : css("--shade"); g.fillRect(0, 0, w, h);
  if (D.chart) {
    metres(); g.fillStyle = css("--land"); g.fill(land, "evenodd"); plain();
    if (at("showwater").checked) for (const one of rasters) {
      const [west, east, south, north] = one.extent;
      if (one.drawn && X(east) > 0 && X(west) < w && Y(south) > 0 && Y(north) < h) g.drawImage(one.drawn, X(west), Y(north), (east - west) * k, (north - south) * k);
    }
    metres(); g.strokeStyle = css("--shore"); g.lineWidth = 1.2 / k; g.stroke(shore); plain();
  }
  if (at("showplots").checked) {
    const size = D.plots.length > 3000 ? 2 : 3;
    g.fillStyle = css("--plot"); g.globalAlpha = .6;
    for (let i = upTo(plotTimes, t) - 1; i >= 0; i--) g.fillRect(X(D.plots[i][1]) - size / 2, Y(D.plots[i][2]) - size / 2, size, size);
    g.globalAlpha = 1;
  }
  if (D.truth && at("showtruth").checked) {
    g.strokeStyle = css("--truth"); g.globalAlpha = .55; line(g, D.truth.map(p => [X(p[1]), Y(p[2])]), 5); g.globalAlpha = 1;
    const there = truthAt(t);
    if (there) { g.fillStyle = css("--truth"); diamond(g, X(there[0]), Y(there[1]), 6); }
  }
  const shown = D.paths.filter(path => living(path, t));
  if (at("showcloud").checked) for (const path of shown) if (!close || path === close) cloud(g, cloudAt(path, t), X, Y, close);
  for (const path of D.paths) track(g, path, t, X, Y);
  for (const path of shown) estimate(g, path, t, X, Y, k, close);
  if (at("showplots").checked) {
    g.strokeStyle = css("--now");
    for (let i = upTo(plotTimes, t) - 1; i >= 0 && D.plots[i][0] > t - 1e-6; i--) cross(g, X(D.plots[i][1]), Y(D.plots[i][2]), 5, Math.PI / 4);
  }
  const x = X(0), y = Y(0);  // the radar
  if (x > -20 && x < w + 20 && y > -20 && y < h + 20) {
    g.fillStyle = css("--now"); g.beginPath(); g.moveTo(x, y - 7); g.lineTo(x + 6, y + 5); g.lineTo(x - 6, y + 5); g.fill();
    label(g, "radar", x + 9, y, css("--now"));
  }
  scaleBar(g, w, h, k);
}
function line(g, points, width, dash = []) {
  g.lineWidth = width; g.lineJoin = g.lineCap = "round"; g.setLineDash(dash); g.beginPath(); let open = false;
  for (const p of points) { if (p === null) { open = false; continue; } open ? g.lineTo(p[0], p[1]) : g.moveTo(p[0], p[1]); open = true; }
  g.stroke(); g.setLineDash([]);
}
function diamond(g, x, y, r) { g.beginPath(); g.moveTo(x, y - r); g.lineTo(x + r, y); g.lineTo(x, y + r); g.lineTo(x - r, y); g.fill(); }
function cross(g, x, y, r, turn = 0) {
  g.lineWidth = 2; g.beginPath();
  for (const a of [turn, turn + Math.PI / 2]) { g.moveTo(x - r * Math.cos(a), y - r * Math.sin(a)); g.lineTo(x + r * Math.cos(a), y + r * Math.sin(a)); }
  g.stroke();
}
function label(g, text, x, y, colour) {
  g.font = "bold 13px system-ui, sans-serif"; g.textAlign = "left"; g.textBaseline = "middle"; g.lineJoin = "round";
  g.lineWidth = 3.5; g.strokeStyle = css("--paper"); g.fillStyle = colour; g.strokeText(text, x, y); g.fillText(text, x, y);
}
function track(g, path, t, X, Y) {
  const faint = chosen && path !== chosen, n = upTo(path.times, t), points = path.x.map((x, i) => [X(x), Y(path.y[i])]);
  const sure = points.map((p, i) => path.sure[i] ? p : null);
  g.strokeStyle = colourOf(path);
  g.globalAlpha = faint ? .2 : .35; line(g, points, 1.5);  // what is to come
  g.globalAlpha = faint ? .5 : 1; line(g, points.slice(0, n), 1.5, [1, 4]); line(g, sure.slice(0, n), faint ? 1.5 : 2.2);
  g.strokeStyle = css("--forbidden"); g.lineWidth = 1.5;
  for (let i = 0; i < n; i++) if (path.forbidden[i]) { g.beginPath(); g.arc(points[i][0], points[i][1], 4.5, 0, 7); g.stroke(); }
  g.globalAlpha = 1;
}
function estimate(g, path, t, X, Y, k, close) {
  const i = indexAt(path, t), x = X(path.x[i]), y = Y(path.y[i]), a = path.sx[i] ** 2, b = path.sy[i] ** 2, c = path.cxy[i];
  const middle = (a + b) / 2, apart = Math.hypot((a - b) / 2, c), turn = .5 * Math.atan2(2 * c, a - b);
  g.strokeStyle = g.fillStyle = colourOf(path); g.lineWidth = 1.8; g.beginPath();
  g.ellipse(x, y, SURE * k * Math.sqrt(middle + apart), SURE * k * Math.sqrt(Math.max(0, middle - apart)), -turn, 0, 7); g.stroke();
  g.beginPath(); g.arc(x, y, 3.5, 0, 7); g.fill();
  if (D.paths.length > 1 || !close) label(g, path.track, x + 9, y - 12, colourOf(path));
}
function cloud(g, c, X, Y, close) {
  if (!c) return;
  const size = close ? 2.4 : 1.6;
  g.fillStyle = css("--particle"); g.globalAlpha = .6;
  for (let i = 0; i < c.cm.length; i += 2) g.fillRect(X(c.mean[0] + c.cm[i] / 100) - size / 2, Y(c.mean[1] + c.cm[i + 1] / 100) - size / 2, size, size);
  g.globalAlpha = 1;
  if (!close) return;
  g.strokeStyle = css("--mark"); cross(g, X(c.mean[0]), Y(c.mean[1]), 7);
  if (c.mode) { g.beginPath(); g.arc(X(c.mode[0]), Y(c.mode[1]), 6, 0, 7); g.stroke(); }
}
function round(most) { const power = 10 ** Math.floor(Math.log10(most)); return power * [5, 2, 1].find(m => m * power <= most); }
function scaleBar(g, w, h, k) {
  const length = round(Math.max(.1, .28 * w / k)), long = length * k, x = w - 14 - long, y = h - 14;
  g.fillStyle = css("--paper"); g.globalAlpha = .8; g.fillRect(x - 8, y - 22, long + 16, 30); g.globalAlpha = 1;
  g.strokeStyle = g.fillStyle = css("--ink"); g.lineWidth = 2; g.beginPath(); g.moveTo(x, y - 4); g.lineTo(x, y); g.lineTo(x + long, y); g.lineTo(x + long, y - 4); g.stroke();
  g.font = "12px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "bottom";
  g.fillText(length >= 1000 ? length / 1000 + " km" : +length.toPrecision(1) + " m", x + long / 2, y - 5);
}
