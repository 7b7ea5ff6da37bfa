"""Pages by the keyboard alone, on a narrow screen: a scene of a signal is run, a radar's plots are opened."""

from __future__ import annotations

from typing import Any

import pytest

from tests.workbench.conftest import Served
from tests.workbench.test_links_page import OpenTab, button, field, report, told

CONTROLS = 60  # of a page, at most


def tabbed(page: Any, control: Any, key: str = "Tab") -> None:
    """Go on to a control."""
    for _ in range(CONTROLS):
        page.keyboard.press(key)
        if control.evaluate("(one) => one.contains(document.activeElement)"):
            return
    raise AssertionError(page.evaluate("document.activeElement.outerHTML"))


def chosen(page: Any, key: str, name: str) -> None:
    """Choose an option of a field."""
    tabbed(page, page.locator(f'[data-field="{key}"]').first)
    page.keyboard.press("Enter")
    option = page.get_by_role("option", name=name, exact=True)
    option.wait_for()
    for _ in range(CONTROLS):
        page.keyboard.press("ArrowDown")
        if option.evaluate("(one) => one.classList.contains('q-manual-focusable--focused')"):
            break
    page.keyboard.press("Enter")
    page.get_by_role("listbox").locator("visible=true").first.wait_for(state="hidden")


@pytest.mark.thorough
def test_a_signals_scene_is_changed_and_run(served: Served, open_tab: OpenTab) -> None:
    page = open_tab(800).page
    page.goto(f"{served.address}/signals")
    tabbed(page, field(page, "frames"))
    page.keyboard.press("Control+A")
    page.keyboard.type("60")
    tabbed(page, button(page, "Run"), "Shift+Tab")
    page.keyboard.press("Enter")
    report(page, "001-signals_scene").get_by_text("One object was found").first.wait_for()
    tabbed(page, button(page, "See the result"))
    page.keyboard.press("Enter")
    page.wait_for_function("scrollY > 0")
    assert page.evaluate("document.documentElement.scrollWidth") <= 800


@pytest.mark.thorough
def test_a_radars_plots_are_opened(served: Served, open_tab: OpenTab) -> None:
    plots = "".join(f"{k},{2000 + 5 * k},{40 + 0.1 * k}\n" for k in range(30))
    (served.folder / "keyed.csv").write_text(f"time_s,range_m,bearing_deg\n{plots}")
    page = open_tab(800).page
    page.goto(f"{served.address}/own")
    chosen(page, "kind", "A radar's plots, and charts")
    chosen(page, "plots", "keyed.csv")
    told(page, "30 lines: time_s 0 to 29")
    tabbed(page, page.get_by_role("button", name='Expand "How it is read"'))
    page.keyboard.press("Enter")
    field(page, "radar_lat").wait_for()
    tabbed(page, field(page, "radar_lat"))
    page.keyboard.type("45")
    tabbed(page, button(page, "Run"), "Shift+Tab")
    page.keyboard.press("Enter")
    told(page, '"Radar longitude": is not given, and the other is; give both, or neither.')
    assert page.evaluate("document.documentElement.scrollWidth") <= 800
    (served.folder / "keyed.csv").unlink()
