// Placing on a map with pointer or keys: nodes are put, moved and chosen, paths and areas drawn.
// `place` of a panel: {mode: "view", "node", "path" or "area", step [m], nodes: [{name, x, y, selected}]}.
"use strict";
elusive.snap = (at) => at.map((value) => Math.round(20 * value) / 20); // places are of 5 cm

elusive.Place = class {
  constructor(panel, emit) {
    [this.panel, this.emit] = [panel, emit];
    [this.points, this.dragged, this.cursor, this.from] = [[], null, null, null];
    panel.canvas.dataset.mode = this.spec.mode;
    panel.canvas.setAttribute("role", "application");
    panel.canvas.addEventListener("dblclick", () => this.close());
  }

  get spec() {
    return this.panel.spec.place;
  }

  nodeAt([x, y]) {
    const reach = 11 / this.panel.view.sx;
    return this.spec.nodes.find((node) => Math.hypot(node.x - x, node.y - y) < reach);
  }

  // each of the three: whether the panel is not to be dragged
  down(at) {
    const { mode } = this.spec;
    this.cursor = null;
    this.from = at;
    if (mode === "path") this.points = [elusive.snap(at)];
    if (mode === "node") {
      const node = this.nodeAt(at);
      this.dragged = node ? { node, x: node.x, y: node.y } : null;
    }
    return mode === "path" || Boolean(this.dragged);
  }

  move(at) {
    if (this.spec.mode === "path" && this.points.length && this.from) {
      const last = this.points[this.points.length - 1];
      const [x, y] = elusive.snap(at);
      if (Math.hypot(x - last[0], y - last[1]) > 0.1) this.points.push([x, y]);
    } else if (this.dragged) [this.dragged.x, this.dragged.y] = elusive.snap(at);
    else return false;
    this.panel.figure.refresh();
    return true;
  }

  up(at, panned) {
    const { mode } = this.spec;
    const [x, y] = elusive.snap(at);
    const { from, dragged } = this;
    if (!from || mode === "view") return false;
    const moved = Math.hypot(at[0] - from[0], at[1] - from[1]) > 4 / this.panel.view.sx;
    [this.from, this.dragged] = [null, null];
    if (mode === "path") {
      if (this.points.length > 1) this.emit("drawn", { points: this.points });
      this.points = [];
    } else if (mode === "area" && !panned) this.points.push([x, y]);
    else if (dragged && moved) this.emit("moved", { name: dragged.node.name, x, y });
    else if (dragged) this.emit("chosen", { name: dragged.node.name });
    else if (mode === "node" && !panned && !moved) this.emit("placed", { x, y });
    this.panel.figure.refresh();
    return true;
  }

  // a double click closes an area; its second click is no corner
  close() {
    if (this.spec.mode !== "area") return;
    const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);
    const points = this.points.filter((point, k) => !k || apart(point, this.points[k - 1]) > 0.05);
    if (points.length > 2) this.emit("outlined", { points });
    this.forget();
  }

  forget() {
    [this.points, this.dragged, this.from] = [[], null, null];
    this.panel.figure.refresh();
  }

  // whether the key was for the map
  key(event) {
    const { mode, step } = this.spec;
    if (mode === "view") return false;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (way) {
      const [x0, x1, y0, y1] = this.panel.spec.extent;
      const [x, y] = this.cursor || [Math.round((x0 + x1) / 2), Math.round((y0 + y1) / 2)];
      const far = (step || 0.5) * (event.shiftKey ? 0.2 : 1); // metres a key
      this.cursor = elusive.snap([x + far * way[0], y + far * way[1]]);
      this.panel.under.textContent = this.panel.words(...this.cursor, this.panel);
    } else if ((event.key === "Enter" || event.key === " ") && this.cursor) this.act();
    else if (event.key === "c" && this.points.length > 1) {
      this.emit(mode === "area" ? "outlined" : "drawn", { points: this.points });
      this.points = [];
    } else if (event.key === "Escape") this.points = [];
    else if (event.key === "Delete" && mode === "node") this.emit("removed", {});
    else return false;
    this.panel.figure.refresh();
    return true;
  }

  act() {
    if (this.spec.mode !== "node") return this.points.push(this.cursor);
    const node = this.nodeAt(this.cursor);
    if (node) this.emit("chosen", { name: node.name });
    else this.emit("placed", { x: this.cursor[0], y: this.cursor[1] });
  }

  draw(pen, view, at) {
    const { nodes } = this.spec;
    for (const node of nodes) {
      const { x, y } = this.dragged?.node === node ? this.dragged : node;
      pen.fillStyle = at.css(node.selected ? "--accent" : "--ink");
      elusive.marker(pen, "square", view.X(x), view.Y(y), 4.5);
      if (nodes.length <= 24 || node.selected)
        elusive.word(pen, node.name, view.X(x) + 7, view.Y(y) - 6, pen.fillStyle, at.css("--paper"), 11);
    }
    pen.strokeStyle = pen.fillStyle = at.css("--accent");
    const drawn = this.points.map(([x, y]) => [view.X(x), view.Y(y)]);
    elusive.polyline(pen, drawn, 2);
    for (const [x, y] of drawn) elusive.marker(pen, "dot", x, y, 3);
    if (this.cursor) elusive.marker(pen, "plus", view.X(this.cursor[0]), view.Y(this.cursor[1]), 9);
  }
};
