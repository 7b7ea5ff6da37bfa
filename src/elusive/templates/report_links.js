// ---- curves over time
// round numbers from low to high, about so many
function ticks(low, high, count) {
  const rough = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(rough)), found = [];
  const step = [1, 2, 2.5, 5, 10].map(m => m * power).find(one => one >= rough * .999);
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(+(k * step).toPrecision(12));
  return found;
}
const t0 = D.times[0], t1 = D.times[T - 1];
function curves(id, series, top, whole = false) {
  const canvas = at(id); if (canvas.closest("[hidden]")) return;
  const ratio = devicePixelRatio || 1, w = canvas.clientWidth, h = 170, L = 42, R = 12, A = 8, B = 24;
  canvas.style.height = h + "px"; canvas.width = w * ratio; canvas.height = h * ratio;
  const g = canvas.getContext("2d"); g.setTransform(ratio, 0, 0, ratio, 0, 0); g.font = "12px system-ui, sans-serif";
  const X = t => L + (t - t0) / ((t1 - t0) || 1) * (w - L - R), Y = v => h - B - v / top * (h - A - B);
  if (D.calibrated !== null) { g.fillStyle = css("--shade"); g.fillRect(X(t0), A, X(D.calibrated) - X(t0), h - A - B); }
  g.strokeStyle = css("--line"); g.fillStyle = css("--soft"); g.lineWidth = 1; g.textAlign = "right"; g.textBaseline = "middle";
  for (const v of ticks(0, top, 4).filter(v => !whole || v % 1 === 0)) { g.beginPath(); g.moveTo(L, Y(v)); g.lineTo(w - R, Y(v)); g.stroke(); g.fillText(v, L - 6, Y(v)); }
  g.textAlign = "center"; g.textBaseline = "top";
  for (const t of ticks(t0, t1, Math.max(2, Math.min(6, w / 100)))) g.fillText(t, X(t), h - B + 7);
  for (const one of series) {
    g.strokeStyle = one.colour; g.globalAlpha = one.faint ? .3 : one.wide ? .5 : 1;
    const points = one.values.map((v, i) => v === null ? null : [X(one.times[i]), Y(Math.min(v, top))]);
    // a number of people holds until the next frame
    line(g, one.step ? points.flatMap((p, i) => i ? [[p[0], points[i - 1][1]], p] : [p]) : points, one.wide ? 4.5 : one.faint ? 1.2 : 1.8);
  }
  g.globalAlpha = 1; g.strokeStyle = css("--soft"); g.lineWidth = 1; const x = X(D.times[now]);
  g.beginPath(); g.moveTo(x, A); g.lineTo(x, h - B); g.stroke();
  canvas.onclick = e => { const wanted = t0 + (e.offsetX - L) / (w - L - R) * (t1 - t0); go(upTo(D.times, wanted + gap / 2) - 1); };
}
const curve = values => path => ({ times: path.times, values: values(path), path });
const existences = D.paths.map(curve(p => p.existence));
const spreads = D.paths.map(curve(p => p.sx.map((v, i) => v === null ? null : Math.hypot(v, p.sy[i]))));
const errors = D.error ?? [];
// the bulk of the values decides: a track's first moments would flatten all that follows
function reach(series) {
  const all = series.flatMap(one => one.values).filter(v => v !== null).sort((a, b) => a - b);
  return all.length ? Math.max(1.1 * Math.min(all[all.length - 1], 3 * all[Math.floor(.9 * all.length)]), 1e-2) : 1;
}
const tops = { spread: reach(spreads), error: reach([{ values: errors }]), people: 1.15 * Math.max(1, ...D.people, ...(D.present ?? [])) };
const styled = one => ({ ...one, colour: colourOf(one.path), faint: chosen && one.path !== chosen });

