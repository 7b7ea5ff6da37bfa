"""A target of the tracker of detections: moved to a scan's time, updated by what the scan says.

Williams (2015), IEEE Trans. Aerosp. Electron. Syst. 51(3), 1664-1687, section IV, with particles. What is known of
places is evidence as a measurement is: the probability that it allows the target is part of that it exists.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array, DetectionSensor, Knowledge, Motion
from elusive.errors import DataError
from elusive.filters.particle import _kernels, _particle_kernels
from elusive.filters.particle.informed import smoothed
from elusive.filters.particle.parts import a_number_a_state, allowed_by
from elusive.filters.particle.resampling import resample
from elusive.motion import transition
from elusive.tracking._detection_kernels import explanations
from elusive.tracking.fixed_echoes import EchoEvidence, FixedEcho, NewEchoes, echo_after, echo_evidence
from elusive.tracking.lifecycle import Life

LEAST_KURTOSIS = 1.3  # of a belief of one mode: a line has 1.8, a Gaussian 3, two places 1
CERTAIN = 1 - 1e-12  # existence, at most: a target may always have just gone


class Pair(NamedTuple):
    """A target's part in a pair: their particles are samples of one joint belief, row by row, of one weight each."""

    track: int  # number of the other's
    quiet: int  # scans since they contested a detection


class Target(NamedTuple):
    """A target after a scan."""

    life: Life  # its track's number, once it is a candidate, and status
    existence: float  # posterior probability that it is there
    particles: Array  # (N, d) given that it is
    weights: Array  # (N,) summing to one
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    predicted: Array  # (N,) weights before the scan
    detection: int  # that it most likely made; -1: none
    log_odds: float  # by how much the scan and what is known changed those of existence
    allowed: float  # P(what is known allows it) before the scan
    forbidden: bool  # what is known forbade what was measured, and was left out of the scan
    least_odds: float  # of existence, below which it is given up before it is a candidate
    echo: FixedEcho | None = None  # what it is if it is fixed and no target; their existences add up to one at most
    pair: Pair | None = None  # with another that it contests detections with


class Expected(NamedTuple):
    """A target at the time of a scan, before it."""

    target: Target  # after the scan before
    existence: float
    particles: Array  # (N, d)
    weights: Array  # (N,)
    mean: Array  # (d,)
    covariance: Array  # (d, d)
    allowed: Array | None  # (N,) probability that each is where a target can be; None: nothing is asked

    @classmethod
    def at_rest(cls, target: Target) -> Expected:
        """Return a target over no time: it stays as it is, and what is known of places is not asked again."""
        return cls(target, target.existence, target.particles, target.weights, target.mean, target.covariance, None)


class Evidence(NamedTuple):
    """What a scan says of a target, detection by detection."""

    existence: float  # before the scan, under what is known
    weights: Array  # (N,) before the scan, under what is known
    allowed: float
    forbidden: bool
    which: NDArray[np.int64]  # (k,) detections within reach
    likely: Array  # (k + 1, N) likelihood of each particle: missed, and each detection, but for a scale
    total: Array  # (k + 1,) of the likelihoods under the weights
    scale: Array  # (k + 1,) logarithms of the scales
    echo: EchoEvidence | None = None  # of what it is if it is fixed and no target

    @property
    def log_missed(self) -> float:
        """Logarithm of the probability that nothing is there or it was missed."""
        missed = self.existence * float(self.total[0])
        if self.echo is None:
            return math.log(1 - self.existence + missed)
        absent = max(1 - self.existence - self.echo.existence, 1 - CERTAIN)
        return math.log(absent + missed + self.echo.existence * self.echo.missed)

    @property
    def log_made_itself(self) -> Array:
        """Logarithms of the densities that the target is there and made each detection, ``(k,)``."""
        with np.errstate(divide="ignore"):
            made: Array = np.log(self.total[1:]) + self.scale[1:]
            return made + math.log(self.existence) if self.existence > 0 else np.full_like(made, -math.inf)

    @property
    def log_made(self) -> Array:
        """Logarithms of the densities that it or its echo is there and made each detection, ``(k,)``."""
        made = self.log_made_itself
        return made if self.echo is None else np.logaddexp(made, self.echo.log_made)


