"""Radar video: ships, sea and coast are simulated, or a recording is opened; tracked before any threshold, and seen."""

from __future__ import annotations

from elusive.systems.video.scene import SETTLED, VideoScene
from elusive.systems.video.simulate import VideoSimulation
from elusive.workbench.run_inputs import Shown
from elusive.workbench.run_window import scenes_page
from elusive.workbench.shell import Page

TITLE = "Ships in radar video"
LEAD = (
    "A ship too weak for a plot is still in what the radar received. Make a sea with ships before a coast, or open a "
    "recording; what of each cell is no clutter is followed from turn to turn, with a chart that may be wrong."
)
SCENE = "video scene"
KINDS = {SCENE: "Make a scene", "video": "Open radar video"}


def _example(drawn: VideoSimulation) -> str:
    low, high = drawn.snr_db
    return (
        f"{drawn.ships} ships, {low:g} to {high:g} dB over clutter and noise, before a coast that its chart has "
        f"{drawn.coast_error_m:g} m wrong, and {drawn.rocks} rocks in no chart; {drawn.turns} turns."
    )


PAGE = Page(
    "video", "/video", "Radar video", TITLE,
    "What a radar receives, before any threshold: clutter learnt from place to place, ships followed through it, what "
    "lies still told apart; a plan (PPI) and a B-scan that play.",
    _example(VideoScene().simulation),
    scenes_page("/video", TITLE, LEAD, KINDS, {SCENE: Shown(lambda _: SETTLED)}),
    keeps_runs=True,
)  # fmt: skip
