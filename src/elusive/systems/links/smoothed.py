"""A recorded log's tracks, given what came later too: Rauch, Tung and Striebel's smoother over the filter's beliefs.

The particles' moments go backwards by those of the walk. Where readings err alike, they do so for seconds, so that what
came later is hardly new: of the covariance that the smoother takes away, it takes as little as the site errs alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.filters.gaussian.kalman import smoothed
from elusive.filters.gaussian.moments import Moved
from elusive.motion.walk import Walk
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.track import LinkTracking, track
from elusive.tracking.track import Step, Track


class _Belief(NamedTuple):
    """A track's belief in a frame."""

    number: int  # of the frame
    time_s: float
    mean: Array  # (4,)
    covariance: Array  # (4, 4)
    alike: float  # how far readings err alike, 0 to 1


class _Walking(NamedTuple):
    """The walk as a filter's motion."""

    walk: Walk

    def moved(self, mean: Array, covariance: Array, interval_s: float) -> Moved:
        F, Q = self.walk.moments(interval_s)
        return Moved(F @ mean, F, Q)


def track_smoothed(frames: Iterable[RssFrame], nodes: RadioNodes, parameters: LinkTracking) -> Iterator[Step]:
    """Track people through a log that can be read twice; yield its steps with smoothed tracks.

    Parameters
    ----------
    frames, nodes, parameters
        As for :func:`~elusive.systems.links.track.track`, straight on the links.

    Raises
    ------
    DataError
        If a frame cannot be used, or the calibration takes all frames.
    """
    assert isinstance(parameters.method, LinksMethod)
    beliefs: dict[int, list[_Belief]] = {}
    for number, step in enumerate(track(frames, nodes, parameters)):
        alike = 0.0 if step.state.calibrating else min(step.state.people.likeness.misfit, 1.0)
        for one in step.tracks:
            if one.status != "deleted":
                belief = _Belief(number, step.time_s, one.mean, one.covariance, alike)
                beliefs.setdefault(one.track, []).append(belief)
    walking = _Walking(parameters.method.walk)
    later = {
        (after.number, name): (after.mean, after.covariance + after.alike * (before.covariance - after.covariance))
        for name, path in beliefs.items()
        for before, after in zip(path, smoothed(walking, path), strict=True)
    }
    for number, step in enumerate(track(frames, nodes, parameters)):
        yield step._replace(tracks=tuple(_at(one, later.get((number, one.track))) for one in step.tracks))


def _at(one: Track, known: tuple[Array, Array] | None) -> Track:
    return one if known is None else one._replace(mean=known[0], covariance=np.asarray(known[1]))
