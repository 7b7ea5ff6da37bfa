"""Several targets in a radar's scans: a particle filter each, and the probability that its target exists.

Integrated probabilistic data association (Musicki, Evans and Stankovic, 1994, IEEE Trans. Autom. Control 39(6),
1237-1241): after a scan the odds of existence are multiplied by the scan's ratio of target against none. Plots that
other tracks explain count as more clutter (:mod:`elusive.tracking.radar_claims`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import expit

from elusive.contracts import Array, Motion, interval_since
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.sir import ParticleFilter, ParticleState
from elusive.model import Model, NonNegative, Positive
from elusive.motion import complete
from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarScan
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.radar_claims import claims, densities, gated, take

HARDLY = 1e-9  # existence that begins no track
CERTAIN = 1 - 1e-12


class RadarTrack(NamedTuple):
    """One track after a scan."""

    life: Life  # its number, once it is a candidate, and status
    existence: float
    state: ParticleState
    before: ParticleState  # after the scan before; its own state in its first scan
    seen: RadarScan  # the plots that it may have made, with what other tracks claim of them
    begun: float  # odds of existence at its beginning


class RadarTracks(NamedTuple):
    """All tracks after a scan; a deleted one is shown once as such."""

    time_s: float  # of the scan; NaN before the first
    tracks: tuple[RadarTrack, ...]
    born: int  # numbers given so far
    filter: ParticleFilter | None  # that the tracks were stepped with, over the time since the scan before


class RadarTracker(Model):
    """When a track begins, is believed and ends, and which plots may be its own."""

    births: Positive = Field(0.1, description="Mean number of new targets a scan, as uniform in view as false alarms")
    speed_sd_mps: Positive = Field(8.0, description="Deviation of a new target's velocity, on each axis [m/s]")
    mean_life_s: Positive = Field(3600.0, description="Mean time that a target stays [s]")
    gate: Positive = Field(6.0, description="Farthest a plot may be from where its track is expected [deviations]")
    merge_within: NonNegative = Field(
        0.5, description="Two tracks that differ in place and velocity by less, root mean square, are one [deviations]"
    )
    forget_below: float = Field(
        0.2,
        gt=0,
        lt=1,
        description="A beginning is given up once its odds fall below this share of its first",
    )
    lifecycle: Lifecycle = Field(Lifecycle(), description="Levels of existence")

    def init(self) -> RadarTracks:
        """Return the state before the first scan: no track."""
        return RadarTracks(math.nan, (), 0, None)

    def step(self, tracks: RadarTracks, scan: RadarScan, flt: ParticleFilter, rng: Generator) -> RadarTracks:
        """Return the tracks after one more scan.

        Parameters
        ----------
        tracks
            After the scan before.
        scan
            Plots, or none. Without false alarms, one plot at most.
        flt
            What each track is followed with: motion, :class:`~elusive.sensors.radar.RadarSensor`, map. The prior is not
            used.
        rng
            Source of all randomness.

        Raises
        ------
        DataError
            If the scan comes before the last one, or cannot be used.
        ParameterError
            If the filter's sensor is no radar.
        """
        sensor = _radar(flt)
        scan = sensor.in_view(scan)
        interval_s = interval_since(tracks.time_s, scan.time_s)
        if not sensor.false_alarms and len(scan.range_m) > 1:
            raise DataError(
                f"scan at {scan.time_s:g} s: holds {len(scan.range_m)} plots, and without false alarms each target's "
                "track would take them all; give false_alarms, however few."
            )
        alive = [track for track in tracks.tracks if track.life.status != "deleted"]
        expected = [flt.predict(track.state, scan.time_s, rng) for track in alive]
        survival = math.exp(-interval_s / self.mean_life_s)
        existence = np.array([survival * track.existence for track in alive])
        if sensor.false_alarms:
            gates = gated(expected, scan, sensor, self.gate)
            shares = claims(densities(expected, scan, gates, sensor), existence, sensor.detection_probability)
        else:
            gates = self._only_owner(expected, existence, scan, sensor)
            shares = np.zeros(gates.shape)
        followed = []
        for number, track in enumerate(alive):
            mine = gates[number]
            seen = take(scan, mine, (shares.sum(axis=0) - shares[number]).clip(0)[mine])
            state = flt.update(expected[number], seen)
            after = self._existence(float(existence[number]), state.log_evidence, bool(sensor.false_alarms), mine)
            followed.append(track._replace(existence=after, state=state, before=track.state, seen=seen))
        kept = [track for track in self._merged(followed) if self._worth(track)]
        free = np.flatnonzero(~gates.any(axis=0) | (sensor.false_alarms > 0))
        kept += self._begun(scan, free, shares.sum(axis=0), flt, rng)
        born, aged = self._aged(kept, tracks.born)
        return RadarTracks(scan.time_s, aged, born, flt)

    def _only_owner(
        self, expected: Sequence[ParticleState], existence: Array, scan: RadarScan, sensor: RadarSensor
    ) -> NDArray[np.bool_]:
        """Tell which track made the plot where there are no false alarms: the likeliest, or none but a new target."""
        plots = len(scan.range_m)
        density = existence[:, None] * densities(expected, scan, np.ones((len(expected), plots), dtype=bool), sensor)
        owner = np.zeros(density.shape, dtype=bool)
        if len(expected) and plots:
            likeliest = int(density[:, 0].argmax())
            low, high, half = sensor.limits
            volume = 2 * half * (high - low)
            if np.isfinite(scan.doppler_mps[0]):
                volume *= 2 * (sensor.max_doppler_mps or math.inf)
            new = (1 - sensor.detection_probability) * self.births / volume
            owner[likeliest] = sensor.detection_probability * density[likeliest, 0] > new
        return owner

    def _existence(self, before: float, log_evidence: float, clutter: bool, plots: NDArray[np.bool_]) -> float:
        if not clutter and plots.any():
            return CERTAIN  # nothing else makes a plot
        if before <= 0.0 or log_evidence == -math.inf:
            return 0.0
        return min(float(expit(math.log(before) - math.log1p(-before) + log_evidence)), CERTAIN)

    def _begun(
        self, scan: RadarScan, free: NDArray[np.intp], claimed: Array, flt: ParticleFilter, rng: Generator
    ) -> list[RadarTrack]:
        """Begin a track at each plot that is water and that no other track explains."""
        sensor = _radar(flt)
        begun = []
        for plot in free:
            clutter = sensor.false_alarms * (1.0 + float(claimed[plot]))
            if self.births / (self.births + clutter) < HARDLY:
                continue
            seen = take(scan, np.arange(len(scan.range_m)) == plot)
            state = flt.replace(prior=_AboutPlot(sensor, seen, self.speed_sd_mps, flt.motion)).init(rng, scan.time_s)
            likely = self.births * state.allowed
            existence = min(likely / (likely + clutter), CERTAIN)
            if state.forbidden or existence < HARDLY:
                continue
            begun.append(RadarTrack(Life(), existence, state, state, seen, existence / (1 - existence)))
        return begun

    def _merged(self, tracks: list[RadarTrack]) -> list[RadarTrack]:
        """Leave out one of two tracks of one target: what is not confirmed, else the younger."""
        if len(tracks) < 2:
            return tracks
        # a difference along an axis alone is never greater than that in all components: few pairs are left to look at
        means = np.array([track.state.mean[:4] for track in tracks])
        variances = np.array([np.diag(track.state.covariance)[:4] for track in tracks])
        squares = (means[:, None] - means) ** 2
        close = (squares <= 4 * self.merge_within**2 * (variances[:, None] + variances)).all(axis=-1)
        kept: list[int] = []
        for number in sorted(range(len(tracks)), key=lambda number: tracks[number].life.status != "confirmed"):
            state, near = tracks[number].state, [other for other in kept if close[number, other]]
            if all(_apart(state, tracks[other].state) >= self.merge_within for other in near):
                kept.append(number)
        return [tracks[number] for number in sorted(kept)]

    def _worth(self, track: RadarTrack) -> bool:
        """Whether a beginning is still worth following; a numbered track is judged by its life."""
        odds = track.existence / (1 - track.existence)
        return track.life.track is not None or odds >= self.forget_below * track.begun

    def _aged(self, tracks: Sequence[RadarTrack], born: int) -> tuple[int, tuple[RadarTrack, ...]]:
        """Judge each track by its existence, and number new candidates."""
        aged = []
        for track in tracks:
            life, born = self.lifecycle.step(track.life, track.existence, born)
            aged.append(track._replace(life=life))
        return born, tuple(aged)


def _radar(flt: ParticleFilter) -> RadarSensor:
    if not isinstance(flt.sensor, RadarSensor):
        raise ParameterError(f"filter: its sensor is a {type(flt.sensor).__name__}; give it a RadarSensor.")
    return flt.sensor


class _AboutPlot(NamedTuple):
    """The belief of what a plot alone says, for any motion."""

    sensor: RadarSensor
    scan: RadarScan
    speed_sd_mps: float
    motion: Motion

    def sample(self, n: int, rng: Generator) -> Array:
        return complete(self.motion, self.sensor.draw_births(self.scan, n, rng, self.speed_sd_mps), rng)


def _apart(first: ParticleState, second: ParticleState) -> float:
    """Root mean square difference of place and velocity of two beliefs, in their deviations."""
    off = first.mean[:4] - second.mean[:4]
    total = (first.covariance + second.covariance)[:4, :4]
    return math.sqrt(max(0.0, float(off @ np.linalg.lstsq(total, off)[0])) / 4)
