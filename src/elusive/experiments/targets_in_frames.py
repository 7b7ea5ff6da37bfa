"""Monte Carlo trials of several weak targets in frames: scenes drawn anew, tracked, scored against their truth.

Scores: GOSPA with its parts (Rahmathullah, Garcia-Fernandez and Svensson, 2017), CLEAR MOT (Bernardin and Stiefelhagen,
2008), IDF1 (Ristani et al., 2016), of the confirmed tracks.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array
from elusive.model import Positive
from elusive.results import scored
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.report import NEAR_PX
from elusive.systems.images.results import ImageLog
from elusive.systems.images.scene import ImageScene
from elusive.systems.images.simulate import draw_images
from elusive.systems.images.track import track_images


class TargetsInFrames(ImageScene):
    """A scene whose paths and noise are drawn anew in each trial: its seed has no effect."""

    filter_knows_target: bool = Field(False, description="The filter knows the target's motion and its mean SNR")
    tracking: ImageTracking = Field(
        ImageTracking(filter={"kind": "several", "sensor": {"kind": "white"}}),
        description="How it is tracked",
    )
    cutoff_px: Positive = Field(NEAR_PX, description="Distance from which a track stands for no target, c of GOSPA")


def trial(parameters: TargetsInFrames, rng: Generator) -> dict[str, float | Array]:
    """Draw a recording, track it and score it.

    Returns
    -------
    dict
        ``gospa`` [px], its parts ``localisation``, ``missed`` and ``false`` [px^2] and the number of confirmed
        ``tracks``, ``(frames,)`` each; over the recording ``mota``, ``idf1``, ``found`` (share of the targets' times),
        ``mismatches`` (identity switches), ``rmse`` [px] and ``nees`` of the pairs.
    """
    scene = parameters.replace(seed=int(rng.integers(2**31)))
    drawn = draw_images(scene)
    tracking = scene.settled.tracking.replace(seed=int(rng.integers(2**31)))
    log, tracks = ImageLog(tracking), list[float]()
    for step in track_images(drawn.frames, tracking):
        log.append(step)
        tracks.append(sum(track.status == "confirmed" for track in step.tracks))
    scores = scored(log, drawn.truth, parameters.cutoff_px).confirmed
    gospa = scores.gospa
    return {
        "gospa": gospa.distance, "localisation": gospa.localisation, "missed": gospa.missed, "false": gospa.false,
        "tracks": np.array(tracks, dtype=np.float64), "mota": scores.mota, "idf1": scores.identity.idf1,
        "found": scores.found, "mismatches": float(scores.mismatches), "rmse": scores.rmse, "nees": scores.nees,
    }  # fmt: skip


SCENARIO = Scenario(
    trial, TargetsInFrames, dict.fromkeys(("gospa", "localisation", "missed", "false", "tracks"), ("frame",))
)
