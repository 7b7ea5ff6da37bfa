"""Candidate, confirmed, deleted: a track's life, read from the probability that its target exists.

Hysteresis on existence, as in integrated probabilistic data association (Musicki, Evans and Stankovic, 1994).
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Self

from pydantic import Field, model_validator

from elusive.model import Model, Probability

Status = Literal["none", "candidate", "confirmed", "deleted"]


class LifecycleState(NamedTuple):
    """The one track there is or was."""

    track: int | None  # number of the living track, from 1; None without one
    status: Status
    above: int  # frames in a row with existence at or above the confirmation level
    born: int  # tracks begun so far


class Lifecycle(Model):
    """When a track begins, is confirmed and ends."""

    candidate_from: Probability = Field(0.5, description="Existence at which a track begins, as a candidate")
    confirm_from: Probability = Field(0.9, description="Existence that counts towards confirmation")
    confirm_frames: int = Field(
        3,
        ge=1,
        description="Frames in a row with that existence that confirm a track; recorded frames: at least rest_lag + 2",
    )
    delete_below: Probability = Field(0.2, description="Existence under which a track is deleted")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.delete_below <= self.candidate_from <= self.confirm_from:
            raise ValueError("the levels must be in order: delete_below <= candidate_from <= confirm_from")
        return self

    def init(self) -> LifecycleState:
        """Return the state before the first frame: no track."""
        return LifecycleState(None, "none", 0, 0)

    def step(self, state: LifecycleState, existence: float) -> LifecycleState:
        """Return the state after a frame whose existence is given; a deleted track is shown once as such."""
        track, status, above, born = state
        if status == "deleted":
            track, status = None, "none"
        above = above + 1 if existence >= self.confirm_from else 0
        if track is None:
            if existence >= self.candidate_from:
                born += 1
                track, status = born, "candidate"
        elif existence < self.delete_below:
            status = "deleted"
        if status == "candidate" and above >= self.confirm_frames:
            status = "confirmed"
        return LifecycleState(track, status, above, born)
