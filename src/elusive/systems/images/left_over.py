"""Points of white frames against tracks: far from all, beside the one that has them, or wider than was told."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.preprocess.points import PointFinder, responses_of, single_width_of
from elusive.sensors import ImageSensor

FRAMES = 1000  # in which noise may make half a point
PIXELS = 256 * 256  # of a frame; of a larger one every so-many-th is looked at
NEAR = 4.0  # point spreads from a track within which it explains a point
LEAST, SHARE = 6, 0.4  # points left over, and their share of all, from which they are no chance
BESIDE, PIXEL = (
    4.0,
    0.1,
)  # deviations of a point's place within which a track is at it, and what is not known of a pixel
ASTRAY = 0.2  # share of points beside whose place their track is; e^-8 of them by chance
ENOUGH, WIDER = 12, 1.35  # points that tell a width, and how many times that told it may be, or that this
WIDEST = 1.7  # ... from which a target is several, or its place wrong: nearer, some of its evidence is lost


class LeftOver:
    """Counts points well above the noise: away from all tracks, near one, and beside where that has them.

    Parameters
    ----------
    sensor
        Bound to the frames' size, of Gaussian noise.
    """

    def __init__(self, sensor: ImageSensor) -> None:
        self._width_px, self._sigma = sensor.spread_px, sensor.noise_sigma
        pixels = sensor.rows * sensor.columns
        self._every, self._count = 1 + pixels // PIXELS, 0
        self._finder = PointFinder(pixels * FRAMES)
        self.explained = self.left = self.beside = 0
        self._off_px: list[float] = []

    def add(self, frame: Array, places: Iterable[tuple[float, float]]) -> None:
        """Take a frame about zero, and where tracks are, x, y."""
        self._count += 1
        if (self._count - 1) % self._every:
            return
        found, tracks = self._finder.add(frame / self._sigma), np.array(list(places)).reshape(1, -1, 2)
        points, deviation_px = found.places_px[found.bright], found.deviation_px[found.bright]
        away = np.linalg.norm(points[:, None] - tracks, axis=2).min(axis=1, initial=np.inf)
        near = away < NEAR * max(self._width_px, 1.0)
        astray = near & (away > BESIDE * np.hypot(deviation_px, PIXEL))
        self._off_px += away[astray].tolist()
        self.beside += int(astray.sum())
        self.explained, self.left = self.explained + int(near.sum()), self.left + int((~near).sum())

    def findings(self, *, grave: bool) -> list[Finding]:
        """Return what is left over, grave where every target was to be followed, how wide points are, and their tracks.

        Tracks are beside points that are wider than was told, too, and of these that is said alone.
        """
        wide = self._wide()
        return [self._left(grave=grave), wide, *([self._beside()] if wide.holds else [])]

    def _wide(self) -> Finding:
        points = self._finder.points
        bright = points._replace(patches=points.patches[points.bright])
        count = len(bright.patches)
        seen_px = single_width_of(responses_of(bright)) if count >= ENOUGH else math.nan
        ratio = seen_px / self._width_px
        far = ratio > WIDEST or ratio < 1 / WIDEST
        what = "some of their evidence is lost"
        if far:
            what = (
                "one target is taken for several" if ratio > 1 else "places are surer, or less sure, than they can be"
            )
        return Fact(self._width_px, seen_px, not (ratio > WIDER or ratio < 1 / WIDER), count).finding(
            "targets.spread",
            f"Points are {seen_px:.2g} px wide, as {count} of them say that stand out of the noise, where "
            f"{self._width_px:g} was told: {what}.",
            f"Give --psf-sigma {seen_px:.2g}.",
            grave=far,
        )

    def _beside(self) -> Finding:
        share = self.beside / self.explained if self.explained else 0.0
        off_px = float(np.median(self._off_px)) if self._off_px else math.nan
        return Fact(0.0, share, self.beside < LEAST or share < ASTRAY, self.explained).finding(
            "targets.beside",
            f"{self.beside} of {self.explained} points that stand out of the noise are beside the track that has them, "
            f"{off_px:.2g} px off where they are, {BESIDE:g} deviations and more: targets turn more strongly than was "
            "told, and what tracks say of their places is too sure.",
            "Give a greater --q: leave it out, and a recording's own is found, as elusive fit images does.",
        )

    def _left(self, *, grave: bool) -> Finding:
        seen = self.explained + self.left
        share = self.left / seen if seen else 0.0
        return Fact(0.0, share, self.left < LEAST or share < SHARE, seen).finding(
            "targets.left-over",
            f"{self.left} of {seen} points that stand out of the noise are far from every track: what is there is not "
            "as bright, as wide, as fast or as few as was told, and is not followed.",
            "Leave out --snr-db, or give what elusive fit images finds; a greater --max-speed; --filter several.",
            grave=grave,
        )
