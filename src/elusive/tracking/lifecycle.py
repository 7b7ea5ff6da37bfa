"""Candidate, confirmed, deleted: a track's life, read from the probability that its target exists.

Hysteresis on existence, as in integrated probabilistic data association (Musicki, Evans and Stankovic, 1994), and
confirmation by M of the latest N updates (Blackman and Popoli, 1999, section 6.2). A tracker that knows only whether
a target was detected gives existence 1 for a hit and 0 for a miss.
"""

from __future__ import annotations

from typing import NamedTuple, Self

from pydantic import Field, model_validator

from elusive.model import Model, Probability
from elusive.tracking.track import Status


class Life(NamedTuple):
    """A target's life so far; one that was deleted begins anew with its next update."""

    track: int | None = None  # number, from 1; None before it is a candidate
    status: Status | None = None
    recent: int = 0  # whether the latest updates count towards confirmation, a bit each, the newest lowest
    missed: int = 0  # updates in a row with existence below the level of deletion

    @property
    def lives(self) -> bool:
        """Whether there is a track."""
        return self.status in ("candidate", "confirmed")


class Lifecycle(Model):
    """When a track begins, is confirmed and ends."""

    candidate_from: Probability = Field(0.5, description="Existence at which a track begins, as a candidate")
    confirm_from: Probability = Field(0.9, description="Existence that counts towards confirmation")
    confirm_frames: int = Field(
        3,
        ge=1,
        description="Updates with that existence that confirm a track; recorded images: at least rest_lag + 2, save of "
        "what plainly moves",
    )
    confirm_window: int | None = Field(
        None, ge=1, description="Latest updates that they are counted in; by default as many: in a row"
    )
    delete_below: Probability = Field(0.2, description="Existence that counts towards deletion")
    delete_frames: int = Field(1, ge=1, description="Updates in a row below it that delete a confirmed track")
    drop_frames: int = Field(1, ge=1, description="Updates in a row below it that delete a candidate")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.delete_below <= self.candidate_from <= self.confirm_from:
            raise ValueError("the levels must be in order: delete_below <= candidate_from <= confirm_from")
        if self.confirm_window is not None and self.confirm_window < self.confirm_frames:
            raise ValueError("confirm_window: must be at least confirm_frames, or no track is ever confirmed")
        return self

    def step(
        self, life: Life, existence: float, born: int, *, believed: bool = True, gone: bool = False
    ) -> tuple[Life, int]:
        """Return a target's life after an update, and how many tracks have been numbered by then.

        Parameters
        ----------
        life
            Before the update: ``Life()`` of a new target. A deleted track is shown once: its next step starts anew.
        existence
            After the update; of a tracker of detections, 1 with one and 0 without.
        born
            Tracks numbered so far, of all targets of the tracker.
        believed
            Whether the tracker's own tests, if it has any, speak for the target too; without it none is confirmed.
        gone
            Whether the tracker knows that the target has gone, whatever its existence.
        """
        track, status, recent, missed = life
        whole = (1 << (self.confirm_window or self.confirm_frames)) - 1
        if recent == whole and not missed and status == "confirmed" and existence >= self.confirm_from and not gone:
            return life, born
        if status == "deleted":
            track, status, recent, missed = Life()
        recent = (recent << 1 | (existence >= self.confirm_from)) & whole
        missed = missed + 1 if existence < self.delete_below else 0
        if track is None:
            if existence >= self.candidate_from and not gone:
                born += 1
                track, status = born, "candidate"
        elif gone or missed >= (self.delete_frames if status == "confirmed" else self.drop_frames):
            status = "deleted"
        if status == "candidate" and believed and recent.bit_count() >= self.confirm_frames:
            status = "confirmed"
        return Life(track, status, recent, missed), born
