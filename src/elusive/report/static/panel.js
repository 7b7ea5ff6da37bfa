// A panel: two axes with units and the layers between them; zoomed by the wheel, dragged, measured with a ruler.
// Axes of one group move together, whichever panel they belong to.
"use strict";
elusive.Panel = class {
  constructor(spec, figure, number) {
    [this.spec, this.figure, this.number] = [spec, figure, number];
    this.held = new Map(); // pointers that are down
    this.measured = null;
    this.build();
  }

  build() {
    const { make } = elusive;
    const { spec, figure } = this;
    this.canvas = make("canvas", { role: "img", "aria-label": spec.label || spec.title, "data-frame": "0" });
    if (spec.plane || spec.place) this.canvas.tabIndex = 0;
    this.canvas.className = spec.plane ? "plane" : "chart";
    this.bar = make("small", {});
    this.under = make("output", {
      class: "under",
      "aria-label": spec.place ? "Place under the pointer" : "Under the pointer",
    });
    const large = make("button", { type: "button", "aria-label": `Enlarge ${spec.title}`, title: "Enlarge" }, "⤢");
    large.addEventListener("click", () => figure.enlarge(this.number));
    this.caption = make("figcaption", {}, make("span", {}, spec.title), this.bar, this.under);
    if (figure.spec.panels.length > 1) this.caption.append(large);
    this.legend = make("div", { class: "layers" });
    this.root = make("figure", { class: "panel" }, this.caption, this.canvas, this.legend);
    this.root.style.setProperty("--span", spec.span || 6);
    this.root.style.setProperty("--rows", spec.rows || 1);
    this.xs = spec.x.group || `x ${this.number}`;
    this.ys = spec.y.group || null; // none: it stays as it is
    const surface = figure.spec.turnable && spec.layers.find((one) => one.type === "image");
    this.surface = surface ? new elusive.Surface(this, surface) : null;
    this.place = spec.place ? new elusive.Place(this, figure.emit) : null;
    for (const name of ["pointerdown", "pointermove", "pointerup", "pointercancel", "pointerleave", "wheel"])
      this.canvas.addEventListener(name, (event) => this[name](event), { passive: false });
    this.canvas.addEventListener("dblclick", () => !this.place && this.figure.everything());
  }

  // what of the plane is where: data to pixels, and back
  arrange(width, height) {
    const { spec, figure } = this;
    const small = width < 230;
    const [left, bottom] = [small ? 34 : 54, small ? 20 : 36];
    const box = { left, top: 6, w: Math.max(10, width - left - 10), h: Math.max(10, height - bottom - 6) };
    let [x0, x1, y0, y1] = spec.extent;
    const focus = spec.follow ? figure.focus() : null;
    if (focus) {
      const half = 0.5 * spec.follow;
      [x0, x1, y0, y1] = [focus[0] - half, focus[0] + half, focus[1] - half, focus[1] + half];
    }
    let [bx, by] = [box.w / (x1 - x0 || 1), box.h / (y1 - y0 || 1)];
    if (spec.plane) bx = by = Math.min(bx, by);
    const vx = figure.views.get(this.xs) || { c: 0.5 * (x0 + x1), z: 1 };
    const vy = (this.ys && figure.views.get(this.ys)) || { c: 0.5 * (y0 + y1), z: 1 };
    if (focus) [vx.c, vy.c] = focus;
    const [sx, sy] = [bx * vx.z, (spec.down ? 1 : -1) * by * vy.z];
    const [mx, my] = [box.left + box.w / 2, box.top + box.h / 2];
    return {
      sx, sy, vx, vy, left: box.left, right: box.left + box.w, top: box.top, bottom: box.top + box.h, small,
      X: (x) => mx + (x - vx.c) * sx, Y: (y) => my + (y - vy.c) * sy,
      back: (px, py) => [vx.c + (px - mx) / sx, vy.c + (py - my) / sy],
    }; // prettier-ignore
  }

  // height of the canvas: of a plane as its extent asks, within the window
  height(width) {
    const { spec } = this;
    if (!spec.plane) return spec.height || 190;
    const [x0, x1, y0, y1] = spec.follow ? [0, 1, 0, 1] : spec.extent;
    const inner = width - (width < 230 ? 44 : 64);
    const most = Math.max(280, (this.figure.isFull ? 0.8 : 0.68) * innerHeight);
    const least = spec.x.unit === "m" ? 0.55 * width : 150; // a map may show what is around
    return Math.round(Math.max(least, Math.min((inner * (y1 - y0)) / (x1 - x0) + 42, most)));
  }

  draw() {
    const { canvas, spec, figure } = this;
    const width = canvas.clientWidth;
    canvas.dataset.frame = figure.index;
    if (!width) return;
    const [ratio, height] = [devicePixelRatio || 1, this.height(width)];
    const pen = canvas.getContext("2d");
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) {
      canvas.style.height = `${height}px`;
      [canvas.width, canvas.height] = [wide, high];
    } else pen.reset();
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    const at = figure.at(spec);
    const view = (this.view = this.arrange(width, height));
    if (this.surface && this.surface.active) return this.surface.draw(pen, width, height, at);
    pen.fillStyle = spec.plane ? at.css(spec.ground || "--ground") : at.css("--paper");
    pen.fillRect(view.left, view.top, view.right - view.left, view.bottom - view.top);
    elusive.axes(this, pen, view, at, height);
    pen.save();
    pen.beginPath();
    pen.rect(view.left, view.top, view.right - view.left, view.bottom - view.top);
    pen.clip();
    for (const layer of spec.layers) if (at.on(layer.name)) elusive.layers[layer.type](layer, pen, view, at);
    if (spec.x.time) this.now(pen, view, at);
    else this.hover(pen, view, at);
    if (this.place) this.place.draw(pen, view, at);
    if (this.measured) elusive.rule(this, pen, view, at);
    if (spec.plane && spec.x.unit === "m") elusive.scaleBar(pen, view, at);
    pen.restore();
    elusive.colourBar(this, at);
  }

  now(pen, view, at) {
    pen.strokeStyle = at.css("--now");
    pen.lineWidth = 1;
    elusive.polyline(pen, [[view.X(at.t), view.top], [view.X(at.t), view.bottom]], 1); // prettier-ignore
  }

  // where the pointer is in another panel of the same plane
  hover(pen, view, at) {
    const { hovered } = this.figure;
    if (!hovered || hovered.panel === this || hovered.panel.xs !== this.xs || !this.spec.plane) return;
    pen.strokeStyle = at.css("--accent");
    pen.lineWidth = 1.5;
    elusive.marker(pen, "plus", view.X(hovered.x), view.Y(hovered.y), 7);
  }

  // ---- pointer
  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  pointerdown(event) {
    if (event.button || !this.view) return;
    const [px, py] = this.at(event);
    this.held.set(event.pointerId, [px, py]);
    this.canvas.setPointerCapture(event.pointerId);
    this.moved = false;
    const here = this.view.back(px, py);
    this.measured = this.spec.plane && (this.figure.ruling || event.shiftKey) ? [here, here] : null;
    if (this.measured || (this.surface && this.surface.active)) return;
    if (this.place && this.place.down(here)) this.held.clear();
    else if (this.spec.x.time) this.figure.goTo(here[0]);
  }

  pointermove(event) {
    if (!this.view) return;
    const here = this.at(event);
    const before = this.held.get(event.pointerId);
    const place = this.view.back(...here);
    this.say(place, here);
    if (this.place && this.place.move(place)) return;
    if (!before) return;
    this.held.set(event.pointerId, here);
    const [dx, dy] = [here[0] - before[0], here[1] - before[1]];
    if (Math.hypot(dx, dy) > 1) this.moved = true;
    if (this.surface && this.surface.active) this.surface.turn(dx / 120, dy / 120);
    else if (this.measured) this.measured = [this.measured[0], place];
    else if (this.held.size === 2) this.pinch(event.pointerId, before, here);
    else if (this.spec.x.time) return this.figure.goTo(place[0]);
    else this.pan(dx, dy);
    this.figure.refresh();
  }

  pinch(pointer, before, here) {
    const other = [...this.held].find(([id]) => id !== pointer)[1];
    const apart = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
    this.zoom(apart(here) / apart(before), (here[0] + other[0]) / 2, (here[1] + other[1]) / 2);
  }

  pointerup(event) {
    const was = this.held.delete(event.pointerId);
    if (!this.view) return;
    const [px, py] = this.at(event);
    if (this.place && this.place.up(this.view.back(px, py), this.moved)) return;
    if (this.measured) this.measured[1] = this.view.back(px, py);
    else if (was && !this.moved && this.spec.plane && !this.place) this.figure.choose(this.trackAt(px, py));
    this.figure.refresh();
  }

  pointercancel() {
    this.held.clear();
    this.place?.forget();
  }

  pointerleave() {
    this.under.textContent = "";
    this.figure.hovered = null;
    this.figure.refresh();
  }

  wheel(event) {
    // a page of curves can still be scrolled: these zoom once they are clicked, or with Ctrl
    if (!this.view || (!this.spec.plane && !event.ctrlKey && this.figure.touched !== this)) return;
    event.preventDefault();
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY)) this.pan(-event.deltaX, 0);
    else this.zoom(Math.exp(-Math.sign(event.deltaY) * Math.min(0.3, Math.abs(event.deltaY) / 400)), ...this.at(event));
  }

  // the track whose path passes within 14 pixels
  trackAt(px, py) {
    let [best, least] = [null, 14];
    for (const layer of this.spec.layers.filter((one) => one.type === "track")) {
      layer.x.forEach((x, i) => {
        const apart = x === null ? Infinity : Math.hypot(this.view.X(x) - px, this.view.Y(layer.y[i]) - py);
        if (apart < least) [best, least] = [layer.track, apart];
      });
    }
    return best;
  }

  // ---- the view
  // of an axis, as drawn or as changed since: of two presses within a frame each counts
  latest(group, drawn) {
    return this.figure.views.get(group) ?? drawn;
  }

  zoom(factor, px, py) {
    const { view, figure, spec } = this;
    const bound = (z) => Math.max(spec.x.time ? 1 : 0.02, Math.min(2e4, z));
    const [x, y] = view.back(px ?? 0.5 * (view.left + view.right), py ?? 0.5 * (view.top + view.bottom));
    const turn = (group, { c, z }, at) =>
      figure.views.set(group, { c: at + ((c - at) * z) / bound(z * factor), z: bound(z * factor) });
    turn(this.xs, this.latest(this.xs, view.vx), x);
    if (this.ys) turn(this.ys, this.latest(this.ys, view.vy), y);
    figure.viewed(this);
  }

  pan(dx, dy) {
    const { view, figure } = this;
    const moved = ({ c, z }, by) => ({ c: c - by, z });
    figure.views.set(this.xs, moved(this.latest(this.xs, view.vx), dx / view.sx));
    if (this.ys) figure.views.set(this.ys, moved(this.latest(this.ys, view.vy), dy / view.sy));
    figure.viewed(this);
  }

  // ---- value under the pointer, here and in the other panels of the plane
  say([x, y], [px, py]) {
    const { figure, view } = this;
    const inside = px >= view.left && px <= view.right && py >= view.top && py <= view.bottom;
    figure.hovered = inside ? { panel: this, x, y } : null;
    for (const panel of figure.panels)
      panel.under.textContent = inside && panel.xs === this.xs ? panel.words(x, y, this) : "";
    if (inside && figure.panels.length > 1) figure.refresh();
  }

  words(x, y, from) {
    const { spec, figure, view } = this;
    const at = figure.at(spec);
    const round = (value, scale) => value.toFixed(elusive.digits(1 / Math.abs(scale)));
    const words = [];
    if (spec.x.time) {
      const k = elusive.nearest(figure.spec.times, x);
      words.push(figure.clock.say(figure.spec.times[k] ?? x));
      if (from === this && this.ys) words.push(`${round(y, view.sy)} ${spec.y.unit}`);
      for (const layer of spec.layers) {
        if (layer.type !== "line" || !at.on(layer.name) || words.length > 6) continue;
        const value = layer.y[elusive.nearest(layer.x, x)];
        if (value !== null && value !== undefined)
          words.push(`${layer.name || layer.text || ""} ${Number(value.toPrecision(4))}`.trim());
      }
    } else if (spec.place) words.push(`x ${x.toFixed(2)} ${spec.x.unit}, y ${y.toFixed(2)} ${spec.y.unit}`);
    else if (from === this) words.push(`${round(x, view.sx)}, ${round(y, view.sy)} ${spec.x.unit || ""}`);
    if (spec.degrees && from === this) words.push(elusive.degrees(spec.degrees, x, y));
    for (const layer of spec.layers
      .filter((one) => one.type === "image" && one.unit !== undefined && at.on(one.name))
      .reverse()) {
      const value = elusive.valueAt(layer, x, y, at);
      if (value === null) continue;
      words.push(`${layer.name && !spec.x.time ? `${layer.name} ` : ""}${Number(value.toPrecision(3))} ${layer.unit}`);
      break;
    }
    return words.join(" · ");
  }
};
