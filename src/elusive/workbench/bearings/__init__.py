"""Bearings: sensors and a path are placed, the emitter is tracked or located by its directions, and measured."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from elusive.workbench.bearings.measure import measure_window
from elusive.workbench.bearings.panels import watch_spec
from elusive.workbench.bearings.place import PlaceWindow
from elusive.workbench.bearings.state import BearingsState
from elusive.workbench.bearings.still import StillWindow
from elusive.workbench.bearings.track import TrackWindow, run
from elusive.workbench.jobs import Job, away
from elusive.workbench.parts import Drawing, told
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, Steps, head, main

TITLE = "An emitter by its bearings"
LEAD = (
    "Sensors hear from where something transmits, and not how far away it is. Place them, draw a path, and follow the "
    "emitter by its directions; or locate one that stands still."
)
VIEWS = {"whole": "The whole path", "close": "Close to the emitter"}
STEPS = ("1 Scene", "2 Track", "3 Watch", "4 Measure", "5 A still emitter")


async def build(example: bool) -> None:
    """Build the page; ``example``: track the ready path at once."""
    head("/bearings")
    state = await state_of("bearings", BearingsState)
    with main(TITLE, LEAD):
        if example and state.flown is None:
            with ui.element("div").classes("ew-row") as wait:
                ui.spinner()
                ui.label("Hearing and tracking the ready path ...")
            with told():
                await run(state, Job())
            wait.delete()

        def step(number: int) -> None:
            state.step = STEPS[number]
            if number == 0:
                PlaceWindow(state)
            elif number == 1:
                TrackWindow(state, lambda: steps.go(STEPS[2]))
            elif number == 2:
                _watch(state)
            elif number == 3:
                measure_window(state)
            else:
                StillWindow(state)

        steps = Steps(
            [(title, lambda number=number: step(number)) for number, title in enumerate(STEPS)],  # type: ignore[misc]
            STEPS[2] if example and state.step is None else state.step,
        )


def _watch(state: BearingsState) -> None:
    with ui.element("section").classes("ew-box w-full"):
        if state.flown is None or state.spec is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
        flown = state.flown

        async def look(event: Any) -> None:
            spec = await away(lambda: watch_spec(flown, close=event.value == "close"))
            if state.flown is flown:
                state.forget_frames()
                state.spec = spec
                player.show(spec)

        ui.toggle(VIEWS, value="whole", on_change=look).props("no-caps unelevated dense").classes("ew-modes mb-2")
        player = Drawing("player", state.spec)


PAGE = Page(
    "/bearings", TITLE,
    "Directions of arrival at a few sensors: a scene, its bearings, several estimators side by side, their errors "
    "against the bound.",
    "three sensors, a curved path, strays among the bearings; three estimators side by side.",
    build,
)  # fmt: skip
