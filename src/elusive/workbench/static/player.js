// Plays a block of frames (time, panel, row, column), one byte a value: every panel from one clock, so none drifts.
"use strict";
elusive.RATE = 10; // frames a second at speed 1
elusive.Player = class {
  constructor(root, spec, emit) {
    [this.root, this.emit] = [root, emit];
    [this.frame, this.position, this.playing, this.last, this.drawn, this.large] = [0, 0, false, null, 0, null];
    root.classList.add("ew-player");
    root.setAttribute("role", "group");
    root.tabIndex = 0;
    root.addEventListener("keydown", (event) => this.key(event));
    this.observer = new ResizeObserver(() => this.draw());
    this.update(spec);
    const tick = (now) => {
      this.tick(now);
      this.request = requestAnimationFrame(tick);
    };
    this.request = requestAnimationFrame(tick);
  }

  update(spec) {
    if (this.spec && JSON.stringify(spec) === JSON.stringify(this.spec)) return;
    const other = !this.spec || this.spec.url !== spec.url;
    this.spec = spec;
    this.build();
    if (other) this.load();
    else this.draw();
  }

  destroy() {
    cancelAnimationFrame(this.request);
    this.observer.disconnect();
  }

  async load() {
    const spec = this.spec;
    this.block = null;
    this.root.dataset.ready = "no";
    [this.frame, this.position, this.playing] = [0, 0, false];
    try {
      const answers = await Promise.all([fetch(spec.url), spec.marks ? fetch(spec.marks) : null]);
      if (answers.some((answer) => answer && !answer.ok)) throw new Error("gone");
      const [bytes, marks] = [await answers[0].arrayBuffer(), answers[1] ? await answers[1].json() : []];
      if (spec !== this.spec) return;
      [this.block, this.marks] = [new Uint8Array(bytes), marks];
      this.say("");
      this.root.dataset.ready = "yes";
      this.draw();
      if (spec.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches) this.play(true);
    } catch {
      this.say("These frames are no longer held; run this again.");
    }
  }

  build() {
    const { make } = elusive;
    const spec = this.spec;
    this.root.replaceChildren();
    this.observer.disconnect();
    this.root.setAttribute("aria-label", spec.label);
    this.panels = spec.panels.map((panel, number) => {
      const canvas = make("canvas", { role: "img", "aria-label": panel.title, "data-frame": "0" });
      canvas.style.aspectRatio = `${spec.width} / ${spec.height}`;
      const button = make("button", { type: "button", class: "ew-enlarge", "aria-label": `Enlarge ${panel.title}` }, "⤢");
      const scale = panel.unit === undefined ? "" : `${panel.low.toFixed(1)} to ${panel.high.toFixed(1)} ${panel.unit}`;
      const caption = make("figcaption", {}, make("span", {}, panel.title), make("small", {}, scale));
      if (spec.panels.length > 1) caption.append(button);
      const figure = make("figure", { class: "ew-panel" }, caption, canvas);
      button.addEventListener("click", () => this.enlarge(number));
      this.observer.observe(canvas);
      const image = make("canvas", { width: spec.width, height: spec.height });
      const pixels = image.getContext("2d").createImageData(spec.width, spec.height);
      const table = elusive.table(panel.colours);
      const colours = Array.from({ length: 256 }, (_, value) => `rgb(${elusive.bytes(table, value)})`);
      const surface = new elusive.Surface(canvas, () => this.draw());
      return { panel, canvas, figure, button, image, pixels, table, colours, surface };
    });
    const grid = make("div", { class: "ew-panels", "data-count": spec.panels.length });
    grid.append(...this.panels.map((one) => one.figure));
    this.root.append(grid, this.controls());
    if (spec.legend) this.root.append(make("p", { class: "ew-legend" }, ...spec.legend.map((text) => make("span", {}, text))));
    if (this.large !== null && this.large < this.panels.length) this.enlarge(this.large, true);
  }

  controls() {
    const { make } = elusive;
    const button = (text, label, act) => {
      const made = make("button", { type: "button", "aria-label": label, title: label }, text);
      made.addEventListener("click", act);
      return made;
    };
    this.toggle = button("▶", "Play", () => this.play(!this.playing));
    this.slider = make("input", { type: "range", min: 0, max: Math.max(0, this.spec.frames - 1), value: 0, "aria-label": "Frame" });
    this.slider.addEventListener("input", () => { this.play(false); this.show(Number(this.slider.value)); });
    this.speed = make("select", { "aria-label": "Speed" });
    for (const [value, text] of [[0.2, "⅕ ×"], [0.5, "½ ×"], [1, "1 ×"], [2, "2 ×"], [5, "5 ×"], [0, "every refresh"]]) {
      this.speed.append(make("option", { value, ...(value === 1 ? { selected: "" } : {}) }, text));
    }
    this.counter = make("output", { class: "ew-counter", "aria-label": "Frame shown" });
    this.message = make("span", { class: "ew-message", role: "status" });
    const parts = [
      this.toggle,
      button("■", "Stop", () => { this.play(false); this.show(0); }),
      button("❮", "Step back", () => { this.play(false); this.show(this.frame - 1); }),
      button("❯", "Step forward", () => { this.play(false); this.show(this.frame + 1); }),
      this.slider, this.counter, this.speed,
    ];
    if (this.spec.turnable) {
      this.view = button("3-D", "Show as a surface", () => {
        const on = !this.panels[0].surface.active;
        for (const one of this.panels) one.surface.active = on;
        this.view.textContent = on ? "2-D" : "3-D";
        this.view.title = on ? "Show from above" : "Show as a surface";
        this.view.setAttribute("aria-label", this.view.title);
        this.root.dataset.view = on ? "3-D" : "2-D";
        this.draw();
      });
      parts.push(this.view);
    }
    return make("div", { class: "ew-bar" }, ...parts, this.message);
  }

  key(event) {
    if (event.target.closest("select, button") || (event.target === this.slider && event.key !== " ")) return;
    const acts = {
      " ": () => this.play(!this.playing), ArrowLeft: () => this.show(this.frame - 1),
      ArrowRight: () => this.show(this.frame + 1), Home: () => this.show(0), End: () => this.show(this.spec.frames - 1),
    };
    if (acts[event.key]) { event.preventDefault(); acts[event.key](); }
  }

  enlarge(number, stay = false) {
    this.large = this.large === number && !stay ? null : number;
    this.panels.forEach((one, k) => {
      one.figure.classList.toggle("ew-large", k === this.large);
      one.button.setAttribute("aria-pressed", String(k === this.large));
    });
  }

  say(text) { this.message.textContent = text; }

  play(on) {
    if (on && this.frame >= this.spec.frames - 1) this.show(0);
    this.playing = on && this.block !== null;
    this.last = null;
    this.toggle.textContent = this.playing ? "❚❚" : "▶";
    this.toggle.setAttribute("aria-label", this.playing ? "Pause" : "Play");
    this.root.dataset.playing = String(this.playing);
  }

  show(frame) {
    this.frame = Math.max(0, Math.min(this.spec.frames - 1, frame));
    this.position = this.frame;
    this.draw();
  }

  tick(now) {
    if (!this.playing) return;
    const speed = Number(this.speed.value);
    const passed = this.last === null ? 0 : (now - this.last) / 1000;
    this.last = now;
    this.position = speed ? this.position + passed * elusive.RATE * speed : this.frame + 1;
    const frame = Math.min(this.spec.frames - 1, Math.floor(this.position));
    if (frame !== this.frame) {
      this.frame = frame;
      this.draw();
    }
    if (frame === this.spec.frames - 1) this.play(false);
  }

  draw() {
    if (!this.block) return;
    for (const [number, one] of this.panels.entries()) elusive.paint(this, one, number);
    const seconds = this.spec.interval_s ? `, ${(this.frame * this.spec.interval_s).toFixed(0)} s` : "";
    this.counter.textContent = `${this.frame + 1} / ${this.spec.frames}${seconds}`;
    this.slider.value = this.frame;
    this.root.dataset.frame = this.frame;
    this.root.dataset.drawn = ++this.drawn;
  }
};
elusive.made.player = elusive.Player;
