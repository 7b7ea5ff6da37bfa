"""A recorded log in the place of a scene's paths and radiation: the same stages, from what was measured.

Mendieta (2017), sections 3.3.2 and 3.8 to 3.12; calibrated as `elusive track links` does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydantic import Field

from elusive.errors import DataError
from elusive.io.path_truth import PathTruth
from elusive.model import Model
from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.scene import LinkScene, Radiated
from elusive.systems.links.scene_run import SceneFrame, SceneRun, Stages


class LogCalibration(Model):
    """How a log is calibrated."""

    calibration_frames: int = Field(20, ge=2, description="First frames, in which nobody is there")


def run_link_log(
    scene: LinkScene,
    log: Sequence[RssFrame],
    calibration: LogCalibration,
    *,
    truth: PathTruth | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> SceneRun:
    """Track people through a recorded log by a scene's nodes, area and method.

    Parameters
    ----------
    scene
        Its paths and radiation have no part in it.
    log
        All frames; the first are the calibration's.
    calibration
        How many of them.
    truth
        Where people truly were; scores only.
    on_frame
        Called with the number of frames done. What it raises ends the run.

    Raises
    ------
    DataError
        If the calibration takes all frames, or a frame is not of the scene's nodes.
    """
    first = calibration.calibration_frames
    if len(log) <= first:
        raise DataError(
            f"calibration_frames: the log has {len(log)} frames, all of them taken for calibration; take fewer."
        )
    empty, rest = log[:first], log[first:]
    known = Calibrate().over(empty)
    times = np.array([frame.time_s for frame in log])
    method = scene.method.replace(voxel_m=scene.simulation.voxel_m, weights=scene.simulation.weights)
    chain = method.on(scene.network(), scene.area, float(np.median(np.diff(times))), known.mean_dbm)
    changing = RssChange()
    rss = before = changing.init(known)
    changes = []
    for frame in empty:
        before = changing.step(before, frame, empty=True)
        changes.append(before.change)
    stages = Stages(scene, chain, np.array(changes), scene.streams()[-1])
    frames: list[SceneFrame] = []
    for frame in rest:
        rss = changing.step(rss, frame, empty=stages.nobody)
        frames.append(stages.step(rss.change))
        if on_frame is not None:
            on_frame(len(frames))
    places = np.empty((len(rest), 0, 2)) if truth is None else truth.interpolated(times[first:])[..., :2]
    unseen = np.zeros((len(rest), len(chain.grid.centres)))
    return SceneRun(scene, Radiated(places, unseen[:0], unseen), tuple(frames))
