// The page of a report: its drawing, and the table whose buttons bring a track into the middle.
"use strict";
elusive.report = function (spec) {
  const buttons = [...document.querySelectorAll("[data-track]")];
  const pressed = (track) =>
    buttons.forEach((one) => one.setAttribute("aria-pressed", String(Number(one.dataset.track) === track)));
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const colour = () => {
    // the page that it stands in may say so in the address
    const asked = window.location.hash.slice(1);
    const dark = asked === "dark" || (asked !== "light" && scheme.matches);
    for (const [name, on] of [
      ["dark", dark],
      ["body--dark", dark],
      ["body--light", !dark],
    ])
      document.body.classList.toggle(name, on);
  };
  scheme.addEventListener("change", colour);
  window.addEventListener("hashchange", colour);
  colour();
  const figure = new elusive.Figure(
    document.getElementById("drawing"),
    spec,
    (name, detail) => name === "chosen" && pressed(detail.track),
  );
  for (const one of buttons) {
    const track = Number(one.dataset.track);
    one.addEventListener("click", () => (figure.chosen === track ? figure.choose(track) : figure.centre(track)));
  }
};
