// ---- curves over time
// round numbers from low to high, about so many
function ticks(low, high, count) {
  const rough = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(rough)), found = [];
  const step = [1, 2, 2.5, 5, 10].map(m => m * power).find(one => one >= rough * .999);
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(12));
  return found;
}
const t0 = D.times[0], t1 = D.times[T - 1];
function curves(id, series, top) {
  const canvas = at(id); if (canvas.closest("[hidden]")) return;
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = 190, L = 46, R = 12, A = 8, B = 24;
  canvas.style.height = h + "px"; canvas.width = w * ratio; canvas.height = h * ratio;
  const g = canvas.getContext("2d"); g.setTransform(ratio, 0, 0, ratio, 0, 0); g.font = "12px system-ui, sans-serif";
  const X = t => L + (t - t0) / ((t1 - t0) || 1) * (w - L - R), Y = v => h - B - v / top * (h - A - B);
  g.strokeStyle = css("--line"); g.fillStyle = css("--soft"); g.lineWidth = 1; g.textAlign = "right"; g.textBaseline = "middle";
  for (const v of ticks(0, top, 4)) { g.beginPath(); g.moveTo(L, Y(v)); g.lineTo(w - R, Y(v)); g.stroke(); g.fillText(v, L - 6, Y(v)); }
  g.textAlign = "center"; g.textBaseline = "top";
  for (const t of ticks(t0, t1, Math.max(2, Math.min(6, w / 100)))) g.fillText(t, X(t), h - B + 7);
  for (const one of series) {
    g.strokeStyle = one.colour; g.globalAlpha = one.faint ? .3 : 1;
    line(g, one.values.map((v, i) => v === null ? null : [X(one.times[i]), Y(Math.min(v, top))]), one.faint ? 1.2 : 1.8);
    g.strokeStyle = css("--forbidden"); g.lineWidth = 1.2;
    for (const t of one.ticks ?? []) { g.beginPath(); g.moveTo(X(t), Y(0)); g.lineTo(X(t), Y(0) + 7); g.stroke(); }
  }
  g.globalAlpha = 1; g.strokeStyle = css("--soft"); g.lineWidth = 1; const x = X(D.times[now]);
  g.beginPath(); g.moveTo(x, A); g.lineTo(x, h - B); g.stroke();
  canvas.onclick = e => { const wanted = t0 + (e.offsetX - L) / (w - L - R) * (t1 - t0); go(Math.max(0, upTo(D.times, wanted + gap / 2) - 1)); };
}
const curve = values => path => ({ times: path.times, values: values(path), path });
const speeds = D.paths.map(curve(p => p.vx.map((v, i) => Math.hypot(v, p.vy[i]))));
const spreads = D.paths.map(curve(p => p.sx.map((v, i) => Math.hypot(v, p.sy[i]))));
const consents = D.paths.filter(p => p.allowed).map(curve(p => p.allowed));
const nearest = new Map();  // time: distance of the nearest track to the truth
for (const p of D.paths) p.error?.forEach((v, i) => { if (v !== null && !(nearest.get(p.times[i]) <= v)) nearest.set(p.times[i], v); });
const errorTimes = [...new Set([...D.times, ...nearest.keys()])].sort((a, b) => a - b), errors = errorTimes.map(t => nearest.get(t) ?? null);
// the bulk of the values decides: a track's first moments would flatten all that follows
function reach(series) {
  const all = series.flatMap(one => one.values).filter(v => v !== null).sort((a, b) => a - b);
  return all.length ? Math.max(1.1 * Math.min(all[all.length - 1], 3 * all[Math.floor(.9 * all.length)]), 1e-3) : 1;
}
const tops = { speed: reach(speeds), spread: reach(spreads), error: reach([{ values: errors }]) };
const styled = one => ({ ...one, colour: colourOf(one.path), faint: chosen && one.path !== chosen });

