// A figure: its panels on one clock, so that none drifts; time line with events, layers on and off, tracks to choose.
"use strict";
elusive.FRAMES = 10; // a second, of a recording whose times are frames
elusive.KEYS =
  "Space plays, left and right arrow keys step in time, Home and End go to its ends, plus and minus zoom, Shift and " +
  "arrow keys move, 0 shows everything, R is the ruler, F fills the screen, Escape lets a track go.";
elusive.Figure = class {
  constructor(root, spec, emit = () => {}) {
    [this.root, this.emit, this.views, this.drawn] = [root, emit, new Map(), 0];
    root.classList.add("drawing", "palette");
    root.setAttribute("role", "group");
    root.tabIndex = 0;
    root.made = this;
    root.addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("fullscreenchange", () => this.refresh());
    this.sizes = new ResizeObserver(() => this.draw());
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.scheme.addEventListener("change", (this.recolour = () => this.draw()));
    this.classes = new window.MutationObserver(this.recolour);
    this.classes.observe(document.body, { attributes: true, attributeFilter: ["class"] });
    this.drawnOnce = this.update(spec);
    const tick = (now) => {
      this.tick(now);
      this.request = requestAnimationFrame(tick);
    };
    this.request = requestAnimationFrame(tick);
  }

  // what is zoomed, chosen and switched stays, where the new drawing is of the same panels
  async update(spec) {
    const same = this.spec && elusive.named(this.spec) === elusive.named(spec);
    this.spec = spec;
    this.clock = elusive.clockOf(spec.times, spec.unit);
    this.blocks = [];
    for (const layer of spec.panels.flatMap((panel) => panel.layers)) {
      if (!layer.counts) continue; // so many points a time
      layer.times = layer.times.flatMap((time, i) => new Array(layer.counts[i]).fill(time));
      delete layer.counts;
    }
    this.root.dataset.ready = "no";
    this.root.setAttribute("aria-label", `${spec.label}. ${elusive.KEYS}`);
    const plays = spec.autoplay && !same && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (!same) {
      this.views.clear();
      [this.chosen, this.off] = [null, new Set(spec.off || [])];
      [this.index, this.playing, this.last, this.large, this.ruling, this.following] = [
        plays ? 0 : spec.start || 0,
        false,
        null,
        null,
        false,
        false,
      ];
    }
    this.index = Math.min(this.index, Math.max(0, spec.times.length - 1));
    this.position = this.index;
    this.build();
    this.draw();
    const blocks = await Promise.all((spec.blocks || []).map(elusive.bytes));
    if (spec !== this.spec) return this;
    this.blocks = blocks;
    this.root.dataset.ready = "yes";
    this.draw();
    if (plays) this.play(true);
    return this;
  }

  destroy() {
    cancelAnimationFrame(this.request);
    this.sizes.disconnect();
    this.classes.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
  }

  get tracks() {
    const found = new Map();
    for (const panel of this.spec.panels)
      for (const layer of panel.layers)
        if (layer.type === "track" && !found.has(layer.track)) found.set(layer.track, layer);
    return found;
  }

  // ---- what layers ask for
  at(panel) {
    const dark = elusive.isDark();
    const style = getComputedStyle(this.root);
    const css = (name) => style.getPropertyValue(name).trim();
    const night = dark || panel.night;
    return {
      t: this.spec.times[this.index] ?? 0, dark, tracks: this.tracks.size, css: (name) => (name === "--halo" ? css(night ? "--dusk" : "--paper") : css(name)),
      ink: (name) => (name.startsWith("--") ? css(night && !dark ? `${name}-night` : name) || css(name) : night ? elusive.lighter(name) : name),
      on: (name) => !name || !this.off.has(name), block: (number) => this.blocks[number],
      share: (layer) => (this.chosen !== null && layer.track !== undefined && layer.track !== this.chosen ? 0.3 : 1),
    }; // prettier-ignore
  }

  // the place that is followed: of the chosen track, of the first that lives, or of what the drawing names
  focus() {
    const t = this.spec.times[this.index] ?? 0;
    const all = [...this.tracks.values()];
    const track = this.tracks.get(this.chosen) || all.find((one) => elusive.living(one, t)) || all[0];
    const path = this.spec.focus || track;
    if (!path || !path.times.length) return null;
    const i = Math.max(0, elusive.upTo(path.times, t) - 1);
    return path.x[i] === null ? null : [path.x[i], path.y[i]];
  }

  // ---- building
  build() {
    const { make } = elusive;
    this.sizes.disconnect();
    this.hovered = null;
    const before = this.panels || [];
    const focused = before.findIndex((panel) => panel.canvas === document.activeElement);
    this.panels = this.spec.panels.map((panel, number) => new elusive.Panel(panel, this, number));
    this.touched = this.panels[this.touched?.number]; // the one before is drawn no more: its view stands still
    this.grid = make("div", { class: "panels" }, ...this.panels.map((panel) => panel.root));
    for (const panel of this.panels) {
      this.sizes.observe(panel.canvas);
      panel.canvas.addEventListener("pointerdown", () => (this.touched = panel));
    }
    this.log = this.spec.events?.length || this.spec.live ? new elusive.Log(this) : null;
    if (this.log && this.spec.log) this.grid.append(this.log.root);
    this.status = make("output", { class: "status", "aria-live": "off" });
    this.root.replaceChildren(this.grid, elusive.controls(this), this.status, (this.box = elusive.switches(this)));
    before.forEach((panel, k) => {
      const place = this.panels[k]?.place;
      if (place && panel.place)
        [place.cursor, place.points] = [
          panel.place.cursor,
          place.spec.mode === panel.place.spec.mode ? panel.place.points : [],
        ];
    });
    this.panels[focused]?.canvas.focus({ preventScroll: true });
    if (this.large !== null) this.enlarge(this.large, true);
  }

  // ---- what a person does
  get main() {
    return this.touched?.spec.plane
      ? this.touched
      : this.panels.find((panel) => panel.spec.plane && !panel.spec.follow) || this.panels[0];
  }

  key(event) {
    const from = event.target;
    if (event.ctrlKey || event.metaKey || event.altKey || from.closest("select, textarea")) return;
    if (from.closest("button, input") && !(from === this.slider && event.key === " ")) return;
    const panel = this.panels.find((one) => one.canvas === from) || this.main;
    if (panel.place?.key(event)) return event.preventDefault();
    const far = { ArrowLeft: [60, 0], ArrowRight: [-60, 0], ArrowUp: [0, 60], ArrowDown: [0, -60] }[event.key];
    const acts = {
      " ": () => this.play(!this.playing), ArrowLeft: () => this.stopAt(this.index - 1), ArrowRight: () => this.stopAt(this.index + 1),
      ",": () => this.stopAt(this.index - 1), ".": () => this.stopAt(this.index + 1), Home: () => this.stopAt(0),
      End: () => this.stopAt(this.spec.times.length - 1), "+": () => panel.zoom(1.3), "=": () => panel.zoom(1.3),
      "-": () => panel.zoom(1 / 1.3), 0: () => this.everything(), r: () => this.rule(!this.ruling), f: () => this.fill(), l: () => this.liver && this.goLive(!this.live),
      Escape: () => (this.rule(false), this.choose(null)),
    }; // prettier-ignore
    if (event.shiftKey && far) panel.pan(...far);
    else if (acts[event.key]) acts[event.key]();
    else return;
    event.preventDefault();
  }

  switch(name, on) {
    if (on) this.off.delete(name);
    else this.off.add(name);
    this.draw();
  }

  choose(number) {
    const track = this.tracks.get(number);
    this.chosen = track && number !== this.chosen ? number : null;
    if (this.chosen !== null && !elusive.living(track, this.spec.times[this.index])) this.goTo(track.times[0]);
    this.emit("chosen", { track: this.chosen });
    this.draw();
  }

  // brings a track into the middle, in which it is
  centre(number) {
    if (this.chosen !== number) this.choose(number);
    const [panel, focus] = [this.main, this.focus()];
    if (!focus || !panel.view) return;
    this.views.set(panel.xs, { c: focus[0], z: panel.view.vx.z });
    this.views.set(panel.ys, { c: focus[1], z: panel.view.vy.z });
    this.draw();
  }

  follow(on) {
    this.following = on;
    this.follower?.setAttribute("aria-pressed", String(on));
    if (on && this.main.view?.vx.z <= 1.01) this.main.zoom(this.spec.near || 4);
    this.draw();
  }

  rule(on) {
    this.ruling = on;
    for (const panel of this.panels) panel.measured = null;
    this.ruler?.setAttribute("aria-pressed", String(on));
    this.draw();
  }

  everything() {
    this.views.clear();
    if (this.following) this.follow(false);
    this.viewed(null);
    this.draw();
  }

  viewed(panel) {
    if (panel && !this.playing && this.following && panel === this.main) this.following = panel.spec.plane;
    this.refresh();
    clearTimeout(this.told);
    this.told = setTimeout(() => this.emit("viewed", this.seen()), 250);
  }

  // what is in view of the main panel
  seen() {
    const { view } = this.main;
    if (!view) return {};
    const [[x0, y0], [x1, y1]] = [view.back(view.left, view.bottom), view.back(view.right, view.top)];
    return { extent: [x0, x1, y0, y1], whole: !this.views.size };
  }

  turn() {
    const on = !this.panels[0].surface.active;
    for (const panel of this.panels) panel.surface.active = on;
    this.turner.textContent = on ? "2-D" : "3-D";
    this.turner.title = on ? "Show from above" : "Show as a surface";
    this.turner.setAttribute("aria-label", this.turner.title);
    this.root.dataset.view = on ? "3-D" : "2-D";
    this.draw();
  }

  get isFull() {
    return document.fullscreenElement === this.root;
  }

  fill() {
    if (this.isFull) document.exitFullscreen();
    else this.root.requestFullscreen?.();
  }

  enlarge(number, stay = false) {
    this.large = this.large === number && !stay ? null : number;
    for (const panel of this.panels) panel.root.classList.toggle("large", panel.number === this.large);
    this.draw();
  }

  // ---- time
  play(on, live = false) {
    if (!live) this.goLive(false);
    if (on && this.index >= this.spec.times.length - 1) this.show(0);
    this.playing = on && this.spec.times.length > 1;
    [this.last, this.position] = [null, this.index];
    if (!this.toggle) return;
    this.toggle.textContent = this.playing ? "❚❚" : "▶";
    this.toggle.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.root.dataset.playing = String(this.playing);
  }

  stopAt(index) {
    this.play(false);
    this.show(index);
  }

  goTo(t) {
    this.stopAt(elusive.nearest(this.spec.times, t));
  }

  // ---- a drawing that goes on: at its end, or left where one looks back
  goLive(on) {
    this.live = on;
    this.liver?.setAttribute("aria-pressed", String(on));
    if (!on) return;
    this.play(false, true);
    this.show(this.spec.times.length - 1);
  }

  grown() {
    this.clock = elusive.clockOf(this.spec.times, this.spec.unit);
    this.slider.max = this.spec.times.length - 1;
    const shown =
      this.spec.times[this.index] === this.shownAt ? this.index : elusive.nearest(this.spec.times, this.shownAt);
    if (this.live) this.index = this.spec.times.length - 1;
    else [this.position, this.index] = [this.position + shown - this.index, shown]; // older ones may have left
    this.log?.grown();
    const names = elusive.layerNames(this.spec).size;
    if (names !== this.named) this.box.replaceWith((this.box = elusive.switches(this)));
    this.named = names;
    this.refresh();
  }

  show(index) {
    this.index = Math.max(0, Math.min(this.spec.times.length - 1, index));
    this.draw();
  }

  tick(now) {
    if (!this.playing) return;
    const { times, unit } = this.spec;
    const speed = Number(this.speed.value);
    const passed = this.last === null ? 0 : (now - this.last) / 1000;
    this.last = now;
    if (!speed) this.position = this.index + 1;
    else if (unit !== "s") this.position += passed * speed * elusive.FRAMES;
    else {
      // a place between two times, moved on by what passed
      const low = Math.min(Math.floor(this.position), times.length - 2);
      let t = times[low] + (this.position - low) * (times[low + 1] - times[low]) + passed * speed;
      t = Math.min(t, times[times.length - 1]);
      const k = Math.min(Math.max(elusive.upTo(times, t) - 1, 0), times.length - 2);
      this.position = k + (times[k + 1] > times[k] ? (t - times[k]) / (times[k + 1] - times[k]) : 1);
    }
    const index = Math.min(times.length - 1, Math.floor(this.position + 1e-6));
    if (index !== this.index) {
      this.index = index;
      this.draw();
    }
    if (index === times.length - 1) this.play(false);
  }

  // ---- drawing
  // what is not drawn anew each time takes other colours
  paint(dark) {
    if (this.dark === dark) return;
    this.dark = dark;
    this.root.classList.toggle("dark", dark);
    this.box.replaceWith((this.box = elusive.switches(this)));
  }

  refresh() {
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => this.draw());
  }

  draw() {
    cancelAnimationFrame(this.waiting);
    this.waiting = 0;
    if (!this.panels) return;
    this.paint(elusive.isDark());
    const { main } = this;
    const focus = this.following && this.focus();
    if (focus && main.view) {
      const z = this.views.get(main.xs)?.z ?? 1;
      this.views.set(main.xs, { c: focus[0], z });
      this.views.set(main.ys, { c: focus[1], z });
    }
    for (const panel of this.panels) {
      panel.root.hidden = this.spec.live && !panel.spec.layers.length; // a system may not tell it
      panel.draw();
    }
    this.root.dataset.frame = this.index;
    this.shownAt = this.spec.times[this.index];
    if (this.slider) {
      const words = this.clock.say(this.spec.times[this.index]);
      this.slider.value = this.index;
      this.slider.setAttribute("aria-valuetext", words);
      this.counter.textContent = words;
    }
    this.status.textContent = this.said();
    this.log?.show();
    this.root.dataset.drawn = ++this.drawn;
  }

  // the numbers of this time: of the recording, and of the chosen track or the first that lives
  said() {
    const [words, t] = [[], this.spec.times[this.index] ?? 0];
    const add = ({ title, values, digits, unit, texts }, i) => {
      if (values[i] === null || values[i] === undefined) return;
      const text = texts
        ? texts[values[i]]
        : `${values[i].toFixed(digits)}${unit === "°" ? unit : unit ? ` ${unit}` : ""}`;
      if (text) words.push(`${title} ${text}`.trim());
    };
    for (const one of this.spec.status || []) add(one, this.index);
    const track = this.tracks.get(this.chosen) || [...this.tracks.values()].find((one) => elusive.living(one, t));
    if (!track) return words.join(" · ");
    const i = Math.max(0, elusive.upTo(track.times, t) - 1);
    const unsure = track.sure && !track.sure[i] ? " (not confirmed)" : "";
    if (elusive.living(track, t)) words.push(`track ${track.track}${unsure}`);
    else
      words.push(
        `track ${track.track} lives from ${this.clock.say(track.times[0])} to ${this.clock.say(track.times[track.times.length - 1])}`,
      );
    if (elusive.living(track, t)) for (const one of track.values || []) add(one, i);
    return words.join(" · ");
  }
};

elusive.named = (spec) =>
  JSON.stringify([spec.times.length, ...spec.panels.map((panel) => [panel.title, panel.plane && panel.extent])]);