// ---- the page
function draw() {
  const t = D.times[now];
  paint();
  const found = { times: D.times, values: D.people, colour: css("--accent"), step: true };
  curves("people", D.present ? [{ ...found, values: D.present, colour: css("--truth"), wide: true }, found] : [found], tops.people, true);
  curves("existence", existences.map(styled), 1.02);
  curves("spread", spreads.map(styled), tops.spread);
  curves("error", [{ times: D.times, values: errors, colour: css("--truth") }], tops.error);
  at("scrub").value = now; at("clock").textContent = seconds(t) + " s"; at("scrub").setAttribute("aria-valuetext", seconds(t) + " seconds");
  at("now").textContent = said(t);
  const past = upTo(eventTimes, t);
  lines.forEach((b, i) => {
    b.className = (i >= past ? "later" : i === past - 1 ? "latest" : "") + (chosen && D.events[i][1] !== chosen.track ? " other" : "");
  });
  at("log").style.maxHeight = Math.max(160, floorHeight() - at("layers").offsetHeight - 40) + "px";
  const latest = lines[past - 1];
  if (!at("log").matches(":hover, :focus-within")) at("log").scrollTop = latest ? latest.offsetTop - at("log").clientHeight / 2 : 0;
  for (const b of document.querySelectorAll("[data-track]")) b.setAttribute("aria-pressed", String(chosen !== null && b.dataset.track === String(chosen.track)));
}
function said(t) {
  const people = D.people[now], there = D.present?.[now];
  const words = D.calibrated !== null && t <= D.calibrated + 1e-9 ? ["calibration: nobody is there"] : [people === 1 ? "one person" : people ? people + " people" : "nobody"];
  if (there !== undefined) words.push("truly " + there);
  if (errors[now] != null) words.push("error " + errors[now].toFixed(2) + " m");
  if (chosen && living(chosen, t)) {
    const i = indexAt(chosen, t);
    words.push("track " + chosen.track + (chosen.sure[i] ? "" : " (not confirmed)") + " at " + chosen.x[i].toFixed(2) + ", " + chosen.y[i].toFixed(2) + " m, existence " + chosen.existence[i].toFixed(2));
  } else if (chosen) words.push("track " + chosen.track + " lives from " + seconds(chosen.times[0]) + " to " + seconds(chosen.times[chosen.times.length - 1]) + " s");
  return words.join(" · ");
}
function go(n) { now = Math.max(0, Math.min(T - 1, n)); draw(); }
function highlight(path) {
  chosen = path === chosen ? null : path;
  if (chosen && !living(chosen, D.times[now])) now = Math.max(0, upTo(D.times, chosen.times[0]) - 1);
  draw();
}
function stop() { clearInterval(timer); timer = null; at("play").textContent = "Play"; }
function play() {
  if (timer) return stop();
  if (now >= T - 1) now = 0;
  at("play").textContent = "Pause";
  const step = Math.max(1, Math.round(T / 500));
  timer = setInterval(() => { now < T - 1 ? go(now + step) : stop(); }, Math.max(60, Math.min(250, 40000 / T)));
}
function nearest(x, y) {  // the track whose path, or whose place now, passes within 14 pixels
  const { X, Y } = view(), t = D.times[now]; let best = null, least = 14;
  for (const path of D.paths) {
    const n = upTo(path.times, t), from = at("showwhole").checked ? 0 : living(path, t) ? upTo(path.times, t - TRAIL) : n;
    for (let i = from; i < (at("showwhole").checked ? path.x.length : n); i++) {
      const apart = Math.hypot(X(path.x[i]) - x, Y(path.y[i]) - y) - (i === n - 1 && living(path, t) ? 6 : 0);
      if (apart < least) [best, least] = [path, apart];
    }
  }
  return best;
}
const HINT = "Click a track to highlight it. Arrow keys step in time, space plays.";
at("pointer").textContent = HINT;
at("floor").onclick = e => { const path = nearest(e.offsetX, e.offsetY); path ? highlight(path) : chosen && highlight(chosen); };
at("floor").onpointermove = e => {
  const { w, h, k } = view(), x = (e.offsetX - w / 2) / k + (WEST + EAST) / 2, y = (h / 2 - e.offsetY) / k + (SOUTH + NORTH) / 2, path = nearest(e.offsetX, e.offsetY);
  at("pointer").textContent = x.toFixed(2) + ", " + y.toFixed(2) + " m" + (path ? " · track " + path.track : "");
};
at("floor").onpointerleave = () => { at("pointer").textContent = HINT; };
const keys = { ArrowLeft: () => go(now - 1), ArrowRight: () => go(now + 1), Home: () => go(0), End: () => go(T - 1), " ": play, Escape: () => chosen && highlight(chosen) };
at("floor").onkeydown = e => { if (!e.ctrlKey && !e.metaKey && !e.altKey && keys[e.key]) { e.preventDefault(); keys[e.key](); } };
at("play").onclick = play;
at("scrub").max = T - 1; at("scrub").oninput = e => go(+e.target.value);
for (const id of ["showlinks", "showimage", "showcloud", "showtruth", "showwhole"]) at(id).onchange = draw;
for (const b of document.querySelectorAll("[data-track]")) b.onclick = () => highlight(D.paths.find(path => String(path.track) === b.dataset.track));

// ---- the event log
const eventTimes = D.events.map(event => event[0]);
const lines = D.events.map(([time, number, what, x, y]) => {
  const b = document.createElement("button"); b.type = "button";
  for (const text of [seconds(time) + " s", "track " + number, what + " at " + x.toFixed(1) + ", " + y.toFixed(1) + " m"]) {
    const cell = document.createElement("span"); cell.textContent = text; b.append(cell);
  }
  b.onclick = () => { const path = D.paths.find(one => one.track === number); if (path && path !== chosen) chosen = path; go(upTo(D.times, time) - 1); };
  at("log").append(b); return b;
});
if (D.unlisted) { const note = document.createElement("p"); note.textContent = D.unlisted + " earlier events are in events.csv."; at("log").prepend(note); }

at("trail").textContent = TRAIL.toFixed(0);
at("happened").hidden = !lines.length;
at("truthlabel").hidden = at("truepeople").hidden = !D.truth;
at("errorfigure").hidden = !errors.some(v => v !== null);
at("onaverage").hidden = (D.truth ?? []).length < 2;
const measured = errors.filter(v => v !== null);
at("mean").textContent = measured.length ? (measured.reduce((a, b) => a + b) / measured.length).toFixed(2) : "";
at("imagelabel").hidden = !D.scenes.url; at("brightest").textContent = D.scenes.url ? D.scenes.brightest.toFixed(1) : "";
at("cloudlabel").hidden = !D.clouds.some(one => Object.keys(one).length);
at("trackkey").hidden = at("wholelabel").hidden = !D.paths.length;
for (const id of ["existence", "spread"]) at(id).closest("figure").hidden = !D.paths.length;
addEventListener("resize", draw);
dark.addEventListener("change", draw);
if (strip) { strip.onload = draw; strip.src = D.scenes.url; }
draw();
