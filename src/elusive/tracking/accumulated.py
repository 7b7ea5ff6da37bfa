"""Tracks of targets found in accumulated evidence: candidate, confirmed, deleted.

What has been accumulated fades slowly and outlives its target; a track is therefore judged by the fresh evidence at
its predicted place, which is independent of what made it: confirmed by Wald's (1945) sequential test, ended by Page's
(1954).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import NamedTuple

from pydantic import Field

from elusive.contracts import Array
from elusive.model import Model
from elusive.tracking.footprint import Footprint
from elusive.tracking.fresh import Fresh
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.track import Status
from elusive.tracking.trail import Trail

REMEMBERED = 64  # updates in which a track's hits are counted: more than a track without any can live


class PeakTracker(Model):
    """When a track is believed and when it has ended.

    A track is hit in a frame if the evidence along its path exceeds what noise accumulates to. It is confirmed once
    it has been hit in ``confirm_frames`` frames and fresh evidence speaks for it; it is deleted once fresh evidence is
    noise again, once it has not been hit in ``miss_frames`` frames in a row, or when it leaves a bounded frame.
    """

    confirm_frames: int = Field(3, ge=1, description="Frames in which a confirmed track has been hit")
    confirm_risk: float = Field(
        0.01, gt=0, le=1, description="Probability that a track of a false alarm is ever confirmed; 1: by frames alone"
    )
    miss_frames: int = Field(5, ge=1, description="Frames in a row without a hit after which a track is deleted")
    deletion_frames: float = Field(
        2000.0, ge=1, description="Mean frames, at least, between wrong deletions of a target that is there"
    )

    @cached_property
    def lifecycle(self) -> Lifecycle:
        """What is made of hits."""
        window = max(REMEMBERED, self.confirm_frames * self.miss_frames)
        return Lifecycle(
            confirm_frames=self.confirm_frames, confirm_window=window,
            delete_frames=self.miss_frames, drop_frames=self.miss_frames,
        )  # fmt: skip

    def judged(self, life: Life, number: int, fresh: Fresh, hit: bool | None, *, outside: bool) -> Life:
        """Return a track's life after a frame; ``hit`` is None where the frame is missing."""
        gone = outside or fresh.against > math.log(self.deletion_frames)
        if hit is not None:
            believed = fresh.best >= -math.log(self.confirm_risk)
            return self.lifecycle.step(life, float(hit), number, believed=believed, gone=gone)[0]
        return life._replace(status="deleted") if gone else life


class PeakTrack(NamedTuple):
    """One track after a frame."""

    life: Life
    position: tuple[float, ...]  # x[, y] in samples of the frame
    velocity: tuple[float, ...]  # vx[, vy] against the scene
    score: float  # of the evidence along its path, in deviations of what target-free evidence accumulates to
    first_frame: int  # in which it was found, counted from 1
    fresh: Fresh  # what its place has shown since it was found
    path: Array  # (4,) x, y in the scene, vx, vy
    trail: Trail  # less what all others explain
    age: float  # how long ago its evidence came, in the mean
    about: Trail  # less what those explain that go another way
    footprint: Footprint  # as wide as it has been seen to be

    @property
    def track(self) -> int:
        """Number, from 1."""
        return self.life.track or 0

    @property
    def status(self) -> Status:
        """Candidate, confirmed or deleted."""
        return self.life.status or "candidate"
