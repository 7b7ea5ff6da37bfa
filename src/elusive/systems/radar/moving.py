"""Whether tracks move over ground or are echoes that stand, by their plots and by where plots come all along.

Interacting multiple models (Blom and Bar-Shalom, 1988, IEEE Trans. Autom. Control 33(8), 780-783): three Kalman filters
beside the tracker's own belief, which is the fourth model. What is at rest jitters where plots err, by metres a second
where the motion allows it; its velocity alone does not tell. Echoes of an islet or a shore come of one rock and then
another, for some time each: an Ornstein-Uhlenbeck process about a place. At a track's beginning the odds of rest are
the density of no velocity, known by then to before (Dickey, 1971, Ann. Math. Stat. 42(1), 204-223).

What is at rest is a ship or an echo that stands: land that no chart names, a buoy, a pier. Where it is plots come all
along (:mod:`elusive.systems.radar.ground`); a ship under way comes to places where nothing was and leaves nothing
there. How often plots come where a track's own are is therefore evidence, beside how these go on, and one posterior
says both: whether the track moves, and whether it stands.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from elusive.contracts import VX, VY, Array, X, Y
from elusive.filters.particle import _kernels
from elusive.motion import ConstantVelocity
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_hulls import HullRadar
from elusive.sensors.radar_scans import RadarScan
from elusive.systems.radar.ground_echoes import GroundEchoes
from elusive.systems.radar.ships import Ship

# of an echo at rest, of rocks about a place, a ship at rest, a steady velocity, the tracker's motion
PRIOR = np.array([0.35, 0.1, 0.05, 0.25, 0.25])
CHANGES_PER_S = np.array([1 / 3600, 1 / 3600, 1 / 3600, 1 / 300])  # of these to moving as the tracker lets it
SETTLES_PER_S = np.array([1 / 18000, 1 / 3600, 1 / 4500, 1 / 60])  # and of that to each
REST, ROCKS, STEADY, KINDS = 0, 1, 2, 3  # filters, and their number; the tracker is the last
FILTER = np.array([REST, ROCKS, REST, STEADY, KINDS])  # of each way
OF_FILTER = np.eye(KINDS + 1)[FILTER]  # (5, 4) sums ways by it
ECHOES, RESTING = slice(0, 2), slice(0, 3)  # of ways, what stands and what is at rest
CHANCE, OFTEN = 0.03, 0.05  # plots a scan that come by chance where one is, and as many as speak for no way
SCATTER_M, LASTS_S = 25.0, 10.0  # deviation of rocks about a place, on each axis, and how long one of them is seen
WANDERS, STEADY_Q = 0.01, 0.0005  # of what rests [m^2 / s]; of a steady velocity [m^2 / s^3]
ODD = 0.02  # of the tracker's density of a plot: what is less likely yet is another's plot
TINY, LEAST = 1e-300, 1e-9
PLACE, VELOCITY = [X, Y], [VX, VY]


class Ways(NamedTuple):
    """How n tracks may move."""

    share: (
        Array  # (n, 5) probabilities of an echo at rest, rocks, a ship at rest, a steady velocity, the tracker's motion
    )
    mean: Array  # (n, 3, 4) x, vx, y, vy of the first three; of rocks their middle, and how far one lies off
    covariance: Array  # (n, 3, 4, 4)

    @property
    def moves(self) -> Array:
        """Probability that each moves, ``(n,)``."""
        return np.asarray(1 - self.share[:, RESTING].sum(axis=1))

    @property
    def stands(self) -> Array:
        """Probability that each is an echo that stands, ``(n,)``, where it is known at which places plots come."""
        return np.asarray(self.share[:, ECHOES].sum(axis=1))

    def velocities(self, mean: Array, covariance: Array) -> tuple[Array, Array]:
        """Return velocities with covariances, ``(n, 2), (n, 2, 2)``, whichever way they move.

        Parameters
        ----------
        mean, covariance
            With which the tracker knows them, ``(n, 4), (n, 4, 4)``.
        """
        means = np.concatenate([self.mean, mean[:, None]], axis=1)[..., VELOCITY]
        spreads = np.concatenate([self.covariance, covariance[:, None]], axis=1)[..., [[VX], [VY]], VELOCITY]
        means[:, ROCKS] = spreads[:, ROCKS] = 0.0
        share = (self.share @ OF_FILTER)[..., None]
        off = means - (share * means).sum(axis=1, keepdims=True)
        spreads = spreads + off[..., None] * off[..., None, :]
        return (share * means).sum(axis=1), (share[..., None] * spreads).sum(axis=1)

    @classmethod
    def of(cls, mean: Array, covariance: Array, speed_sd_mps: float) -> Ways:
        """Return those of tracks that begin.

        Parameters
        ----------
        mean, covariance
            Of their states, ``(n, 4), (n, 4, 4)``.
        speed_sd_mps
            Of velocities beforehand, on each axis.
        """
        velocity, known = mean[:, VELOCITY], covariance[:, [[VX], [VY]], VELOCITY]
        odds = _densities(velocity, known) * 2 * math.pi * speed_sd_mps**2
        share = PRIOR * np.ones((len(mean), 1))
        share[:, FILTER == REST] *= odds[:, None]  # of rocks the first plots tell no velocity
        gain = np.linalg.solve(known + LEAST * np.eye(2), covariance[:, VELOCITY]).transpose(0, 2, 1)
        at_rest = mean - (gain @ velocity[..., None])[..., 0], covariance - gain @ covariance[:, VELOCITY]
        means, spreads = (
            np.stack([rest, own, own], axis=1) for rest, own in zip(at_rest, (mean, covariance), strict=True)
        )
        _among_rocks(means[:, ROCKS], spreads[:, ROCKS])
        return cls(share / share.sum(axis=1, keepdims=True), means, spreads)

    def of_rows(self, rows: Sequence[int]) -> Ways:
        """Return what is known of some."""
        return Ways(*(part[rows] for part in self))

    def put(self, rows: Sequence[int], others: Ways) -> None:
        """Replace what is known of some."""
        for part, other in zip(self, others, strict=True):
            part[rows] = other

    def predicted(self, mean: Array, covariance: Array, interval_s: float) -> Ways:
        """Move over an interval, before which the tracker knew the tracks with means and covariances."""
        leaves = -np.expm1(-interval_s * CHANGES_PER_S)
        settles = -np.expm1(-interval_s * SETTLES_PER_S.sum()) * SETTLES_PER_S / SETTLES_PER_S.sum()
        stay, come = self.share[:, :-1] * (1 - leaves), self.share[:, -1:] * settles
        on = self.share[:, -1] * (1 - settles.sum()) + self.share[:, :-1] @ leaves
        settled, spread = np.stack([mean] * KINDS, axis=1), np.stack([covariance] * KINDS, axis=1)
        settled[:, REST, VELOCITY] = spread[:, REST, VELOCITY] = spread[:, REST, :, VELOCITY] = 0.0
        _among_rocks(settled[:, ROCKS], spread[:, ROCKS])
        left, new = (part @ OF_FILTER[:-1, :KINDS] for part in (stay, come))
        fresh = (new / np.maximum(left + new, TINY))[..., None]
        off = settled - self.mean
        together = self.mean + fresh * off
        spread = self.covariance + fresh[..., None] * (spread - self.covariance)
        spread += (fresh * (1 - fresh))[..., None] * off[..., None] * off[..., None, :]
        steady = ConstantVelocity(q=STEADY_Q)
        F, noise = np.stack([steady.F(interval_s)] * KINDS), np.zeros((KINDS, 4, 4))
        stays = math.exp(-interval_s / LASTS_S)
        F[ROCKS] = np.diag([1.0, stays, 1.0, stays])
        noise[STEADY] = steady.Q(interval_s)
        noise[[[REST], [ROCKS]], PLACE, PLACE] = WANDERS * interval_s
        noise[ROCKS, VELOCITY, VELOCITY] = (1 - stays**2) * SCATTER_M**2
        return Ways(
            np.column_stack([stay + come, on]),
            (F @ together[..., None])[..., 0],
            F @ spread @ F.transpose(0, 2, 1) + noise,
        )

    def seen(self, mean: Array, covariance: Array, place: Array, error: Array, later_s: Array) -> Ways:
        """Take plots in.

        Parameters
        ----------
        mean, covariance
            With which the tracker expected the tracks, ``(n, 4), (n, 4, 4)``.
        place, error
            Of a plot of each [m], ``(n, 2)``, and how far it errs [m^2], ``(n, 2, 2)``.
        later_s
            Than the scan, each plot is, ``(n,)``.
        """
        H = np.zeros((len(mean), KINDS + 1, 2, 4))
        H[..., [0, 1], PLACE], H[..., [0, 1], VELOCITY] = 1.0, later_s[:, None, None]
        H[:, ROCKS, [0, 1], VELOCITY] = 1.0
        means = np.concatenate([self.mean, mean[:, None]], axis=1)
        spreads = np.concatenate([self.covariance, covariance[:, None]], axis=1)
        off = place[:, None] - (H @ means[..., None])[..., 0]
        wide = H @ spreads @ H.transpose(0, 1, 3, 2) + error[:, None]
        density = _densities(off, wide)
        odd = density <= ODD * density[:, KINDS:]
        share = self.share * np.maximum(density, ODD * density[:, KINDS:])[:, FILTER]
        total = share.sum(axis=1, keepdims=True)
        gain = np.linalg.solve(wide, H @ spreads).transpose(0, 1, 3, 2) * ~odd[..., None, None]
        means += (gain @ off[..., None])[..., 0]
        spreads -= gain @ H @ spreads
        return Ways(
            np.where(total > 0, share / np.maximum(total, TINY), self.share), means[:, :KINDS], spreads[:, :KINDS]
        )

    def among(self, often: Array) -> Ways:
        """Take in how many plots a scan has all along where each one's plot is, ``(n,)``."""
        share = self.share.copy()
        share[:, ECHOES] *= ((CHANCE + often) / (CHANCE + OFTEN))[:, None]
        return self._replace(share=share / share.sum(axis=1, keepdims=True))


