"""Radio tomography: the six windows of Mendieta (2017), chapter 5, as steps of one page."""

from __future__ import annotations

from nicegui import ui

from elusive.workbench.jobs import Job
from elusive.workbench.links.algorithm import AlgorithmWindow, apply
from elusive.workbench.links.paths import PathsWindow
from elusive.workbench.links.performance import PerformanceWindow
from elusive.workbench.links.radiation import RadiationWindow
from elusive.workbench.links.sensors import SensorsWindow
from elusive.workbench.links.state import LinksState
from elusive.workbench.links.tracking import tracking_window
from elusive.workbench.parts import told
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, Steps, head, main

TITLE = "People in a radio network"
LEAD = (
    "People who carry no device shadow the links between radios. Draw who walks, place the radios, image the area from "
    "the links, and follow everybody through it."
)
STEPS = ("1 Paths", "2 Radiation", "3 Sensors", "4 Algorithm", "5 Tracking", "6 Performance")


async def build(example: bool) -> None:
    """Build the page; ``example``: run the thesis's first simulation at once."""
    head("/links")
    state = await state_of("links", LinksState)
    with main(TITLE, LEAD):
        if example and state.outcome is None:
            with ui.element("div").classes("ew-row") as wait:
                ui.spinner()
                ui.label("Drawing and tracking the first simulation ...")
            with told():
                await apply(state, Job())
            wait.delete()
            if state.tracking_spec is not None:
                state.tracking_spec["autoplay"] = True
        steps = Steps(
            [
                (STEPS[0], lambda: _kept(state, 0, lambda: PathsWindow(state))),
                (STEPS[1], lambda: _kept(state, 1, lambda: RadiationWindow(state))),
                (STEPS[2], lambda: _kept(state, 2, lambda: SensorsWindow(state))),
                (STEPS[3], lambda: _kept(state, 3, lambda: AlgorithmWindow(state, lambda: steps.go(STEPS[4])))),
                (STEPS[4], lambda: _kept(state, 4, lambda: tracking_window(state))),
                (STEPS[5], lambda: _kept(state, 5, lambda: PerformanceWindow(state))),
            ],
            STEPS[4] if example and state.step is None else state.step,
        )


def _kept(state: LinksState, number: int, build_step: object) -> None:
    """Build a step, and note it as where this tab is."""
    state.step = STEPS[number]
    assert callable(build_step)
    build_step()


PAGE = Page(
    "/links", TITLE,
    "A radio network sees people by the links they shadow: paths, radiation, sensors, image, tracks, scores.",
    "three people among 41 radios on the border of 24 by 24 m, the first simulation of Mendieta (2017).",
    build,
)  # fmt: skip
