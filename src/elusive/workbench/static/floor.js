// The map of a scene: area, paths, nodes, ellipses, coverage. Paths, areas and nodes are drawn with pointer or keys.
"use strict";
elusive.Floor = class {
  constructor(root, spec, emit) {
    [this.root, this.emit] = [root, emit];
    [this.points, this.dragged, this.cursor] = [[], null, null];
    root.classList.add("ew-floor");
    this.canvas = elusive.make("canvas", { tabindex: 0, role: "application" });
    this.place = elusive.make("output", { class: "ew-place", "aria-label": "Place under the pointer" });
    root.append(this.canvas, this.place);
    for (const name of ["pointerdown", "pointermove", "pointerup", "dblclick", "keydown"]) {
      this.canvas.addEventListener(name, (event) => this[name](event));
    }
    this.canvas.addEventListener("pointercancel", () => this.forget());
    this.observer = new ResizeObserver(() => this.draw());
    this.observer.observe(this.canvas);
    this.update(spec);
  }

  update(spec) {
    if (this.spec && this.spec.mode !== spec.mode) this.points = [];
    this.spec = spec;
    this.canvas.setAttribute("aria-label", spec.label);
    this.canvas.dataset.mode = spec.mode || "view";
    this.draw();
  }

  destroy() { this.observer.disconnect(); }

  forget() { [this.points, this.dragged] = [[], null]; this.draw(); }

  metres(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.view.back(event.clientX - box.left, event.clientY - box.top).map((value) => Math.round(20 * value) / 20);
  }

  nodeAt(x, y) {
    const reach = 11 / this.view.scale;
    return (this.spec.nodes || []).find((node) => Math.hypot(node.x - x, node.y - y) < reach);
  }

  pointerdown(event) {
    if (event.button) return;
    const [x, y] = this.metres(event);
    this.cursor = null;
    if (this.spec.mode === "path") this.points = [[x, y]];
    else if (this.spec.mode === "node") this.dragged = { node: this.nodeAt(x, y), from: [x, y], x, y };
    if (this.spec.mode !== "view") this.canvas.setPointerCapture(event.pointerId);
  }

  pointermove(event) {
    const [x, y] = this.metres(event);
    this.place.textContent = `x ${x.toFixed(2)} m, y ${y.toFixed(2)} m`;
    if (this.spec.mode === "path" && this.points.length) {
      const [lastX, lastY] = this.points[this.points.length - 1];
      if (Math.hypot(x - lastX, y - lastY) > 0.1) { this.points.push([x, y]); this.draw(); }
    } else if (this.dragged && this.dragged.node) {
      [this.dragged.x, this.dragged.y] = [x, y];
      this.draw();
    }
  }

  pointerup(event) {
    if (event.button) return;
    const [x, y] = this.metres(event);
    if (this.spec.mode === "path" && this.points.length > 1) this.emit("drawn", { points: this.points });
    if (this.spec.mode === "path") this.forget();
    if (this.spec.mode === "area") { this.points.push([x, y]); this.draw(); }
    if (this.spec.mode === "node" && this.dragged) {
      const { node, from } = this.dragged;
      const moved = Math.hypot(x - from[0], y - from[1]) > 4 / this.view.scale;
      this.dragged = null;
      if (node && moved) this.emit("moved", { name: node.name, x, y });
      else if (node) this.emit("chosen", { name: node.name });
      else if (!moved) this.emit("placed", { x, y });
    }
    this.draw();
  }

  dblclick() {
    if (this.spec.mode !== "area") return;
    const points = this.points.filter((point, k) => !k || Math.hypot(point[0] - this.points[k - 1][0], point[1] - this.points[k - 1][1]) > 0.05);
    if (points.length > 2) this.emit("outlined", { points });
    this.forget();
  }

  keydown(event) {
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    const step = (this.spec.step || 0.5) * (event.shiftKey ? 0.2 : 1); // metres a key
    if (moves[event.key]) {
      const [x0, x1, y0, y1] = this.spec.extent;
      const [x, y] = this.cursor || [Math.round((x0 + x1) / 2), Math.round((y0 + y1) / 2)];
      this.cursor = [x + step * moves[event.key][0], y + step * moves[event.key][1]].map((value) => Math.round(20 * value) / 20);
      this.place.textContent = `x ${this.cursor[0].toFixed(2)} m, y ${this.cursor[1].toFixed(2)} m`;
    } else if ((event.key === "Enter" || event.key === " ") && this.cursor) {
      this.act();
    } else if (event.key === "c" && this.points.length > 1) {
      this.emit(this.spec.mode === "area" ? "outlined" : "drawn", { points: this.points });
      this.points = [];
    } else if (event.key === "Escape") {
      this.points = [];
    } else if (event.key === "Delete" && this.spec.mode === "node") {
      this.emit("removed", {});
    } else return;
    event.preventDefault();
    this.draw();
  }

  act() {
    const [x, y] = this.cursor;
    if (this.spec.mode === "node") {
      const node = this.nodeAt(x, y);
      if (node) this.emit("chosen", { name: node.name });
      else this.emit("placed", { x, y });
    } else if (this.spec.mode !== "view") this.points.push([x, y]);
  }

  draw() {
    const { pen, width, height } = elusive.fit(this.canvas);
    if (!width) return;
    elusive.drawFloor(this, pen, width, height);
  }
};
elusive.made.floor = elusive.Floor;
