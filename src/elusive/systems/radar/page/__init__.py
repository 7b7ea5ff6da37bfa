"""Charts: a coast, a route past it, a radar's plots, and the ship tracked with every use of the chart side by side."""

from __future__ import annotations

from elusive.systems.radar.page.chart import ChartWindow
from elusive.systems.radar.page.compare import compare_window
from elusive.systems.radar.page.route import RouteWindow
from elusive.systems.radar.page.state import ChartsState, example
from elusive.systems.radar.page.track import WAYS
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene
from elusive.workbench.jobs import away
from elusive.workbench.opener import open_scene
from elusive.workbench.session import example_state, offer_aside, state_of
from elusive.workbench.shell import Page, Steps, head, main, waiting
from elusive.workbench.side_by_side import TrackWindow, run, watch_window

TITLE = "Ships near charted coasts"
LEAD = (
    "A ship is not on land, but a chart is wrong by some metres. Open a chart, draw a route past its coast, let a "
    "radar see the ship, and compare what uses of the chart make of it."
)
WATCHED = "4 Watch"


async def build(ready: bool, file: str = "") -> None:
    """Build the page; ``ready``: track the ready example at once; ``file``: a scene that is opened."""
    head("/charts")
    state = await state_of("charts", ChartsState)
    if ready:
        state, _ = await example_state("charts", ChartsState)
    with main(TITLE, LEAD):
        offer_aside("charts")
        words = "Sailing and tracking the ready route ..." if ready else "Drawing the coast ..."
        with waiting(words):
            if state.chart is None:
                state.open(EXAMPLE_NAME, await away(example), RadarScene.example())
            if ready:
                await run(state, WAYS)
            open_scene(file, state.open_scene, "press Run under Track")
        steps = Steps(
            state,
            {
                "1 Chart": lambda: ChartWindow(state),
                "2 Route": lambda: RouteWindow(state),
                "3 Track": lambda: TrackWindow(state, WAYS, lambda: steps.go(WATCHED)),
                WATCHED: lambda: watch_window(state),
                "5 Compare": lambda: compare_window(state),
            },
            WATCHED if ready else None,
        )


PAGE = Page(
    "radar", "/charts", "Ships and charts", TITLE,
    "Electronic charts that are imprecise: land, quality zones, probability of water; a radar's plots tracked without "
    "a chart, with a hard one, and with four uses that know how wrong it may be.",
    "a ship through a synthetic delta, 5 km from its radar, after Bootsveld (2012), chapter 6.",
    build,
)  # fmt: skip