def _among_rocks(mean: Array, covariance: Array) -> None:
    """Make of states ``(n, 4)`` and covariances ``(n, 4, 4)`` those of rocks, one of which is seen at their places."""
    mean[:, VELOCITY] = 0.0
    covariance[:, VELOCITY] = covariance[:, :, VELOCITY] = 0.0
    covariance[:, PLACE, PLACE] += SCATTER_M**2
    covariance[:, VELOCITY, VELOCITY] = SCATTER_M**2
    covariance[:, PLACE, VELOCITY] = covariance[:, VELOCITY, PLACE] = -(SCATTER_M**2)


def _densities(off: Array, covariance: Array) -> Array:
    """Gaussian densities of ``(..., 2)``, with covariances ``(..., 2, 2)``."""
    covariance = covariance + LEAST * np.eye(2)  # particles may agree
    square = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(np.exp(-0.5 * square) / (2 * math.pi * np.sqrt(np.linalg.det(covariance))))


def ways_after(
    before: Mapping[int, Ways],
    ships: Sequence[Ship],
    scan: RadarScan,
    sensor: RadarSensor,
    speed_sd_mps: float,
    echoes: GroundEchoes | None = None,
) -> dict[int, Ways]:
    """Return how tracks may move after a scan, each by its number.

    Parameters
    ----------
    before
        As far as it was known before.
    ships, scan, sensor
        What is tracked, what was seen and by what.
    speed_sd_mps
        Of velocities beforehand, on each axis.
    echoes
        Places at which plots come all along; None: these are not known, or there are none, and plots tell by
        themselves.
    """
    if not ships:
        return {}
    numbers = [ship.target.life.track or 0 for ship in ships]
    found = Ways.of(*_states((ship.target.mean, ship.target.covariance) for ship in ships), speed_sd_mps)
    known = [k for k, ship in enumerate(ships) if ship.before is not None and numbers[k] in before]
    if known:
        held = Ways(*(np.concatenate(part) for part in zip(*(before[numbers[k]] for k in known), strict=True)))
        old = _states((one.mean, one.covariance) for k in known if (one := ships[k].before))
        found.put(known, held.predicted(*old, ships[0].interval_s))
    with_plot = [k for k in known if ships[k].target.detection >= 0]
    if with_plot:
        targets = [ships[k].target for k in with_plot]
        expected = _states(_kernels.moments(target.particles, target.predicted) for target in targets)
        plots = scan.select_detections(np.array([target.detection for target in targets]))
        places, errors = sensor.places(plots)
        if isinstance(sensor, HullRadar):
            errors = errors + sensor.room(np.array([target.mean for target in targets]))
        held = found.of_rows(with_plot)
        found.put(with_plot, held.seen(*expected, places, errors, plots.times_s - scan.time_s))
    plots_of = [k for k, ship in enumerate(ships) if ship.target.detection >= 0]  # those that begin, too
    if echoes is not None and plots_of:
        often = echoes.often(scan.select_detections(np.array([ships[k].target.detection for k in plots_of])))
        found.put(plots_of, found.of_rows(plots_of).among(often))
    return {number: found.of_rows([k]) for k, number in enumerate(numbers)}


def _states(moments: Iterable[tuple[Array, Array]]) -> tuple[Array, Array]:
    """Return means and covariances of places and velocities, ``(n, 4), (n, 4, 4)``."""
    each = [(mean[:4], covariance[:4, :4]) for mean, covariance in moments]
    return np.array([mean for mean, _ in each]).reshape(-1, 4), np.array([wide for _, wide in each]).reshape(-1, 4, 4)