// ---- the page
const mapHeight = () => Math.round(Math.max(300, Math.min(innerHeight * .62, 620, 1.05 * at("map").clientWidth)));
const whole = () => ({ x: (WEST + EAST) / 2, y: (SOUTH + NORTH) / 2, scale: Math.min(at("map").clientWidth / (EAST - WEST), mapHeight() / (NORTH - SOUTH)) });
const focus = () => chosen ?? D.paths.find(path => living(path, D.times[now])) ?? D.paths[0] ?? null;
function closeView(path) {
  const spread = path.sx.map((v, i) => Math.max(v, path.sy[i])).sort((a, b) => a - b)[Math.floor(path.sx.length / 2)];
  const i = indexAt(path, D.times[now]), c = cloudAt(path, D.times[now]), width = at("close").clientWidth;
  const here = c && Math.abs(c.time - D.times[now]) < 1e-6 ? c.mean : [path.x[i], path.y[i]];
  return { x: here[0], y: here[1], scale: width / Math.max(12, 9 * spread) };
}
function draw() {
  const t = D.times[now], path = focus();
  if (path && at("follow").checked && living(path, t)) { const i = indexAt(path, t); view = { ...(view ?? whole()), x: path.x[i], y: path.y[i] }; }
  paint(at("map"), view ?? whole(), mapHeight(), null);
  if (path) {
    at("trackkey").style.borderColor = colourOf(path);
    paint(at("close"), closeView(path), at("close").clientWidth, path);
    const c = cloudAt(path, t), name = D.paths.length > 1 ? "Track " + path.track : "The track";
    at("closeis").textContent = name + " close up" + (c ? (Math.abs(c.time - t) < 1e-6 ? ", with its particles" : ", with its particles at " + seconds(c.time) + " s, the nearest kept") + (c.water === null ? "" : "; P(water) there " + c.water.toFixed(2)) : "");
  }
  curves("speed", speeds.map(styled), tops.speed);
  curves("spread", spreads.map(styled), tops.spread);
  curves("error", [{ times: errorTimes, values: errors, colour: css("--truth") }], tops.error);
  curves("allowed", consents.map(one => ({ ...styled(one), ticks: one.times.filter((_, i) => one.path.forbidden[i]) })), 1.02);
  at("scrub").value = now; at("clock").textContent = seconds(t) + " s"; at("scrub").setAttribute("aria-valuetext", seconds(t) + " seconds");
  at("now").textContent = path ? said(path, t) : "";
  for (const b of document.querySelectorAll("[data-track]")) b.setAttribute("aria-pressed", String(chosen !== null && b.dataset.track === String(chosen.track)));
}
function said(path, t) {
  const name = "track " + path.track;
  if (!living(path, t)) return name + ": lives from " + seconds(path.times[0]) + " to " + seconds(path.times[path.times.length - 1]) + " s";
  const i = indexAt(path, t), vx = path.vx[i], vy = path.vy[i], course = (Math.atan2(vx, vy) * 180 / Math.PI + 360) % 360;
  return [name + (path.sure[i] ? "" : " (not confirmed)"), Math.hypot(vx, vy).toFixed(1) + " m/s", "course " + String(Math.round(course) % 360).padStart(3, "0") + "°",
    "deviation " + Math.hypot(path.sx[i], path.sy[i]).toFixed(1) + " m", ...(path.error?.[i] != null ? ["error " + path.error[i].toFixed(1) + " m"] : []),
    ...(path.forbidden[i] ? ["the map was left out"] : path.allowed?.[i] != null ? ["the chart allows it with P = " + path.allowed[i].toFixed(2)] : []),
    ...(D.degrees ? [degrees(path.x[i], path.y[i])] : [])].join(" · ");
}
function go(n) { now = Math.max(0, Math.min(T - 1, n)); draw(); }
function centre(path, zoom) {
  const t = D.times[now];
  if (!living(path, t)) now = Math.max(0, upTo(D.times, t < path.times[0] ? path.times[0] : path.times[path.times.length - 1]) - 1);
  const i = indexAt(path, D.times[now]);
  chosen = path; view = { ...(view ?? whole()), x: path.x[i], y: path.y[i] };
  if (zoom) view.scale = Math.max(view.scale, at("map").clientWidth / (24 * Math.max(1, path.sx[i], path.sy[i])));
  draw();
}
function stop() { clearInterval(timer); timer = null; at("play").textContent = "Play"; }
function play() {
  if (timer) return stop();
  if (now >= T - 1) now = 0;
  at("play").textContent = "Pause";
  const step = Math.max(1, Math.round(T / 400));
  timer = setInterval(() => { now < T - 1 ? go(now + step) : stop(); }, Math.max(60, Math.min(250, 20000 / T)));
}
function zoom(times, x = at("map").clientWidth / 2, y = mapHeight() / 2) {
  const V = view ?? whole(), w = at("map").clientWidth, least = .2 * whole().scale, most = Math.max(40, 20 * whole().scale);
  const scale = Math.max(least, Math.min(most, V.scale * times)), dx = x - w / 2, dy = mapHeight() / 2 - y;
  view = { x: V.x + dx / V.scale - dx / scale, y: V.y + dy / V.scale - dy / scale, scale }; draw();
}
function move(dx, dy) { const V = view ?? whole(); at("follow").checked = false; view = { ...V, x: V.x - dx / V.scale, y: V.y + dy / V.scale }; draw(); }
function everything() { view = null; at("follow").checked = false; draw(); }

