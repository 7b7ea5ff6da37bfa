"""A track at one time, and what every system yields for each measurement: file and live alike."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from elusive.contracts import Array

Status = Literal["candidate", "confirmed", "deleted"]  # a deleted track is shown once as such
NOTHING: Mapping[str, float] = MappingProxyType({})


class Track(NamedTuple):
    """What is known of a target at one time."""

    track: int  # number, from 1, never used again
    status: Status
    existence: float  # posterior probability that this target is there; NaN where only a score is known
    mean: Array  # (d,) by the state names of the system
    covariance: Array  # (d, d); NaN where it is not known
    score: float = float("nan")  # what stands for existence where there is none
    extra: Mapping[str, float] = NOTHING  # what the system adds: intensity, ...


class Step(NamedTuple):
    """A measurement, the belief after it, and the tracks that the belief holds."""

    time_s: float
    measurement: Any
    state: Any
    tracks: tuple[Track, ...]