def expected(
    target: Target,
    motion: Motion,
    interval_s: float,
    survival: float,
    known: Sequence[Knowledge],
    n: int,
    resample_below: float,
    kernel_width: float,
    rng: Generator,
) -> Expected:
    """Move a target over an interval, and ask what is known of its places; over no time it stays as it is.

    A track has ``n`` particles; what is none yet keeps those that it began with.

    Where it is resampled, particles are drawn from kernels about those that are left, so many times as wide as
    Silverman's rule has them for as many as count: Musso, Oudjane and Le Gland (2001). Copies alone, of few ancestors
    where the motion has little noise, have too small a covariance: NEES 3.1 of 2 with 1000 particles, 2.2 so. Copies
    stay where the belief is of several places, or its motion not linear: a component may be a choice, as at anchor.
    """
    particles, weights, allowed, before = target.particles, target.weights, None, len(target.weights)
    if interval_s == 0:
        return Expected.at_rest(target)
    n = before if target.life.track is None else n
    if n > before or _particle_kernels.effective_size(weights) < resample_below * n:
        if kernel_width and transition(motion, interval_s) is not None and has_one_mode(target):
            counting = _particle_kernels.effective_size(weights)
            particles = smoothed(particles, weights, n, kernel_of(kernel_width, particles.shape[1], counting), rng)
        else:
            particles = _kernels.gather(particles, resample(weights, n, rng), n)
        weights = np.full(n, 1 / n)
    particles = motion.propagate(particles, interval_s, rng)
    if known:
        allowed = np.exp(allowed_by(known, particles))
    moments = _kernels.moments(particles, weights)
    return Expected(target, survival * target.existence, particles, weights, *moments, allowed)


def kernel_of(times: float, components: int, counting: float) -> float:
    """Width of a kernel about particles, in the cloud's deviations: so many times Silverman's for as many as count."""
    return min(times * math.pow(4 / ((components + 2) * counting), 1 / (components + 4)), 1.0)


def has_one_mode(target: Target) -> bool:
    """Tell a belief of one mode by the kurtosis along the axes of its ellipsoid."""
    return bool((kurtosis(target) > LEAST_KURTOSIS).all())


def kurtosis(cloud: Target | Expected) -> Array:
    """Kurtosis along the axes of a cloud's ellipsoid, ``(d,)``; zero where that is flat."""
    squares, axes = np.linalg.eigh(cloud.covariance)
    if squares[0] <= 0:
        return np.zeros(len(squares))
    off = ((cloud.particles - cloud.mean) @ (axes / np.sqrt(squares))) ** 2
    return np.asarray(cloud.weights @ (off * off))  # a power of four takes ten times as long