const held = new Map();  // pointers that are down
at("map").onpointerdown = e => { held.set(e.pointerId, [e.offsetX, e.offsetY]); at("map").setPointerCapture(e.pointerId); at("map").classList.add("dragged"); };
at("map").onpointerup = at("map").onpointercancel = e => { held.delete(e.pointerId); if (!held.size) at("map").classList.remove("dragged"); };
at("map").onpointermove = e => {
  const before = held.get(e.pointerId), here = [e.offsetX, e.offsetY], V = view ?? whole();
  if (before && held.size === 1) move(here[0] - before[0], here[1] - before[1]);
  if (before && held.size === 2) {
    const other = [...held].find(([id]) => id !== e.pointerId)[1], apart = p => Math.hypot(p[0] - other[0], p[1] - other[1]);
    zoom(apart(here) / Math.max(1, apart(before)), (here[0] + other[0]) / 2, (here[1] + other[1]) / 2);
  }
  if (before) held.set(e.pointerId, here);
  const x = V.x + (here[0] - at("map").clientWidth / 2) / V.scale, y = V.y + (mapHeight() / 2 - here[1]) / V.scale;
  at("pointer").textContent = x.toFixed(0) + " m east, " + y.toFixed(0) + " m north of the radar" + (D.degrees ? " · " + degrees(x, y) : "");
};
const HINT = "North up. Drag or arrow keys move, wheel or + and − zoom, 0 shows everything.";
at("map").onpointerleave = () => { at("pointer").textContent = HINT; };
at("pointer").textContent = HINT;
at("map").addEventListener("wheel", e => { e.preventDefault(); zoom(Math.exp(-Math.sign(e.deltaY) * Math.min(.3, Math.abs(e.deltaY) / 400)), e.offsetX, e.offsetY); }, { passive: false });
const keys = { ArrowLeft: () => move(60, 0), ArrowRight: () => move(-60, 0), ArrowUp: () => move(0, 60), ArrowDown: () => move(0, -60),
  "+": () => zoom(1.3), "=": () => zoom(1.3), "-": () => zoom(1 / 1.3), "0": everything, Home: everything, " ": play, ",": () => go(now - 1), ".": () => go(now + 1) };
at("map").onkeydown = e => { if (!e.ctrlKey && !e.metaKey && !e.altKey && keys[e.key]) { e.preventDefault(); keys[e.key](); } };
at("in").onclick = () => zoom(1.5); at("out").onclick = () => zoom(1 / 1.5); at("home").onclick = everything;
at("play").onclick = play;
at("scrub").max = T - 1; at("scrub").oninput = e => go(+e.target.value);
for (const id of ["showplots", "showtruth", "showcloud", "showwater", "follow"]) at(id).onchange = draw;
for (const b of document.querySelectorAll("[data-track]")) b.onclick = () => centre(D.paths.find(path => String(path.track) === b.dataset.track), false);

at("estimate").textContent = D.estimate;
at("modekey").hidden = !D.clouds.some(c => c.mode);
at("truthlabel").hidden = at("errorfigure").hidden = !D.truth || !nearest.size;
at("truthlabel").hidden = !D.truth;
at("most").textContent = errors.reduce((most, v) => Math.max(most, v), 0).toFixed(1);
at("severalerrors").hidden = D.paths.length < 2;
at("waterlabel").hidden = !rasters.length; at("landkey").hidden = !D.chart; at("unknownkey").hidden = true;
at("allowedfigure").hidden = !consents.length; at("curves").hidden = at("trackkey").parentNode.hidden = !D.paths.length;
at("forbiddenkey").hidden = !D.paths.some(path => path.forbidden.some(Boolean));
at("cloudlabel").hidden = !D.clouds.length;
at("followlabel").hidden = at("closefigure").hidden = !D.paths.length;
at("moments").hidden = !D.telling.length;
if (D.telling.length) {
  const lead = document.createElement("span"), near = D.telling.some(n => D.clouds[n].water !== null && D.clouds[n].water < .95);
  lead.textContent = near ? "Where water was least likely:" : "Particle clouds:"; at("moments").append(lead);
  for (const n of D.telling) {
    const c = D.clouds[n], b = document.createElement("button"); b.type = "button";
    b.textContent = seconds(c.time) + " s" + (D.paths.length > 1 ? ", track " + c.track : "") + (c.water === null ? "" : ", P(water) " + c.water.toFixed(2));
    b.onclick = () => { now = Math.max(0, upTo(D.times, c.time) - 1); centre(D.paths.find(path => path.track === c.track), true); };
    at("moments").append(b);
  }
}
addEventListener("resize", draw);
dark.addEventListener("change", () => { rasters.filter(one => one.drawn).forEach(colourRaster); draw(); });
draw();
let waiting = rasters.length;
for (const one of rasters) { one.image.onload = () => { colourRaster(one); if (!--waiting) { at("unknownkey").hidden = !unknowns; draw(); } }; one.image.src = one.url; }
