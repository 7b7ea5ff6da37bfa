// What a person does with a drawing, `made`; what came of it is the page's title.
const told = {},
  tell = (name) => {
    const { X, Y, sx, vx, vy } = made.panels[0].view,
      other = made.panels[1].view,
      curve = made.panels[2].view;
    told[name] = {
      index: made.index,
      chosen: made.chosen,
      x: vx.c,
      y: vy.c,
      zoom: vx.z,
      linked: [other.vx.c, other.vy.c, other.vx.z],
      time: curve.vx.z,
      scale: sx,
    };
  };
const press = (key, more = {}) => made.root.dispatchEvent(new KeyboardEvent("keydown", { key, ...more }));
const label = (name) => made.root.querySelector(`[aria-label="${name}"]`);
const canvas = (number) => made.panels[number].canvas;
const point = (kind, number, [x, y], more = {}) => {
  const box = canvas(number).getBoundingClientRect(),
    { X, Y } = made.panels[number].view;
  const place = {
    clientX: box.left + X(x),
    clientY: box.top + Y(y),
    pointerId: 1,
    bubbles: true,
    cancelable: true,
    ...more,
  };
  canvas(number).dispatchEvent(kind === "wheel" ? new WheelEvent(kind, place) : new PointerEvent(kind, place));
};
for (const panel of made.panels) panel.canvas.setPointerCapture = () => {};
tell("start");
point("wheel", 0, [10, 10], { deltaY: -400 });
made.draw();
tell("wheel");
told.kept = made.panels[0].view.back(made.panels[0].view.X(10), made.panels[0].view.Y(10));
point("pointerdown", 1, [10, 10]);
point("pointermove", 1, [12, 10]);
point("pointerup", 1, [12, 10]);
made.draw();
tell("dragged");
press("0");
tell("all");
press("+");
made.draw();
tell("plus");
press("ArrowLeft", { shiftKey: true });
made.draw();
tell("moved");
press("0");
point("wheel", 2, [10, 1], { deltaY: -400 });
tell("unasked");
point("wheel", 2, [10, 1], { deltaY: -400, ctrlKey: true });
made.draw();
tell("curve");
press("0");
press("Home");
tell("home");
press("ArrowRight");
press(".");
tell("right");
press(",");
tell("back");
press("End");
tell("end");
label("Time").value = 20;
label("Time").dispatchEvent(new Event("input"));
tell("scrub");
told.counter = label("Time shown").textContent;
told.status = made.status.textContent;
point("pointermove", 0, [3.2, 12.7]);
told.under = made.panels[0].under.textContent;
point("pointermove", 2, [10, 2]);
told.time = made.panels[2].under.textContent;
point("pointerleave", 2, [10, 2]);
told.left = made.panels[2].under.textContent;
point("pointerdown", 2, [15.1, 2]);
point("pointerup", 2, [15.1, 2]);
tell("clicked");
document.querySelector('[data-track="2"]').click();
tell("centred");
told.pressed = document.querySelector('[data-track="2"]').getAttribute("aria-pressed");
press("Escape");
tell("escaped");
press("0");
point("pointerdown", 0, [20, 8]);
point("pointerup", 0, [20, 8]);
tell("chosen");
press("Escape");
made.root.querySelectorAll(".list button")[1].click();
tell("event");
press("Escape");
press("0");
press("r");
point("pointerdown", 0, [10, 10]);
point("pointermove", 0, [13, 14]);
point("pointerup", 0, [13, 14]);
made.draw();
told.ruler = made.root.dataset.measured;
press("r");
label("Keep the track in the middle").click();
made.show(40);
made.draw();
tell("followed");
press("0");
const before = canvas(1).toDataURL();
made.root.querySelectorAll(".layers input")[2].click();
told.layers = [...made.root.querySelectorAll(".layers label")].map((one) => one.textContent);
told.off = canvas(1).toDataURL() !== before;
press(" ");
told.playing = [made.playing, label("Pause") !== null];
press(" ");
told.paused = made.playing;
label("Speed").value = "0";
press("Home");
press(" ");
for (let k = 0; k < 30; k++) made.tick(16 * k);
tell("played");
made.play(false);
label("Speed").value = "1";
press("Home");
press(" ");
made.tick(0);
made.tick(10000);
tell("ten seconds");
made.play(false);
label("Enlarge Two").click();
told.large = made.panels[1].root.className;
told.nameless = [...made.root.querySelectorAll("button, input, select, canvas")].filter(
  (one) => !(one.getAttribute("aria-label") || one.textContent || one.labels?.length),
).length;
told.keys = made.root.getAttribute("aria-label");
document.title = JSON.stringify(told);
