const at = id => document.getElementById(id);
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");
const rgb = colour => [1, 3, 5].map(i => parseInt(colour.slice(i, i + 2), 16));
const lighter = colour => "#" + rgb(colour).map(v => Math.round(.45 * 255 + .55 * v).toString(16).padStart(2, "0")).join("");
const colourOf = path => dark.matches ? lighter(path.colour) : path.colour;
const T = D.times.length, [WEST, EAST, SOUTH, NORTH] = D.extent;
const gap = T > 1 ? (D.times[T - 1] - D.times[0]) / (T - 1) : 1;
const TRAIL = Math.max(20 * gap, Math.min(30, (D.times[T - 1] - D.times[0]) / 8));  // seconds
const seconds = t => gap < .95 || t % 1 ? t.toFixed(gap < .095 ? 2 : 1) : String(t);
// a page that opens on an empty floor shows nothing: the middle one of the times at which most people are there
const most = Math.max(...D.people), busiest = D.people.map((n, i) => i).filter(i => D.people[i] === most);
let now = busiest[busiest.length >> 1] ?? 0, chosen = null, timer = null;

// ---- what is where at a time
function upTo(times, t) {  // how many of the ascending times are not after t
  let low = 0, high = times.length;
  while (low < high) { const m = (low + high) >> 1; times[m] <= t + 1e-9 ? low = m + 1 : high = m; }
  return low;
}
const living = (path, t) => path.times.length && t >= path.times[0] - 1e-9 && t <= path.times[path.times.length - 1] + 1e-9;
const indexAt = (path, t) => Math.max(0, upTo(path.times, t) - 1);
const truthTimes = (D.truth ?? []).map(points => points.map(p => p[0]));
function truthAt(person, t) {
  const points = D.truth[person], n = upTo(truthTimes[person], t);
  if (!n || t > points[points.length - 1][0] + 1e-9) return null;
  const [t0, x0, y0] = points[n - 1], [t1, x1, y1] = points[Math.min(n, points.length - 1)], s = t1 > t0 ? (t - t0) / (t1 - t0) : 0;
  return [x0 + s * (x1 - x0), y0 + s * (y1 - y0)];
}
// what was kept nearest to a time, if it is near enough to belong to it
const apart = D.scenes.times.length > 1 ? (D.scenes.times[D.scenes.times.length - 1] - D.scenes.times[0]) / (D.scenes.times.length - 1) : gap;
function sceneAt(t) {
  const after = upTo(D.scenes.times, t), near = [after - 1, after].filter(k => k >= 0 && k < D.scenes.times.length);
  near.sort((a, b) => Math.abs(D.scenes.times[a] - t) - Math.abs(D.scenes.times[b] - t));
  return near.length && Math.abs(D.scenes.times[near[0]] - t) <= 1.01 * Math.max(apart, gap) ? near[0] : null;
}

// ---- images: one tile each
const strip = D.scenes.url ? new Image() : null, tile = document.createElement("canvas");
function tileAt(scene) {
  const S = D.scenes, number = S.tile[scene];
  if (!strip.complete || !strip.naturalWidth || number === null) return null;
  tile.width = S.columns; tile.height = S.rows;
  const g = tile.getContext("2d", { willReadFrequently: true });
  g.drawImage(strip, number % S.across * S.columns, Math.floor(number / S.across) * S.rows, S.columns, S.rows, 0, 0, S.columns, S.rows);
  const pixels = g.getImageData(0, 0, S.columns, S.rows), p = pixels.data, glow = rgb(css("--glow"));
  for (let i = 0; i < p.length; i += 4) { p[i + 3] = .9 * p[i]; [p[i], p[i + 1], p[i + 2]] = glow; }
  g.putImageData(pixels, 0, 0);
  return tile;
}

