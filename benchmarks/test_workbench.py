"""The workbench in a browser: frames a second of its players, and the wait from Apply to the first frame."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

from elusive.report import drawing as draw
from elusive.report.packing import dumps
from tests.workbench.conftest import browser, open_tab, served, server  # noqa: F401  fixtures
from tests.workbench.test_links_page import ANSWERS, READY, begin_long_run, button, step

FRAMES, SECONDS = 400, 4.0
RATE = """async ([seconds]) => {
    const root = document.querySelector(".drawing");
    const before = Number(root.dataset.drawn), began = performance.now();
    await new Promise((go) => setTimeout(go, 1000 * seconds));
    return (Number(root.dataset.drawn) - before) / ((performance.now() - began) / 1000);
}"""
FIGURE = """(spec) => {
    const root = document.createElement("div");
    root.style.width = "1200px";
    document.body.prepend(root);
    const figure = new elusive.Figure(root, spec);
    figure.tick = () => figure.show((figure.index + 1) % spec.times.length);
}"""


def figure(panels, side):
    """Return a drawing of images side by side, each of noise over time."""
    bytes_ = np.random.default_rng(0).integers(0, 256, (panels, FRAMES, side, side), dtype=np.uint8)
    edges, times = (0.0, side, 0.0, side), list(range(FRAMES))
    images = [draw.image({"block": one, "low": 0.0, "high": 1.0}, edges, "heat", times=times) for one in bytes_]
    drawn = [draw.plane(f"{k}", edges, [image], span=3) for k, image in enumerate(images)]
    return json.loads(dumps(draw.drawing("bench", times, drawn)))


@pytest.mark.parametrize(("panels", "side", "name"), [(8, 49, "eight panels of 49x49"), (1, 256, "one of 256x256")])
def test_frames_a_second(panels, side, name, served, open_tab, report):  # noqa: F811
    page = open_tab().page
    page.goto(served.address)
    page.evaluate(FIGURE, figure(panels, side))
    page.locator(READY).wait_for()
    report(f"workbench: {name}, frames a second", page.evaluate(RATE, [SECONDS]), 50)


def test_apply_shows_its_first_frame(served, open_tab, report):  # noqa: F811
    waits = []
    for _ in range(3):
        page = open_tab().page
        page.goto(f"{served.address}/links")
        step(page, "4 Algorithm")
        began = time.perf_counter()
        button(page, "Apply").click()
        page.locator('[role=tabpanel][aria-label="5 Tracking"]').wait_for()  # it goes on by itself
        page.locator(READY).wait_for()
        waits.append(time.perf_counter() - began)
    report("workbench: 5 s over the wait from Apply to the first frame", 5.0 / float(np.median(waits)), 1)


def test_a_click_is_answered_while_it_computes(served, open_tab, report):  # noqa: F811
    page = open_tab().page
    begin_long_run(page, served.address)
    times = page.evaluate(ANSWERS, 10)
    assert button(page, "Cancel").is_enabled(), "the run was over before the clicks; measure a longer one"
    button(page, "Cancel").click()
    report("workbench: 200 ms over the median answer to a click while it computes", 200.0 / float(np.median(times)), 1)
