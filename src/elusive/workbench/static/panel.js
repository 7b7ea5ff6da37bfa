// Paints one panel of a player at its frame: the image, then the marks that stand for people, tracks and paths.
"use strict";
elusive.TRAIL = 25; // frames of a track's past that are drawn

elusive.bytes = (table, value) => {
  const word = table[value];
  return [word & 255, (word >> 8) & 255, (word >> 16) & 255].join(",");
};

elusive.paint = function (player, one, number) {
  const { pen, width, height } = elusive.fit(one.canvas);
  const { spec, block, frame } = player;
  const size = spec.width * spec.height;
  const values = block.subarray((frame * spec.panels.length + number) * size, (frame * spec.panels.length + number + 1) * size);
  one.canvas.dataset.frame = frame;
  if (!width) return;
  if (one.surface.active) {
    one.surface.draw(pen, width, height, values, spec.height, spec.width, one.colours, "#0b0724");
    return;
  }
  const words = new Uint32Array(one.pixels.data.buffer);
  for (let row = 0; row < spec.height; row++) {
    // the first row of a floor is in the south, of an image on top
    const to = (spec.down ? row : spec.height - 1 - row) * spec.width;
    for (let column = 0; column < spec.width; column++) words[to + column] = one.table[values[row * spec.width + column]];
  }
  one.image.getContext("2d").putImageData(one.pixels, 0, 0);
  pen.imageSmoothingEnabled = false;
  pen.drawImage(one.image, 0, 0, width, height);
  const view = new elusive.View(spec.extent, width, height, 0, spec.down);
  if (spec.corners) elusive.line(pen, view, spec.corners, "rgba(255,255,255,.55)", 1, true);
  for (const node of spec.nodes || []) {
    pen.fillStyle = "rgba(255,255,255,.6)";
    pen.fillRect(view.x(node[0]) - 1.5, view.y(node[1]) - 1.5, 3, 3);
  }
  elusive.marks(pen, view, (player.marks || [])[number], frame, width);
};

// marks of a panel: for each frame a list of [kind, x, y, colour, text, radius]; lines of equal text are joined
elusive.marks = function (pen, view, frames, frame, width) {
  if (!frames) return;
  const small = width < 260 ? 0.75 : 1;
  const trails = new Map();
  for (let at = Math.max(0, frame - elusive.TRAIL); at <= frame; at++) {
    for (const [kind, x, y, colour, text] of frames[at]) {
      if (kind !== "track") continue;
      if (!trails.has(text)) trails.set(text, []);
      trails.get(text).push([x, y]);
    }
  }
  for (const [text, points] of trails) elusive.line(pen, view, points, elusive.track(text), 1.8 * small);
  for (const [kind, x, y, colour, text, radius] of frames[frame]) {
    const [px, py] = [view.x(x), view.y(y)];
    if (kind === "truth") elusive.cross(pen, px, py, 5 * small, "#ffffff");
    else if (kind === "old") elusive.dot(pen, px, py, 1.6, "rgba(255,255,255,.55)", false);
    else if (kind === "ring") elusive.dot(pen, px, py, radius * view.scale, "rgba(255,255,255,.7)", false);
    else if (kind === "points") {
      pen.fillStyle = colour;
      pen.fillRect(px - 1, py - 1, 2, 2);
    }
    else elusive.dot(pen, px, py, 4 * small, elusive[colour] || colour || "#ffffff", true);
    // beside the mark, towards the middle where it stands at the edge
    const aside = px > width - 24 ? -6 * small - 8 * String(text).length : 6 * small;
    if (text && kind !== "ring") elusive.word(pen, text, px + aside, py < 18 ? py + 16 * small : py - 5 * small, elusive[colour] || colour || "#fff", 13 * small);
  }
};

elusive.track = (text) => elusive.TRACKS[(Number(text) || 0) % elusive.TRACKS.length];
