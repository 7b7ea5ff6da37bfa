// A figure that goes on: each line that comes adds to the layers of its drawing; who looks back is left where he is.
"use strict";
elusive.PICTURES = 300; // latest that are held
elusive.EVENTS = 500;

// takes what is new into a drawing: arrays go on, a layer that is not there yet is added, what is too old leaves
elusive.extend = function (spec, more, most) {
  spec.times.push(...more.times);
  spec.events.push(...more.events);
  if (spec.events.length > elusive.EVENTS) spec.events = spec.events.slice(-elusive.EVENTS);
  spec.status.forEach((one, i) => one.values.push(...more.status[i]));
  more.panels.forEach(({ layers, ...rest }, number) => {
    const panel = Object.assign(spec.panels[number], rest);
    for (const layer of layers) {
      const known = panel.layers.find((one) => one.key === layer.key);
      elusive.goOn(known ?? (panel.layers.push({ key: layer.key }), panel.layers.at(-1)), layer);
    }
  });
  if (spec.times.length > 1.1 * most) elusive.shorten(spec, most);
  const [first, last] = [spec.times[0], spec.times.at(-1)];
  for (const panel of spec.panels)
    if (panel.x.time) [panel.extent[0], panel.extent[1]] = [first, last > first ? last : first + 1];
};

elusive.goOn = function (known, more) {
  for (const [name, value] of Object.entries(more)) {
    if (name === "picture") (known.pictures ??= []).push(value);
    else if (name === "values") {
      known.values ??= value.map((one) => ({ ...one, values: [] }));
      value.forEach((one, i) => known.values[i].values.push(...one.values));
    } else if (Array.isArray(value) && name !== "extent" && name !== "dash") (known[name] ??= []).push(...value);
    else known[name] = value;
  }
  const old = (known.pictures?.length ?? 0) - elusive.PICTURES;
  if (old > 0) [known.pictures, known.times] = [known.pictures.slice(old), known.times.slice(old)];
};

// bytes of a picture: unpacked where it is shown, for most are gone by before anybody looks
elusive.unpacked = function (pictures, number) {
  if (typeof pictures[number] === "string") {
    const letters = atob(pictures[number]);
    const bytes = new Uint8Array(letters.length);
    for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
    pictures[number] = bytes;
  }
  return pictures[number];
};

elusive.shorten = function (spec, most) {
  const from = spec.times[spec.times.length - most];
  const cut = (list, n) => list.splice(0, n);
  for (const one of spec.status) cut(one.values, spec.times.length - most);
  cut(spec.times, spec.times.length - most);
  spec.events = spec.events.filter(([time]) => time >= from);
  for (const panel of spec.panels) {
    for (const layer of panel.layers.filter((one) => one.key)) {
      const keys = layer.times ?? layer.x ?? [];
      const [count, n] = [keys.length, elusive.upTo(keys, from - 1e-6)];
      for (const one of layer.values ?? []) cut(one.values, n);
      for (const [name, value] of Object.entries(layer))
        if (Array.isArray(value) && value.length === count && name !== "values") cut(value, n);
    }
    panel.layers = panel.layers.filter((one) => !one.key || (one.times ?? one.x)?.length);
  }
};

// a drawing that comes line by line from an address: first itself, then lists of what is new
elusive.Live = class {
  constructor(root, url, emit) {
    [this.root, this.emit, this.off] = [root, emit, new AbortController()];
    this.read(url).catch(
      (error) => error.name !== "AbortError" && this.say("The connection is lost; load the page anew."),
    );
  }

  destroy() {
    this.off.abort();
    this.figure?.destroy();
  }

  say(words) {
    if (this.figure) this.figure.liveWords.textContent = words === "live" ? "" : words;
    else this.root.textContent = words;
    this.root.dataset.live = words;
  }

  async read(url) {
    const answer = await fetch(url, { signal: this.off.signal });
    if (!answer.ok) return this.say("This run is no longer live.");
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    this.say("Waiting for the first measurement ...");
    let rest = "";
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      const lines = (rest + part.value).split("\n");
      rest = lines.pop();
      for (const line of lines) if (line) this.take(JSON.parse(line));
    }
    this.say("It has ended.");
  }

  take(told) {
    if (!Array.isArray(told)) return (this.spec = told);
    for (const more of told) elusive.extend(this.spec, more, this.spec.most);
    if (!this.spec.times.length) return;
    if (this.figure) return this.figure.grown();
    this.root.textContent = "";
    this.figure = new elusive.Figure(this.root, this.spec, this.emit);
    this.figure.goLive(true);
    this.say("live");
  }
};
