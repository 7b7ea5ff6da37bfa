const at = id => document.getElementById(id);
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");
const rgb = colour => [1, 3, 5].map(i => parseInt(colour.slice(i, i + 2), 16));
const lighter = colour => "#" + rgb(colour).map(v => Math.round(.45 * 255 + .55 * v).toString(16).padStart(2, "0")).join("");
const colourOf = sensor => dark.matches ? lighter(D.colours[sensor]) : D.colours[sensor];
const T = D.times.length, [WEST, EAST, SOUTH, NORTH] = D.extent, t0 = D.times[0], t1 = D.times[T - 1];
const gap = T > 1 ? (t1 - t0) / (T - 1) : 1, TRAIL = Math.max(20 * gap, Math.min(30, (t1 - t0) / 8));  // seconds
const seconds = t => gap < .95 || t % 1 ? t.toFixed(gap < .095 ? 2 : 1) : String(t);
const used = [...new Set(D.bearings.flat().map(b => b[0]))].sort((a, b) => a - b);
// a page that opens before there is a track shows nothing: the middle of it
const known = D.places.map((p, i) => i).filter(i => D.places[i][0] !== null);
let now = known[known.length >> 1] ?? 0, timer = null;

// ---- the ground
const groundHeight = () => Math.round(Math.min(at("ground").clientWidth * (NORTH - SOUTH) / (EAST - WEST), Math.max(340, .72 * innerHeight)));
function sized(canvas, h) {
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth;
  canvas.style.height = h + "px"; canvas.width = w * ratio; canvas.height = h * ratio;
  const g = canvas.getContext("2d"); g.setTransform(ratio, 0, 0, ratio, 0, 0); g.font = "12px system-ui, sans-serif";
  return [g, w];
}
function line(g, points, width, dash = []) {
  g.lineWidth = width; g.lineJoin = g.lineCap = "round"; g.setLineDash(dash); g.beginPath(); let open = false;
  for (const p of points) { if (p === null) { open = false; continue; } open ? g.lineTo(p[0], p[1]) : g.moveTo(p[0], p[1]); open = true; }
  g.stroke(); g.setLineDash([]);
}
function label(g, text, x, y, colour) {
  g.font = "bold 13px system-ui, sans-serif"; g.textAlign = "left"; g.textBaseline = "middle"; g.lineJoin = "round";
  g.lineWidth = 3.5; g.strokeStyle = css("--floor"); g.fillStyle = colour; g.strokeText(text, x, y); g.fillText(text, x, y);
}
function paint() {
  const h = groundHeight(), [g, w] = sized(at("ground"), h), k = Math.min(w / (EAST - WEST), h / (NORTH - SOUTH));
  const X = x => w / 2 + (x - (WEST + EAST) / 2) * k, Y = y => h / 2 - (y - (SOUTH + NORTH) / 2) * k, t = D.times[now];
  const on = p => p[0] === null ? null : [X(p[0]), Y(p[1])];
  g.fillStyle = css("--floor"); g.fillRect(0, 0, w, h);
  const recent = D.times.map((time, i) => i).filter(i => D.times[i] <= t && D.times[i] > t - TRAIL);
  if (D.truth && at("showtruth").checked) {
    g.strokeStyle = g.fillStyle = css("--truth"); g.globalAlpha = .3; line(g, D.truth.map(on), 5);
    g.globalAlpha = .75; line(g, recent.map(i => on(D.truth[i])), 5); g.globalAlpha = 1;
    const there = on(D.truth[now]);
    if (there) { const [x, y] = there; g.beginPath(); g.moveTo(x, y - 8); g.lineTo(x + 8, y); g.lineTo(x, y + 8); g.lineTo(x - 8, y); g.fill(); }
  }
  if (at("showrays").checked) for (const [sensor, azimuth] of D.bearings[now]) {
    const [x, y] = on(D.sensors[sensor]), far = 2 * (w + h);
    g.strokeStyle = colourOf(sensor); g.globalAlpha = .8; line(g, [[x, y], [x + far * Math.sin(azimuth), y - far * Math.cos(azimuth)]], 1.3); g.globalAlpha = 1;
  }
  g.strokeStyle = css("--accent");
  if (at("showwhole").checked) { g.globalAlpha = .35; line(g, D.places.map(on), 1.5); g.globalAlpha = 1; }
  line(g, recent.map(i => on(D.places[i])), 2.6);
  const here = on(D.places[now]);
  if (here) {
    const [long, short, angle] = D.ellipses[now]; g.fillStyle = css("--accent");
    if (long !== null && at("showellipse").checked) {
      g.beginPath(); g.ellipse(here[0], here[1], Math.max(1, k * long), Math.max(1, k * short), -angle, 0, 7);
      g.lineWidth = 1.6; g.stroke(); g.globalAlpha = .12; g.fill(); g.globalAlpha = 1;
    }
    g.beginPath(); g.arc(here[0], here[1], 5, 0, 7); g.fill();
  }
  for (const sensor of used) {
    const [x, y] = on(D.sensors[sensor]);
    g.fillStyle = colourOf(sensor); g.fillRect(x - 5, y - 5, 10, 10); label(g, D.names[sensor], x + 9, y - 9, css("--wall"));
  }
  const most = .22 * w / k, power = 10 ** Math.floor(Math.log10(most)), length = power * [5, 2, 1].find(m => m * power <= most), long = length * k;
  g.fillStyle = css("--paper"); g.globalAlpha = .8; g.fillRect(w - 18 - long, h - 32, long + 12, 28); g.globalAlpha = 1;
  g.strokeStyle = g.fillStyle = css("--ink"); line(g, [[w - 12 - long, h - 14], [w - 12 - long, h - 10], [w - 12, h - 10], [w - 12, h - 14]], 2);
  g.font = "12px system-ui, sans-serif"; g.textAlign = "center"; g.textBaseline = "bottom"; g.fillText(+length.toPrecision(1) + " m", w - 12 - long / 2, h - 15);
}

