"""Charts: a coast, a route past it, a radar's plots, and the ship tracked with every use of the chart side by side."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from elusive.workbench.charts.chart import ChartWindow
from elusive.workbench.charts.compare import compare_window
from elusive.workbench.charts.panels import watch_spec
from elusive.workbench.charts.route import RouteWindow
from elusive.workbench.charts.scene import EXAMPLE_NAME, ChartScene
from elusive.workbench.charts.state import ChartsState, example
from elusive.workbench.charts.track import TrackWindow, run
from elusive.workbench.jobs import Job, away
from elusive.workbench.parts import Drawing, told
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, Steps, head, main

TITLE = "Ships near charted coasts"
LEAD = (
    "A ship is not on land, but a chart is wrong by some metres. Open a chart, draw a route past its coast, let a "
    "radar see the ship, and compare what uses of the chart make of it."
)
STEPS = ("1 Chart", "2 Route", "3 Track", "4 Watch", "5 Compare")
VIEWS = {"whole": "The whole way", "close": "Close to the ship"}


async def build(ready: bool) -> None:
    """Build the page; ``ready``: track the ready example at once."""
    head("/charts")
    state = await state_of("charts", ChartsState)
    with main(TITLE, LEAD):
        with ui.element("div").classes("ew-row") as wait:
            ui.spinner()
            ui.label("Sailing and tracking the ready route ..." if ready else "Drawing the coast ...")
        with told():
            if state.chart is None:
                state.open(EXAMPLE_NAME, await away(example), ChartScene.example())
            if ready and state.sailed is None:
                await run(state, Job())
        wait.delete()

        def step(number: int) -> None:
            state.step = STEPS[number]
            if number == 0:
                ChartWindow(state)
            elif number == 1:
                RouteWindow(state)
            elif number == 2:
                TrackWindow(state, lambda: steps.go(STEPS[3]))
            elif number == 3:
                _watch(state)
            else:
                compare_window(state)

        steps = Steps(
            [(title, lambda number=number: step(number)) for number, title in enumerate(STEPS)],  # type: ignore[misc]
            STEPS[3] if ready and state.step is None else state.step,
        )


def _watch(state: ChartsState) -> None:
    with ui.element("section").classes("ew-box w-full"):
        if state.sailed is None or state.spec is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
        sailed = state.sailed

        async def look(event: Any) -> None:
            spec = await away(lambda: watch_spec(sailed, close=event.value == "close"))
            if state.sailed is sailed:
                state.forget_frames()
                state.spec = spec
                player.show(spec)

        ui.toggle(VIEWS, value="whole", on_change=look).props("no-caps unelevated dense").classes("ew-modes mb-2")
        player = Drawing("player", state.spec)


PAGE = Page(
    "/charts", TITLE,
    "Electronic charts that are imprecise: land, quality zones, probability of water; a radar's plots tracked without "
    "a chart, with a hard one, and with four uses that know how wrong it may be.",
    "a ship through a synthetic delta, 5 km from its radar, after Bootsveld (2012), chapter 6.",
    build,
)  # fmt: skip
