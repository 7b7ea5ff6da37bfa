"""What a person sees on every page: contrast of what is read, and of the ring round what has the focus."""

from __future__ import annotations

from typing import Any

import pytest

from tests.longer import longer
from tests.workbench.conftest import Served
from tests.workbench.test_links_page import OpenTab, button, step, told

READ, SEEN = 4.5, 3.0  # contrasts that WCAG 2.1 asks for, 1.4.3 and 1.4.11
RING_PX = 2.0
STOPS = 60  # of the Tab key, at most

# contrast of two colours as they stand on the page, by WCAG 2.1; what is seen through is laid over what is under it
CONTRAST = """
window.colourOf = (text) => {
  const pen = Object.assign(document.createElement("canvas"), { width: 1, height: 1 }).getContext("2d");
  pen.fillStyle = text; pen.fillRect(0, 0, 1, 1);
  const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
  return [r, g, b, a / 255];
};
window.groundOf = (one) => {
  const layers = [];
  for (let at = one; at; at = at.parentElement) layers.unshift(window.colourOf(getComputedStyle(at).backgroundColor));
  return layers.reduce((under, [r, g, b, a]) => [r, g, b].map((v, k) => a * v + (1 - a) * under[k]), [255, 255, 255]);
};
window.contrastOf = (colour, ground) => {
  const light = (rgb) => {
    const [r, g, b] = rgb.map((v) => v / 255).map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const [low, high] = [light(colour.slice(0, 3)), light(ground)].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
};
"""
RING = """() => {
  const one = document.activeElement;
  if (!one || one === document.body) return null;
  const ringed = one.closest(".q-field")?.querySelector(".q-field__control") ?? one;
  const style = getComputedStyle(ringed);
  const wide = style.outlineStyle === "none" ? 0 : parseFloat(style.outlineWidth);
  const named = one.getAttribute("aria-label") || one.labels?.[0]?.innerText || one.innerText || one.title;
  const contrast = contrastOf(colourOf(style.outlineColor), groundOf(ringed.parentElement));
  return [one.outerHTML.slice(0, 160), wide, contrast, Boolean(named?.trim())];
}"""


def rings(page: Any) -> dict[str, tuple[float, float, bool]]:
    """Press Tab through a page: width and contrast of the ring round each stop, and whether it has a name."""
    page.evaluate("document.activeElement.blur()")
    found: dict[str, tuple[float, float, bool]] = {}
    for _ in range(STOPS):
        page.keyboard.press("Tab")
        told_of = page.evaluate(RING)
        if told_of is None:
            break
        found[told_of[0]] = (told_of[1], told_of[2], told_of[3])
    return found


@pytest.mark.parametrize(("width", "scheme"), longer([(1280, "light"), (800, "dark")], (800, "dark")))
def test_what_has_the_focus_is_ringed_and_what_is_refused_can_be_read_and_closed(
    served: Served, open_tab: OpenTab, width: int, scheme: str
) -> None:
    page = open_tab(width, scheme).page
    page.add_init_script(CONTRAST)
    for path in ("/own", "/links"):
        page.goto(f"{served.address}{path}")
        button(page, "Run" if path == "/own" else "Create paths").wait_for()
        seen = rings(page)
        assert len(seen) > 8
        if path == "/links":
            step(page, "3 Sensors")
            page.get_by_role("checkbox", name="Select 0").wait_for()
            seen |= rings(page)
        assert {one: ring for one, ring in seen.items() if ring[0] < RING_PX or ring[1] < SEEN or not ring[2]} == {}
    page.goto(f"{served.address}/own?run=none")
    told(page, "'none': is no run that is kept here")
    for one in (button(page, "Close"), page.locator(".q-notification__message")):
        read = one.evaluate("(one) => contrastOf(colourOf(getComputedStyle(one).color), groundOf(one))")
        assert read >= READ
