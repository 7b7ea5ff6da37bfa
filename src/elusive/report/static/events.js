// What happened: marks on the time line, and a list in which each line leads to its time.
"use strict";
elusive.Log = class {
  constructor(figure) {
    const { make } = elusive;
    this.figure = figure;
    this.times = figure.spec.events.map((event) => event[0]);
    this.list = make("div", { class: "list" });
    this.root = make(
      "section",
      { class: "panel log", "aria-label": "What happened" },
      make("h2", {}, "What happened"),
      this.list,
    );
    this.root.style.setProperty("--span", figure.spec.log || 4);
    this.held = [...figure.spec.events];
    this.lines = this.held.map((event) => this.line(event));
    if (figure.spec.unlisted) this.list.prepend(make("p", {}, `${figure.spec.unlisted} earlier ones are not listed.`));
  }

  line(event) {
    const { make } = elusive;
    const [time, words, track] = event;
    const cells = [this.figure.clock.say(time), track === null ? "" : `track ${track}`, words];
    const line = make("button", { type: "button" }, ...cells.map((text) => make("span", {}, text)));
    line.addEventListener("click", () => this.lead(event));
    this.list.append(line);
    return line;
  }

  // what has happened since; what is too old has left
  grown() {
    const { events } = this.figure.spec;
    while (this.held.length && this.held[0] !== events[0]) (this.held.shift(), this.lines.shift().remove());
    for (const event of events.slice(this.held.length)) (this.held.push(event), this.lines.push(this.line(event)));
    this.times = events.map((event) => event[0]);
  }

  // a mark a moment, so that few stand for many
  marks() {
    const { times } = this.figure.spec;
    const span = times[times.length - 1] - times[0] || 1;
    const box = elusive.make("span", { class: "ticks", "aria-hidden": "true" });
    for (const place of new Set(this.times.map((t) => ((t - times[0]) / span).toFixed(3)))) {
      const mark = elusive.make("i");
      mark.style.left = `${100 * Math.max(0, Math.min(1, Number(place)))}%`;
      box.append(mark);
    }
    return box;
  }

  lead([time, , track]) {
    this.figure.goTo(time);
    if (track !== null && this.figure.tracks.has(track)) this.figure.centre(track);
  }

  show() {
    const past = elusive.upTo(this.times, this.figure.spec.times[this.figure.index]);
    const { chosen } = this.figure;
    const shown = `${past} ${this.times.length} ${this.times[0]} ${chosen}`;
    if (shown === this.shown) return;
    this.shown = shown;
    this.lines.forEach((line, i) => {
      const track = this.figure.spec.events[i][2];
      const other = chosen !== null && track !== null && track !== chosen;
      line.className = `${i >= past ? "later" : i === past - 1 ? "latest" : ""}${other ? " other" : ""}`;
    });
    const latest = this.lines[past - 1];
    if (!this.list.matches(":hover, :focus-within"))
      this.list.scrollTop = latest ? latest.offsetTop - 0.5 * this.list.clientHeight : 0;
  }
};
