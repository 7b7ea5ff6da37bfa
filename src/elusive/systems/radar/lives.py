"""Clutter that lasts: tracks that live as briefly as groups of waves, rain and wakes do are told as what they may be.

No false alarm alone makes a track, but waves come in groups that last for scans. Of lives that end at a constant rate,
some ships' and some far shorter, how many are of each kind, and how long the short ones are, is found by expectation
maximisation, those that have not ended being censored (Farewell, 1982, The use of mixture models for the analysis of
survival data with long-term survivors). Where others begin nearby more often than by chance, lives go on: ships turn
harder than the motion allows. A track is then a ship's by how long it has lived, by how many of the others came at its
range, and by whether it moves as they do: crests and rain go with the wind.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.contracts import Array, X, Y
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.range_bands import BANDS, edges
from elusive.systems.radar.company import REACH_M, SCANS
from elusive.systems.radar.moving import Ways
from elusive.systems.radar.recorded import DRIFT
from elusive.tracking.detection_targets import Target
from elusive.tracking.track import Track

SHIP, LONGEST = 1000.0, 10.0  # scans that a ship's track lives in the mean, and that clutter's does at most
ERRORS = 3.0  # of the number of short ones, by which chance is more
LATEST, ROUNDS = 400, 30  # tracks that are looked at
SHIPS_MPS, SLOWEST_MPS = 8.0, 0.3  # deviation of a ship's velocity on each axis, and of what moves alike, at least
LEAST = 1e-9
KNOWN, SURE = 0.9, 0.9  # existence from which a miss is one; probability of a ship from which its track is confirmed

NOTHING: Mapping[int, float] = {}
Ages = Mapping[int, tuple[int, int]]  # of each confirmed track: scans since then, and the band in which it was


def aged(before: Ages, targets: Sequence[Target], scan: RadarScan, sensor: RadarSensor) -> Ages:
    """Return how old confirmed tracks are after a scan."""
    limits = edges(*sensor.limits[:2], BANDS)[1:-1]
    found = dict[int, tuple[int, int]]()
    for target in targets:
        number = target.life.track or 0
        if target.life.status == "confirmed":
            away = target.mean[[X, Y]] - np.array([scan.own.x_m + sensor.x_m, scan.own.y_m + sensor.y_m])
            scans, band = before.get(number, (-1, int(np.searchsorted(limits, math.hypot(*away)))))
            found[number] = scans + 1, band
    return found


def as_lived(
    tracks: Sequence[Track], ages: Ages, lives: Sequence[float], ways: Mapping[int, Ways]
) -> tuple[Track, ...]:
    """Return tracks, of which those that may be clutter that lasts exist less surely, and are candidates at most.

    They are known by ``lives`` of :func:`short_lives`, by their ages, and by the ways in which they may move.
    """
    found = []
    for track in tracks:
        if lives and track.track in ages:
            scans, band = ages[track.track]
            law, (mean, *ratio) = Drift(*lives[:DRIFT]), lives[DRIFT:]
            velocity = ways[track.track].velocities(track.mean[None, :4], track.covariance[None, :4, :4])
            ship = 1 / (1 + ratio[band] * math.exp(-scans / mean) * float(law.ratios(*velocity)[0]))
            status = track.status if ship > SURE else "candidate"
            track = track._replace(status=status, existence=ship * track.existence)
        found.append(track)
    return tuple(found)


def lasting_finding(lives: Sequence[float]) -> Finding:
    """Say whether clutter lasts."""
    scans, most = (lives[DRIFT], max(lives[DRIFT + 1 :])) if lives else (0.0, 0.0)
    return Finding(
        "radar.lasting", not lives, 0.0, most,
        f"Tracks that live {scans:.2g} scans on the mean are as many as {most:.2g} to one of a ship at their range: "
        "groups of waves, rain or wakes. Young tracks there are candidates, and some older ones may be of no ship.",
        "Turn the radar's sea or rain clutter control up, or leave those plots out.", grave=False,
    )  # fmt: skip


class Drift(NamedTuple):
    """How clutter that lasts moves: most of it with one velocity, as crests and rain do, and the rest as ships."""

    x_mps: float = 0.0
    y_mps: float = 0.0
    sd_mps: float = SHIPS_MPS
    others: float = 0.5  # share of the rest

    def ratios(self, velocity: Array, covariance: Array) -> Array:
        """Density of velocities ``(n, 2)``, known with covariances, of clutter to that of ships, ``(n,)``."""
        return self.others + (1 - self.others) * self._alike(velocity, covariance)

    def _alike(self, velocity: Array, covariance: Array) -> Array:
        """Of what moves alike."""
        densities = []
        for off, sd in ((velocity - np.array(self[:2]), self.sd_mps), (velocity, SHIPS_MPS)):
            spread = covariance + sd**2 * np.eye(2)
            square = np.einsum("ni,ni->n", off, np.linalg.solve(spread, off[..., None])[..., 0])
            densities.append(np.exp(-0.5 * square) / np.sqrt(np.linalg.det(spread)))
        return np.asarray(densities[0] / np.maximum(densities[1], LEAST))

    def fitted(self, velocity: Array, covariance: Array, short: Array) -> Drift:
        """Return the law that fits better to velocities, each of clutter with a probability."""
        alike = (1 - self.others) * self._alike(velocity, covariance)
        weight = short * alike / (alike + self.others)
        total = max(float(weight.sum()), LEAST)
        middle: Array = weight @ velocity / total
        own = float(weight @ ((velocity - middle) ** 2 - covariance[:, [0, 1], [0, 1]]).sum(axis=1)) / (2 * total)
        others = (float(short.sum()) - total + 1) / (float(short.sum()) + 2)
        return Drift(float(middle[0]), float(middle[1]), math.sqrt(max(own, SLOWEST_MPS**2)), others)


class Lives:
    """How long tracks lived, and how often they were seen.

    Parameters
    ----------
    fade
        Of what was seen, from scan to scan.
    """

    def __init__(self, fade: float) -> None:
        self._fade = fade
        self._scan = 0
        # band, scans of life, whether it ended; hits and trials of late; scan and place, first and last; velocity
        self._each = dict[int, Array]()

    def add(
        self, ages: Ages, targets: Sequence[Target], ways: Mapping[int, Ways], stands: Mapping[int, float] = NOTHING
    ) -> None:
        """Take a scan in.

        Parameters
        ----------
        ages
            How old confirmed tracks are.
        targets
            Where the radar looks.
        ways
            How they may move.
        stands
            Probability that each is an echo that stands, which is seen as often as it likes; none: 0.
        """
        self._scan += 1
        for row in self._each.values():
            row[3:5] *= self._fade
        for target in targets:
            number = target.life.track or 0
            if number in ages:
                scans, band = ages[number]
                now = self._scan, *target.mean[[X, Y]]
                row = self._each.setdefault(number, np.array([band, 0.0, 0.0, 0.0, 0.0, *now, *now, *np.zeros(6)]))
                row[1], row[8:11] = scans + 1, now
                velocity, known = ways[number].velocities(target.mean[None, :4], target.covariance[None, :4, :4])
                row[11:13], row[13:] = velocity[0], known.ravel()
                if target.existence > KNOWN:
                    row[3:5] += (1 - stands.get(number, 0.0)) * np.array([target.detection >= 0, 1])
            elif target.life.status == "deleted" and number in self._each:
                self._each[number][2] = 1.0
        while len(self._each) > LATEST:
            del self._each[next(iter(self._each))]

    def sorted_out(self, *, every: bool) -> tuple[float, float, tuple[float, ...]]:
        """Return the probability of detection of ships, of how many scans it is known, and :func:`short_lives`.

        ``every`` track is taken for a ship's where they are tracked with another probability of detection than
        theirs: ships that are lost live as briefly as clutter.
        """
        rows = np.array([*self._each.values()]).reshape(-1, 17)
        band, scans, ended, hits, trials = rows.T[:5]
        ended = ended * (1 - gone_on(rows[:, 5:8], rows[:, 8:11]))
        moved = rows[:, 11:13], rows[:, 13:].reshape(-1, 2, 2)
        lives, short = short_lives(band.astype(np.int64), scans, ended, *moved)
        ships = np.ones(len(band)) if every else 1 - short
        return float((ships @ hits + 1) / (ships @ trials + 2)), float(ships @ trials), lives


def gone_on(first: Array, last: Array) -> Array:
    """Return the probabilities that lives have gone on as others, ``(n,)``.

    Parameters
    ----------
    first, last
        Scan and place [m] of each, ``(n, 3)``. How often others begin nearby by chance is seen by those long after.
    """
    late = first[:, 0] - last[:, None, 0]
    near = np.hypot(*(first[:, 1:] - last[:, None, 1:]).transpose(2, 0, 1)) < REACH_M
    np.fill_diagonal(near, val=False)
    soon = (near & (np.abs(late) <= SCANS)).any(axis=1)
    chance = (near & (late > SCANS) & (late <= 3 * SCANS)).any(axis=1)
    seen = last[:, 0] <= last[:, 0].max(initial=0) - 3 * SCANS  # for as long
    found: Array = soon * max(1 - float(chance @ seen) / max(float(soon @ seen), 1.0), 0.0)
    return found


def short_lives(
    band: NDArray[np.int64], scans: Array, ended: Array, velocity: Array, covariance: Array
) -> tuple[tuple[float, ...], Array]:
    """Tell lives of clutter from those of ships.

    Parameters
    ----------
    band
        Of range, in which each track began, ``(n,)``.
    scans
        That it has lived, ``(n,)``.
    ended
        Whether it has ended, 1 or 0, ``(n,)``.
    velocity, covariance
        With which it moved last [m/s], ``(n, 2), (n, 2, 2)``.

    Returns
    -------
    tuple
        :class:`Drift`, how many scans short lives last, and how many of them come to a ship's in each band; nothing
        where there are no more than chance makes of ships'. And of each life the probability that it is a short one,
        ``(n,)``.
    """
    count, ratio, mean = np.bincount(band, minlength=BANDS), np.ones(BANDS), LONGEST
    drift = Drift(others=1.0)  # first by age alone: ships in company move alike, too

    def probability() -> Array:
        odds = ratio[band] * drift.ratios(velocity, covariance)
        odds *= (SHIP / mean) ** ended * np.exp(-scans * (1 / mean - 1 / SHIP))
        return np.asarray(odds / (1 + odds))

    for known in range(2 * ROUNDS):
        short = probability()
        mean = min(max(float(short @ scans) / max(float(short @ ended), 1.0), 1.0), LONGEST)
        number = np.bincount(band, short, BANDS)
        ratio = (number + 0.5) / (count - number + 0.5)
        beyond_chance = max(1 - ERRORS / math.sqrt(max(float(number.sum()), 1.0)), 0.0)
        if known == ROUNDS and not beyond_chance:
            break
        if known >= ROUNDS:
            drift = (drift if known > ROUNDS else Drift()).fitted(velocity, covariance, short)
    ratio = beyond_chance * number / (count - number + 1)
    return (*drift, mean, *ratio.tolist()) if beyond_chance else (), probability()
