// A chart over the frames of a player in the same section: a line stands at the frame shown, and moves it when dragged.
"use strict";
elusive.Curves = class extends elusive.Chart {
  constructor(root, spec) {
    super(root, spec);
    root.classList.add("ew-curves");
    this.at = elusive.make("div", { class: "ew-at" });
    root.append(this.at);
    this.canvas.addEventListener("pointerdown", (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      this.move(event);
    });
    this.canvas.addEventListener("pointermove", (event) => { if (event.buttons) this.move(event); });
    this.watcher = new MutationObserver(() => this.follow());
    this.draw();
  }

  destroy() {
    super.destroy();
    this.watcher.disconnect();
  }

  get player() {
    const found = this.root.closest("section")?.querySelector(".ew-player");
    if (found !== this.followed && found) this.watcher.observe(found, { attributes: true, attributeFilter: ["data-drawn"] });
    this.followed = found;
    return found;
  }

  draw() {
    super.draw();
    if (this.at) this.follow();
  }

  // the same box as Chart draws in
  get box() { return { left: 46, right: this.canvas.clientWidth - 10, top: 10, bottom: this.canvas.clientHeight - 34 }; }

  get range() {
    const all = this.spec.series.flatMap((series) => series.x.filter((x) => x !== null));
    return this.spec.xlim || [Math.min(...all), Math.max(...all)];
  }

  follow() {
    const frame = Number(this.player?.dataset.frame || 0);
    const time = this.spec.times[Math.min(frame * (this.spec.stride || 1), this.spec.times.length - 1)];
    const [{ left, right, top, bottom }, [x0, x1]] = [this.box, this.range];
    this.at.style.left = `${left + ((time - x0) / (x1 - x0 || 1)) * (right - left)}px`;
    this.at.style.top = `${top}px`;
    this.at.style.height = `${Math.max(0, bottom - top)}px`;
    this.root.dataset.frame = frame;
  }

  move(event) {
    const player = this.player?.made;
    if (!player) return;
    const [{ left, right }, [x0, x1]] = [this.box, this.range];
    const time = x0 + ((event.offsetX - left) / (right - left)) * (x1 - x0);
    let nearest = 0;
    this.spec.times.forEach((one, k) => {
      if (Math.abs(one - time) < Math.abs(this.spec.times[nearest] - time)) nearest = k;
    });
    player.play(false);
    player.show(Math.floor(nearest / (this.spec.stride || 1)));
  }
};
elusive.made.curves = elusive.Curves;
