"""Keeps images and particle clouds for the report of a log of unknown length: evenly over time, in bounded memory."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from elusive.contracts import Array
from elusive.systems.links.report.contents import Scene

SCENES_AT_MOST = 480
VOXELS_AT_MOST = 4_000_000  # of all images together, a byte each
PARTICLES_AT_MOST = 100_000  # of all clouds together
PARTICLES_SHOWN = 150  # of a cloud


class SceneKeeper:
    """Keeps what the report draws beneath the tracks.

    Each frame is given by :meth:`offer`. When it is too much, every second frame kept is dropped, and from then on as
    many are passed over.

    Parameters
    ----------
    scenes, voxels, particles
        How many are kept at most.
    """

    def __init__(
        self,
        *,
        scenes: int = SCENES_AT_MOST,
        voxels: int = VOXELS_AT_MOST,
        particles: int = PARTICLES_AT_MOST,
    ) -> None:
        self._most = scenes, voxels, particles
        self._every = 1
        self._offered = 0
        self._kept: list[tuple[int, Scene]] = []

    def offer(self, time_s: float, image: Array | None, clouds: Mapping[int, Array]) -> None:
        """Take a frame's image ``(V,)``, and the particles ``(N, 2)`` of equal weight of each track [m]."""
        number = self._offered
        self._offered += 1
        if number % self._every:
            return
        few = max(1, min(PARTICLES_SHOWN, self._most[2] // max(1, len(clouds))))
        shown = dict(sorted(clouds.items())[: self._most[2]])
        thinned = {track: _evenly(cloud, few) for track, cloud in shown.items()}
        peak = 0.0 if image is None or not image.size else max(0.0, float(image.max()))
        grey = None
        if image is not None:
            grey = np.round(np.clip(image / peak if peak else 0.0 * image, 0.0, 1.0) * 255.0).astype(np.uint8)
        self._kept.append((number, Scene(time_s, grey, peak, thinned)))
        while len(self._kept) > 1 and self._is_full():
            self._every *= 2
            self._kept = [one for one in self._kept if one[0] % self._every == 0]

    def _is_full(self) -> bool:
        scenes = self.scenes
        voxels = sum(0 if one.image is None else one.image.size for one in scenes)
        particles = sum(len(cloud) for one in scenes for cloud in one.clouds.values())
        return any(held > most for held, most in zip((len(scenes), voxels, particles), self._most, strict=True))

    @property
    def scenes(self) -> list[Scene]:
        """What was kept, in order of time."""
        return [scene for _, scene in self._kept]


def _evenly(cloud: Array, most: int) -> Array:
    """Return so many particles at most, each so-many-th: the reported numbers stay as they are."""
    # a view would keep all of them
    chosen: Array = cloud[:: max(1, math.ceil(len(cloud) / most))].copy()
    return chosen
