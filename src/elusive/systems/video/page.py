"""Radar video: ships, sea and coast are simulated, or a recording is opened; tracked before any threshold, and seen."""

from __future__ import annotations

from elusive.systems.video.scene import SETTLED, VideoScene
from elusive.systems.video.simulate import VideoSimulation
from elusive.workbench.parts import errors_shown
from elusive.workbench.run_state import RunState
from elusive.workbench.run_window import RunWindow
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, head, main

TITLE = "Ships in radar video"
LEAD = (
    "A ship too weak for a plot is still in what the radar received. Make a sea with ships before a coast, or open a "
    "recording; what of each cell is no clutter is followed from turn to turn, with a chart that may be wrong."
)
SCENE = "video scene"
KINDS = {SCENE: "Make a scene", "video": "Open radar video"}


async def build(example: bool, file: str = "") -> None:
    """Build the page; ``example``: run the ready scene at once; ``file``: a scene, recording or run that is opened."""
    head("/video")
    state = await state_of("video", lambda: RunState(tuple(KINDS), SCENE))
    with errors_shown():
        if file:
            state.take(file)
        elif example:
            state.begin(SCENE)
    with main(TITLE, LEAD):
        window = RunWindow(state, KINDS, {SCENE: SETTLED})
    if example:
        await window.run()


def _example(drawn: VideoSimulation) -> str:
    low, high = drawn.snr_db
    return (
        f"{drawn.ships} ships, {low:g} to {high:g} dB over clutter and noise, before a coast that its chart has "
        f"{drawn.coast_error_m:g} m wrong, and {drawn.rocks} rocks in no chart; {drawn.turns} turns."
    )


PAGE = Page(
    "video", "/video", TITLE,
    "What a radar receives, before any threshold: clutter learnt from place to place, ships followed through it, what "
    "lies still told apart; a plan (PPI) and a B-scan that play.",
    _example(VideoScene().simulation),
    build,
    keeps_runs=True,
)  # fmt: skip