// ---- curves over time
function ticks(low, high, count) {
  const rough = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(rough)), found = [];
  const step = [1, 2, 2.5, 5, 10].map(m => m * power).find(one => one >= rough * .999);
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(12));
  return found;
}
function plot(id, low, high, draw) {
  const canvas = at(id); if (canvas.closest("[hidden]")) return;
  const h = 165, [g, w] = sized(canvas, h), L = 46, R = 12, A = 8, B = 24;
  const X = t => L + (t - t0) / ((t1 - t0) || 1) * (w - L - R), Y = v => h - B - (v - low) / (high - low) * (h - A - B);
  g.strokeStyle = css("--line"); g.fillStyle = css("--soft"); g.textAlign = "right"; g.textBaseline = "middle";
  for (const v of ticks(low, high, 4)) { line(g, [[L, Y(v)], [w - R, Y(v)]], 1); g.fillText(v, L - 6, Y(v)); }
  g.textAlign = "center"; g.textBaseline = "top";
  for (const t of ticks(t0, t1, Math.max(2, Math.min(6, w / 100)))) g.fillText(t, X(t), h - B + 7);
  g.save(); g.beginPath(); g.rect(L, A - 2, w - L - R, h - A - B + 4); g.clip(); draw(g, X, Y); g.restore();
  g.strokeStyle = css("--soft"); line(g, [[X(D.times[now]), A], [X(D.times[now]), h - B]], 1);
  canvas.onclick = e => go(nearest(t0 + (e.offsetX - L) / (w - L - R) * (t1 - t0)));
}
const nearest = t => { let best = 0; D.times.forEach((one, i) => { if (Math.abs(one - t) < Math.abs(D.times[best] - t)) best = i; }); return best; };
// the bulk of the values decides: a track's first moments would flatten all that follows
function reach(values) {
  const all = values.filter(v => v !== null).map(Math.abs).sort((a, b) => a - b);
  return all.length ? 1.1 * Math.min(all[all.length - 1], 3 * all[Math.floor(.9 * all.length)]) || 1e-3 : 1;
}
const along = (values, X, Y) => values.map((v, i) => v === null ? null : [X(D.times[i]), Y(v)]);
const residuals = D.bearings.flatMap((set, i) => set.map(([sensor, , left]) => [i, sensor, left])).filter(one => one[2] !== null);
const tops = { error: reach([...D.deviation, ...(D.error ?? [])]), residuals: reach(residuals.map(one => one[2])) };
const heights = (D.heights ?? []).filter(v => v[0] !== null).map(v => v[0]).sort((a, b) => a - b);
const low = heights[Math.floor(.005 * heights.length)], high = heights[Math.floor(.995 * heights.length)], room = .1 * (high - low) || 1;

