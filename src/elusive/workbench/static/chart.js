// Histograms and curves: {series: [{name, x, y}], bars, xlabel, ylabel, xlim, ylim}.
"use strict";
elusive.Chart = class {
  constructor(root, spec) {
    this.root = root;
    root.classList.add("ew-chart");
    this.canvas = elusive.make("canvas", { role: "img" });
    this.legend = elusive.make("p", { class: "ew-legend" });
    root.append(this.canvas, this.legend);
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.canvas);
    this.update(spec);
  }

  update(spec) {
    this.spec = spec;
    this.canvas.setAttribute("aria-label", spec.label);
    this.draw();
  }

  destroy() { this.observer.disconnect(); }

  draw() {
    const { pen, width, height } = elusive.fit(this.canvas);
    const { spec } = this;
    if (!width) return;
    const colour = (name) => elusive.css(this.root, name);
    const known = (values) => values.filter((value) => value !== null);
    const all = (name) => spec.series.flatMap((series) => known(series[name]));
    const [x0, x1] = spec.xlim || [Math.min(...all("x")), Math.max(...all("x"))];
    const [y0, y1] = spec.ylim || [Math.min(0, ...all("y")), Math.max(1e-9, ...all("y")) * 1.05];
    const box = { left: 46, right: width - 10, top: 10, bottom: height - 34 };
    const px = (x) => box.left + ((x - x0) / (x1 - x0 || 1)) * (box.right - box.left);
    const py = (y) => box.bottom - ((y - y0) / (y1 - y0 || 1)) * (box.bottom - box.top);
    pen.clearRect(0, 0, width, height);
    this.ticks(pen, box, [x0, x1], [y0, y1], px, py, colour);
    pen.save();
    pen.beginPath();
    pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
    pen.clip();
    const count = spec.series.length;
    spec.series.forEach((series, number) => {
      const line = series.colour || elusive.TRACKS[number % elusive.TRACKS.length];
      if (spec.bars) {
        const share = (px(x0 + spec.bars) - px(x0)) / count;
        pen.fillStyle = line;
        series.x.forEach((x, k) => pen.fillRect(px(x) + number * share, py(series.y[k]), Math.max(1, share - 1), py(y0) - py(series.y[k])));
      } else {
        pen.beginPath();
        let broken = true;
        series.x.forEach((x, k) => {
          if (series.y[k] === null) { broken = true; return; }
          pen[broken ? "moveTo" : "lineTo"](px(x), py(series.y[k]));
          broken = false;
        });
        pen.strokeStyle = line;
        pen.lineWidth = 1.8;
        pen.setLineDash(series.dashed ? [5, 4] : []);
        pen.stroke();
      }
    });
    pen.restore();
    this.legend.replaceChildren(...spec.series.filter((one) => one.name).map((series, number) => {
      const key = elusive.make("span", { class: "ew-key" });
      key.style.background = series.colour || elusive.TRACKS[number % elusive.TRACKS.length];
      return elusive.make("span", {}, key, series.name);
    }));
  }

  ticks(pen, box, [x0, x1], [y0, y1], px, py, colour) {
    const steps = (low, high, about) => {
      const raw = (high - low) / about || 1;
      const step = [1, 2, 5, 10].map((k) => k * 10 ** Math.floor(Math.log10(raw))).find((k) => k >= raw);
      const found = [];
      for (let at = Math.ceil(low / step - 1e-9) * step; at <= high + 1e-9 * step; at += step) found.push(Number(at.toPrecision(6)));
      return found;
    };
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = colour("--ew-quiet");
    pen.strokeStyle = colour("--ew-grid");
    pen.lineWidth = 1;
    pen.setLineDash([]);
    pen.beginPath();
    pen.textAlign = "right";
    for (const y of steps(y0, y1, 4)) {
      pen.moveTo(box.left, py(y)); pen.lineTo(box.right, py(y));
      pen.fillText(`${y}`, box.left - 5, py(y) + 4);
    }
    pen.textAlign = "center";
    for (const x of steps(x0, x1, Math.max(3, (box.right - box.left) / 90))) pen.fillText(`${x}`, px(x), box.bottom + 14);
    pen.stroke();
    pen.fillText(this.spec.xlabel || "", (box.left + box.right) / 2, box.bottom + 29);
    pen.save();
    pen.translate(11, (box.top + box.bottom) / 2);
    pen.rotate(-Math.PI / 2);
    pen.fillText(this.spec.ylabel || "", 0, 0);
    pen.restore();
  }
};
elusive.made.chart = elusive.Chart;