// ---- the painter
const floorHeight = () => Math.round(Math.min(at("floor").clientWidth * (NORTH - SOUTH) / (EAST - WEST), Math.max(320, .72 * innerHeight)));
function view() {
  const w = at("floor").clientWidth, h = floorHeight(), k = Math.min(w / (EAST - WEST), h / (NORTH - SOUTH));
  return { w, h, k, X: x => w / 2 + (x - (WEST + EAST) / 2) * k, Y: y => h / 2 - (y - (SOUTH + NORTH) / 2) * k };
}
function paint() {
  const canvas = at("floor"), ratio = devicePixelRatio || 1, { w, h, k, X, Y } = view(), t = D.times[now], scene = sceneAt(t);
  canvas.style.height = h + "px"; canvas.width = w * ratio; canvas.height = h * ratio;
  const g = canvas.getContext("2d"); g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.fillStyle = css("--shade"); g.fillRect(0, 0, w, h);
  const area = new Path2D(); D.corners.forEach(([x, y], i) => i ? area.lineTo(X(x), Y(y)) : area.moveTo(X(x), Y(y))); area.closePath();
  g.fillStyle = css("--floor"); g.fill(area);
  if (strip && scene !== null && at("showimage").checked) {
    const [west, east, south, north] = D.scenes.extent, image = tileAt(scene);
    g.save(); g.clip(area); g.imageSmoothingEnabled = false;
    if (image) g.drawImage(image, X(west), Y(north), (east - west) * k, (north - south) * k);
    g.restore();
  }
  const count = D.nodes.length * (D.nodes.length - 1) / 2;
  if (at("showlinks").checked && count <= 20000) {
    g.strokeStyle = css("--link"); g.lineWidth = 1; g.globalAlpha = Math.max(.03, Math.min(.4, 25 / count)); g.beginPath();
    D.nodes.forEach(([x, y], i) => { for (const [u, v] of D.nodes.slice(i + 1)) { g.moveTo(X(x), Y(y)); g.lineTo(X(u), Y(v)); } });
    g.stroke(); g.globalAlpha = 1;
  }
  g.strokeStyle = css("--wall"); g.lineWidth = 1.8; g.stroke(area);
  if (D.truth && at("showtruth").checked) D.truth.forEach((points, person) => {
    g.strokeStyle = g.fillStyle = css("--truth");
    if (at("showwhole").checked) { g.globalAlpha = .28; line(g, points.map(p => [X(p[1]), Y(p[2])]), 5); g.globalAlpha = 1; }
    const there = truthAt(person, t); if (!there) return;
    g.globalAlpha = .7; line(g, [...points.filter(p => p[0] > t - TRAIL && p[0] <= t).map(p => [X(p[1]), Y(p[2])]), [X(there[0]), Y(there[1])]], 5); g.globalAlpha = 1;
    diamond(g, X(there[0]), Y(there[1]), 8);
    if (D.truth.length > 1) label(g, D.called[person], X(there[0]) + 10, Y(there[1]) + 10, css("--truth"));
  });
  g.fillStyle = css("--wall");
  D.nodes.forEach(([x, y]) => g.fillRect(X(x) - 4, Y(y) - 4, 8, 8));
  if (D.nodes.length <= 60) D.nodes.forEach(([x, y], i) => small(g, D.names[i], X(x), Y(y), w, h));
  const shown = D.paths.filter(path => living(path, t));
  if (scene !== null && at("showcloud").checked) for (const path of shown) cloud(g, D.clouds[scene][path.track], X, Y, path);
  for (const path of D.paths) track(g, path, t, X, Y);
  for (const path of shown) estimate(g, path, t, X, Y, k);
  scaleBar(g, w, h, k);
}
function line(g, points, width, dash = []) {
  g.lineWidth = width; g.lineJoin = g.lineCap = "round"; g.setLineDash(dash); g.beginPath(); let open = false;
  for (const p of points) { if (p === null) { open = false; continue; } open ? g.lineTo(p[0], p[1]) : g.moveTo(p[0], p[1]); open = true; }
  g.stroke(); g.setLineDash([]);
}
function diamond(g, x, y, r) { g.beginPath(); g.moveTo(x, y - r); g.lineTo(x + r, y); g.lineTo(x, y + r); g.lineTo(x - r, y); g.fill(); }
function label(g, text, x, y, colour) {
  g.font = "bold 14px system-ui, sans-serif"; g.textAlign = "left"; g.textBaseline = "middle"; g.lineJoin = "round";
  g.lineWidth = 3.5; g.strokeStyle = css("--paper"); g.fillStyle = colour; g.strokeText(text, x, y); g.fillText(text, x, y);
}
function small(g, text, x, y, w, h) {  // towards the middle, so that no name leaves the picture
  g.font = "12px system-ui, sans-serif"; g.fillStyle = css("--soft"); g.textBaseline = "middle";
  const right = x > w / 2; g.textAlign = right ? "right" : "left";
  g.fillText(text, x + (right ? -8 : 8), y + (y > h / 2 ? -9 : 9));
}
function track(g, path, t, X, Y) {
  const faint = chosen && path !== chosen, from = upTo(path.times, t - TRAIL), n = upTo(path.times, t);
  const points = path.x.map((x, i) => [X(x), Y(path.y[i])]), sure = points.map((p, i) => path.sure[i] ? p : null);
  g.strokeStyle = colourOf(path);
  if (path === chosen || at("showwhole").checked) { g.globalAlpha = path === chosen ? .75 : (faint ? .4 : 1) * Math.max(.1, Math.min(.3, 2.4 / D.paths.length)); line(g, points, 1.5); }
  if (living(path, t)) { g.globalAlpha = faint ? .4 : 1; line(g, points.slice(from, n), 1.5, [1, 4]); line(g, sure.slice(from, n), faint ? 1.5 : 2.6); }
  g.globalAlpha = 1;
}
function estimate(g, path, t, X, Y, k) {
  const i = indexAt(path, t), x = X(path.x[i]), y = Y(path.y[i]);
  g.globalAlpha = chosen && path !== chosen ? .5 : 1; g.strokeStyle = g.fillStyle = colourOf(path); g.lineWidth = 1.8;
  if (path.sx[i] !== null) { g.beginPath(); g.ellipse(x, y, Math.max(1, k * path.sx[i]), Math.max(1, k * path.sy[i]), 0, 0, 7); g.stroke(); }
  g.beginPath(); g.arc(x, y, 5, 0, 7); path.sure[i] ? g.fill() : g.stroke();
  label(g, path.track, x + 9, y - 13, colourOf(path)); g.globalAlpha = 1;
}
function cloud(g, cm, X, Y, path) {
  if (!cm) return;
  g.fillStyle = colourOf(path); g.globalAlpha = chosen && path !== chosen ? .15 : .45;
  for (let i = 0; i < cm.length; i += 2) g.fillRect(X(cm[i] / 100) - 1.3, Y(cm[i + 1] / 100) - 1.3, 2.6, 2.6);
  g.globalAlpha = 1;
}
function round(most) { const power = 10 ** Math.floor(Math.log10(most)); return power * [5, 2, 1].find(m => m * power <= most); }
function scaleBar(g, w, h, k) {
  const length = round(.22 * w / k), long = length * k, x = w - 12 - long, y = h - 10;
  g.fillStyle = css("--paper"); g.globalAlpha = .8; g.fillRect(x - 6, y - 22, long + 12, 28); g.globalAlpha = 1;
  g.strokeStyle = g.fillStyle = css("--ink"); g.lineWidth = 2; g.beginPath(); g.moveTo(x, y - 4); g.lineTo(x, y); g.lineTo(x + long, y); g.lineTo(x + long, y - 4); g.stroke();
  g.font = "12px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "bottom"; g.fillText(+length.toPrecision(1) + " m", x + long / 2, y - 5);
}