// ---- the page
function draw() {
  paint();
  plot("error", 0, tops.error, (g, X, Y) => {
    g.strokeStyle = css("--soft"); line(g, along(D.deviation, X, Y), 1.5, D.error ? [5, 4] : []);
    if (D.error) { g.strokeStyle = css("--accent"); line(g, along(D.error, X, Y), 1.6); }
  });
  plot("residuals", -tops.residuals, tops.residuals, (g, X, Y) => {
    for (const [i, sensor, left] of residuals) { g.fillStyle = colourOf(sensor); g.fillRect(X(D.times[i]) - 1, Y(left) - 1, 2, 2); }
  });
  plot("height", low - room, high + room, (g, X, Y) => {
    if (D.truth) { g.strokeStyle = css("--truth"); g.globalAlpha = .5; line(g, along(D.truth.map(p => p[2]), X, Y), 4); g.globalAlpha = 1; }
    g.strokeStyle = css("--soft");
    for (const side of [-1, 1]) line(g, along(D.heights.map(v => v[0] === null ? null : v[0] + side * v[1]), X, Y), 1, [4, 3]);
    g.strokeStyle = css("--accent"); line(g, along(D.heights.map(v => v[0]), X, Y), 1.6);
  });
  const t = D.times[now], [x, y] = D.places[now], far = D.error && D.error[now] !== null ? `, ${D.error[now].toFixed(2)} m off` : "";
  at("scrub").value = now; at("clock").textContent = seconds(t) + " s"; at("scrub").setAttribute("aria-valuetext", seconds(t) + " seconds");
  const [long, short] = D.ellipses[now], up = D.heights && D.heights[now][0] !== null ? `, ${D.heights[now][0].toFixed(1)} m up` : "";
  const sure = long === null ? "" : `; 95 % ellipse ${(+long.toPrecision(3))} by ${(+short.toPrecision(3))} m`;
  at("now").textContent = x === null ? "No place is told yet." : `${x.toFixed(1)} m east, ${y.toFixed(1)} m north${up}${sure}${far}`;
}
function go(i) { now = Math.max(0, Math.min(T - 1, i)); draw(); }
function play() {
  if (timer !== null) { clearInterval(timer); timer = null; at("play").textContent = "Play"; return; }
  if (now === T - 1) now = 0;
  at("play").textContent = "Pause";
  const step = Math.max(1, Math.round(T / 1200));
  timer = setInterval(() => now >= T - 1 ? play() : go(now + step), 40);
}
at("scrub").max = T - 1; at("scrub").oninput = e => go(+e.target.value); at("play").onclick = play;
at("truthlabel").hidden = !D.truth; at("errorwords").hidden = !D.error; at("heightfigure").hidden = !D.heights;
for (const id of ["showrays", "showellipse", "showwhole", "showtruth"]) at(id).onchange = draw;
for (const sensor of used.slice(0, 12)) {
  const dot = document.createElement("span"); dot.className = "dot"; dot.style.background = colourOf(sensor);
  at("sensors").append(dot, D.names[sensor]);
}
at("ground").onkeydown = e => {
  const to = { ArrowLeft: now - 1, ArrowRight: now + 1, Home: 0, End: T - 1 }[e.key];
  if (to !== undefined) go(to); else if (e.key === " ") play(); else return;
  e.preventDefault();
};
addEventListener("resize", draw); dark.addEventListener("change", draw); draw();