def evidence(
    one: Expected,
    sensor: DetectionSensor,
    measurement: Any | None,
    which: NDArray[np.int64],
    log_new: Array,
    least_allowed: float,
    echo: tuple[float, Array] | None = None,
) -> Evidence:
    """Ask what each detection within reach says of each particle, and whether what is known can stand beside it.

    Parameters
    ----------
    one
        The target before the scan.
    sensor, measurement
        What reports the detections; without a measurement (``None``) nothing is missed either.
    which
        ``(k,)`` detections within reach.
    log_new
        ``(k,)`` logarithm of the intensity of each detection, if it is not this target's.
    least_allowed
        Knowledge that allows what is measured with no more than this probability is left out.
    echo
        Probability that the target's echo is detected, and the log density of each detection as its, ``(k,)``.

    Raises
    ------
    DataError
        If the sensor or what is known does not give one number a state, or gives NaN or plus infinity.
    """
    n, k = len(one.weights), len(which)
    if measurement is None:
        likely, scale = np.ones((1, n)), np.zeros(1)
    else:
        detected = a_number_a_state(
            sensor.detection_probabilities(one.particles, measurement), one.particles, "detection_probabilities"
        )
        log_densities = sensor.log_densities(one.particles, measurement, which) if k else np.empty((n, 0))
        if log_densities.shape != (n, k):
            raise DataError(
                f"log_densities: gave an array of shape {log_densities.shape} for {n} states and {k} detections; give "
                "a row a state and a column a detection."
            )
        likely, scale = explanations(log_densities, detected)
    weights, existence, allowed, forbidden = one.weights, one.existence, 1.0, False
    total = likely @ weights
    if one.allowed is not None:
        under = weights * one.allowed
        joint, allowed = likely @ under, float(under.sum())
        with np.errstate(divide="ignore", over="ignore"):
            share = np.exp(np.minimum(scale - np.concatenate([[0.0], log_new]), 600.0))
        forbidden = bool(share @ joint <= least_allowed * (share @ total))
        if not forbidden:
            weights, total, odds = under / allowed, joint / allowed, allowed
        else:  # that a map is wrong altogether is paid for once
            odds = 1.0 if one.target.forbidden else least_allowed
        existence = existence * odds / (1 - existence + existence * odds)
    its_echo = None
    if echo is not None and one.target.echo is not None:
        others = (1 - existence) / (1 - one.existence)  # what speaks against the target speaks for the rest
        its_echo = echo_evidence(one.target.echo.existence * others, *echo)
    if not (math.isfinite(total.sum()) and scale.max() < math.inf):
        raise DataError(
            "log_densities, detection_probabilities or log_probability: is NaN or plus infinity for some state; check "
            "the sensor and what is known."
        )
    return Evidence(existence, weights, allowed, forbidden, which, likely, total, scale, its_echo)


def after_scan(
    one: Expected, found: Evidence, made: Array, missed: float, new: NewEchoes | None = None,
    joint: tuple[Array, Pair] | None = None,
) -> Target:  # fmt: skip
    """Return the target, the probabilities known that it made each detection, ``(k,)``, and that it made none.

    Where it may be a fixed echo, ``new`` says where the detections are; of a pair, ``joint`` are its weights and it.
    """
    absent = missed * math.exp(-found.log_missed)
    gone_unseen, echo = absent * found.existence * float(found.total[0]), one.target.echo
    if echo is not None and found.echo is not None and new is not None:
        with np.errstate(invalid="ignore"):
            fixed = np.nan_to_num(np.exp(found.echo.log_made - found.log_made))
        unseen = absent * found.echo.existence * found.echo.missed
        echo, made = echo_after(echo, unseen, made * fixed, new, found.which), made * (1 - fixed)
    shares = np.concatenate([[gone_unseen], made])
    existence = float(shares.sum())
    weights = found.weights if joint is None else joint[0]
    # missed wherever it is: it stays as it was
    alike = len(shares) == 1 and weights is one.weights and found.likely.min() == found.likely.max()
    if existence > 0 and joint is None and not alike:
        factors = np.zeros(len(shares))
        np.divide(shares, existence * found.total, out=factors, where=shares > 0)
        weights = weights * (factors @ found.likely)
        weights /= weights.sum()
    existence = min(existence, CERTAIN)
    best = int(shares.argmax())
    before = one.existence
    log_odds = log_odds_of(existence) - log_odds_of(before) if 0 < before < 1 else 0.0
    moments = (one.mean, one.covariance) if alike else _kernels.moments(one.particles, weights)
    return Target(
        one.target.life, existence, one.particles, weights, *moments, one.weights,
        -1 if best == 0 else int(found.which[best - 1]), log_odds, found.allowed, found.forbidden,
        one.target.least_odds, echo, None if joint is None else joint[1],
    )  # fmt: skip


def log_odds_of(probability: float) -> float:
    """Logarithm of a probability's odds."""
    return math.log(probability) - math.log1p(-probability) if probability > 0 else -math.inf
