"""Points of white frames that no track explains: what the filter was told not to expect."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy import ndimage
from scipy.special import ndtri

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.sensors import ImageSensor

FALSE_POINTS, FRAMES = 0.5, 1000  # of noise, over so many frames
PIXELS = 256 * 256  # of a frame; of a larger one every so-many-th is looked at
NEAR = 4.0  # point spreads from a track within which it explains a point
LEAST, SHARE = 6, 0.4  # points left over, and their share of all, from which they are no chance


class LeftOver:
    """Counts points well above the noise, near tracks and away from all of them.

    Parameters
    ----------
    sensor
        Bound to the frames' size, of Gaussian noise.
    """

    def __init__(self, sensor: ImageSensor) -> None:
        self._width_px, self._sigma = sensor.spread_px, sensor.noise_sigma
        pixels = sensor.rows * sensor.columns
        self._every, self._count = 1 + pixels // PIXELS, 0
        self._level = float(-ndtri(FALSE_POINTS / (pixels * FRAMES)))
        reach = int(4 * self._width_px + 0.5) + 1
        impulse = np.zeros(2 * reach + 1)
        impulse[reach] = 1.0
        kernel = ndimage.gaussian_filter1d(impulse, self._width_px)
        self._deviation = float(kernel @ kernel)  # of white noise of deviation one, filtered both ways
        self.explained = self.left = 0

    def add(self, frame: Array, places: Iterable[tuple[float, float]]) -> None:
        """Take a frame about zero, and where tracks are, x, y."""
        self._count += 1
        if (self._count - 1) % self._every:
            return
        response = ndimage.gaussian_filter(np.nan_to_num(frame), self._width_px, mode="constant")
        response /= self._deviation * self._sigma
        tops = (response > self._level) & (response == ndimage.maximum_filter(response, 2 * int(NEAR) + 1))
        points, tracks = np.argwhere(tops)[:, ::-1], np.array(list(places)).reshape(-1, 2)
        away = np.linalg.norm(points[:, None] - tracks[None], axis=2).min(axis=1, initial=np.inf)
        near = int(np.sum(away < NEAR * max(self._width_px, 1.0)))
        self.explained, self.left = self.explained + near, self.left + len(points) - near

    def finding(self, *, grave: bool) -> Finding:
        """Return what is left over; grave where every target was to be followed."""
        seen = self.explained + self.left
        share = self.left / seen if seen else 0.0
        return Fact(0.0, share, self.left < LEAST or share < SHARE, seen).finding(
            "targets.left-over",
            f"{self.left} of {seen} points that stand out of the noise are far from every track: what is there is not "
            "as bright, as wide, as fast or as few as was told, and is not followed.",
            "Leave out --snr-db, or give what elusive fit images finds; a greater --max-speed; --filter several.",
            grave=grave,
        )
