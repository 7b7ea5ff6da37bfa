"""Noise objects: what differs from a signal's noise in its statistics alone, made, run, played, measured.

Mazurek (2013).
"""

from __future__ import annotations

from elusive.systems.signals.page.inputs import SignalInputs
from elusive.systems.signals.page.run import run_scene
from elusive.systems.signals.scene import SignalScene
from elusive.workbench.bench import Bench
from elusive.workbench.opener import open_scene
from elusive.workbench.runs import BenchState
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, head, main

TITLE = "Noise objects along a signal"
LEAD = (
    "An object that is noise itself, stronger than the noise about it, moves along a signal. Its statistic is "
    "accumulated along every velocity until it stands out; peaks above what noise does become tracks."
)


async def build(example: bool, file: str = "") -> None:
    """Build the page; ``example``: run its scene at once; ``file``: a scene that is opened."""
    head("/signals")
    state = await state_of("signals", lambda: BenchState(SignalScene().settled))
    with main(TITLE, LEAD):
        if example:
            state.kept = state.run or state.kept
            state.scene = SignalScene().settled
        open_scene(file, lambda path: state.take(SignalScene.from_yaml(path).settled))
        bench = Bench(state, lambda: SignalInputs(state).forms, run_scene, ("Highest score", "deviations of noise"))
    if example:
        await bench.run()


def _example(scene: SignalScene) -> str:
    (path,) = scene.paths
    return (
        f"an object {scene.sensor.object_size} samples long that moves {path.velocity[0]:g} samples a frame, from "
        f"frame {path.appears} to {path.leaves} (counted from 0) of {scene.frames}, {scene.samples} samples each."
    )


PAGE = Page(
    "signals", "/signals", TITLE,
    "Objects without a shape in a one-dimensional signal: map of the statistic, threshold, detections, tracks, errors.",
    _example(SignalScene()),
    build,
)  # fmt: skip
