// What stands below the panels: play, steps, time line, zoom, ruler, full screen; and a switch for each layer.
"use strict";
// buttons, time line and speed
elusive.controls = function (figure) {
  const { make } = elusive;
  const { spec } = figure;
  const button = (text, label, act) => {
    const made = make("button", { type: "button", "aria-label": label, title: label }, text);
    made.addEventListener("click", act);
    return made;
  };
  // one that stays pressed
  const switched = (...of) => {
    const made = button(...of);
    made.setAttribute("aria-pressed", "false");
    return made;
  };
  const parts = [];
  if (spec.times.length > 1 || spec.live) {
    figure.toggle = button("▶", "Play", () => figure.play(!figure.playing));
    figure.slider = make("input", { type: "range", min: 0, max: spec.times.length - 1, "aria-label": "Time" });
    figure.slider.addEventListener("input", () => figure.stopAt(Number(figure.slider.value)));
    figure.counter = make("output", { class: "counter", "aria-label": "Time shown" });
    figure.speed = make("select", { "aria-label": "Speed", title: "Speed" });
    const whole =
      spec.unit === "s" ? spec.times[spec.times.length - 1] - spec.times[0] : spec.times.length / elusive.FRAMES;
    const usual = [1, 2, 5, 10, 20, 50, 100, 1000].find((one) => whole / one <= 40) || 1000;
    const named = (one) => (spec.unit === "s" ? `${one} ×` : `${one * elusive.FRAMES} frames/s`);
    for (const one of [0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000, 0])
      figure.speed.append(
        make("option", { value: one, ...(one === usual ? { selected: "" } : {}) }, one ? named(one) : "every refresh"),
      );
    const line = make("span", { class: "timeline" }, figure.slider);
    if (figure.log && !spec.live) line.append(figure.log.marks());
    parts.push(
      figure.toggle, button("❮", "Step back", () => figure.stopAt(figure.index - 1)),
      button("❯", "Step forward", () => figure.stopAt(figure.index + 1)), line, figure.counter, figure.speed,
    ); // prettier-ignore
  }
  if (spec.live) {
    figure.liver = switched("Live", "Live: show what comes", () => figure.goLive(!figure.live));
    parts.push(figure.liver, (figure.liveWords = make("output", { class: "counter" })));
  }
  const planes = figure.panels.filter((panel) => panel.spec.plane);
  if (planes.length) {
    parts.push(
      button("−", "Zoom out", () => figure.main.zoom(1 / 1.5)),
      button("+", "Zoom in", () => figure.main.zoom(1.5)),
    );
    if (spec.turnable) parts.push((figure.turner = button("3-D", "Show as a surface", () => figure.turn())));
    if (figure.tracks.size || spec.focus || spec.live)
      parts.push(
        (figure.follower = switched("Follow", "Keep the track in the middle", () => figure.follow(!figure.following))),
      );
    parts.push((figure.ruler = switched("Ruler", "Ruler", () => figure.rule(!figure.ruling))));
  }
  parts.push(button("All", "Show everything", () => figure.everything()));
  parts.push(button("Full screen", "Full screen", () => figure.fill()));
  return make("div", { class: spec.times.length > 1 || spec.live ? "controls timed" : "controls" }, ...parts);
};

elusive.empty = (layer) => (layer.x ?? layer.ends ?? layer.rings ?? layer.spans ?? [0]).length === 0;

elusive.layerNames = function (spec) {
  const names = new Map();
  for (const panel of spec.panels)
    for (const layer of panel.layers)
      if (layer.name && !names.has(layer.name) && !elusive.empty(layer)) names.set(layer.name, layer);
  return names;
};

// one switch a name that layers have, in their order: below the chart that alone has it, or below all panels
elusive.switches = function (figure) {
  const { make } = elusive;
  const names = elusive.layerNames(figure.spec);
  const having = (name) => figure.panels.filter((panel) => panel.spec.layers.some((layer) => layer.name === name));
  if (figure.tracks.size) {
    if ([...figure.tracks.values()].some((one) => one.sx))
      names.set("ellipses", { type: "text", words: "ellipses, 95 %" });
    names.set("whole paths", { type: "text", words: "whole paths, faintly" });
  }
  const box = make("div", { class: "layers" });
  for (const panel of figure.panels) panel.legend.replaceChildren();
  for (const [name, layer] of names) {
    const [only, ...others] = having(name);
    const place = only && !others.length && !only.spec.plane ? only.legend : box;
    const check = make("input", { type: "checkbox" });
    check.checked = !figure.off.has(name);
    check.addEventListener("change", () => figure.switch(name, check.checked));
    place.append(
      make("label", {}, check, make("i", { class: `key ${layer.type} ${layer.marker || ""}` }), layer.words || name),
    );
    const key = place.lastChild.querySelector(".key");
    key.hidden = layer.type === "image" || layer.type === "text";
    if (!key.hidden) key.style.color = figure.at({}).ink(layer.colour || layer.fill || "--ink");
  }
  if (figure.spec.note) box.append(make("span", {}, figure.spec.note));
  return box;
};
