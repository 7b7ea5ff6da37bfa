"""Bearings: sensors and a path are placed, the emitter is tracked or located by its directions, and measured."""

from __future__ import annotations

from elusive.systems.bearings.page.measure import measure_window
from elusive.systems.bearings.page.place import PlaceWindow
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.page.still import StillWindow
from elusive.systems.bearings.page.track import WAYS
from elusive.systems.bearings.scene import BearingScene
from elusive.workbench.opener import open_scene
from elusive.workbench.session import example_state, offer_aside, state_of
from elusive.workbench.shell import Page, Steps, head, main, waiting
from elusive.workbench.side_by_side import TrackWindow, run, watch_window

TITLE = "An emitter by its bearings"
LEAD = (
    "Sensors hear from where something transmits, and not how far away it is. Place them, draw a path, and follow the "
    "emitter by its directions; or locate one that stands still."
)
WATCHED = "3 Watch"


async def build(example: bool, file: str = "") -> None:
    """Build the page; ``example``: track the ready path at once; ``file``: a scene that is opened."""
    head("/bearings")
    state = await state_of("bearings", BearingsState)
    if example:
        state, _ = await example_state("bearings", BearingsState)
    with main(TITLE, LEAD):
        offer_aside("bearings")
        if example:
            with waiting("Hearing and tracking the ready path ..."):
                await run(state, WAYS)
        open_scene(file, lambda path: state.take(BearingScene.from_yaml(path)), "press Run under Track")
        steps = Steps(
            state,
            {
                "1 Scene": lambda: PlaceWindow(state),
                "2 Track": lambda: TrackWindow(state, WAYS, lambda: steps.go(WATCHED)),
                WATCHED: lambda: watch_window(state),
                "4 Measure": lambda: measure_window(state),
                "5 A still emitter": lambda: StillWindow(state),
            },
            WATCHED if example else None,
        )


PAGE = Page(
    "bearings", "/bearings", "Bearings", TITLE,
    "Directions of arrival at a few sensors: a scene, its bearings, several estimators side by side, their errors "
    "against the bound.",
    "three sensors, a curved path, strays among the bearings; three estimators side by side.",
    build,
)  # fmt: skip
