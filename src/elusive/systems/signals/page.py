"""Noise objects: what differs from a signal's noise in its statistics alone, made or recorded, tracked and seen.

Mazurek (2013).
"""

from __future__ import annotations

from elusive.systems.signals.scene import SignalScene, fitted
from elusive.workbench.run_inputs import Shown
from elusive.workbench.run_window import scenes_page
from elusive.workbench.shell import Page

TITLE = "Noise objects along a signal"
LEAD = (
    "An object that is noise itself, stronger than the noise about it, moves along a signal. Its statistic is "
    "accumulated along every velocity until it stands out; peaks above what noise does become tracks."
)
SCENE = "signals scene"
SAME = (("tracking", "object_size"), ("tracking", "filter", "border"))  # as the scene's


def settle(scene: SignalScene) -> SignalScene:
    """Let the tracking follow the objects' size and the signal's border."""
    sensor = scene.sensor
    return scene.replace(tracking=fitted(scene.tracking, sensor.object_size, sensor.border))


def _example(scene: SignalScene) -> str:
    (path,) = scene.paths
    return (
        f"an object {scene.sensor.object_size} samples long that moves {path.velocity[0]:g} samples a frame, from "
        f"frame {path.appears} to {path.leaves} (counted from 0) of {scene.frames}, {scene.samples} samples each."
    )


PAGE = Page(
    "signals", "/signals", "Signals", TITLE,
    "Objects without a shape in a one-dimensional signal: map of the statistic, threshold, detections, tracks, errors.",
    _example(SignalScene()),
    scenes_page(
        "/signals", TITLE, LEAD, {SCENE: "Make a scene", "signal": "Open a signal"},
        {SCENE: Shown(lambda _: SAME, settle)},
    ),
    keeps_runs=True,
)  # fmt: skip
