"""Whether frames that are declared white noise about a level are: its law, level, scale, tail and independence."""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding, share_of
from elusive.sensors import ImageSensor
from elusive.systems.images.frame_facts import FrameFacts, Law
from elusive.systems.images.parameters import ImageTracking

FACTOR = 1.15  # by which a declared deviation may be off: detection hardly suffers
LEVEL = 0.25  # deviations by which a level may be off
CORRELATION = 0.2  # of neighbours in space or time, in noise that counts as independent
CLEARER, UNLIKE = 0.6, 0.05  # a law fits better by such a factor, where the other misses by so many deviations
TAIL, TAIL_SHARE = 3.0, 0.00135  # deviations; of a Gaussian beyond them
LEARN = "or leave out --noise-sigma: frames are then taken as recorded, and their noise is learnt"


def white_findings(sensor: ImageSensor, parameters: ImageTracking, facts: FrameFacts) -> list[Finding]:
    """Return what frames that are taken as they are say of their declared noise."""
    law = facts.law
    if law is None:
        return []
    found = _law(sensor, law)
    if all(one.holds for one in found):  # else level, scale and tail are of another law
        found += [*_level(sensor, law, parameters, facts), *_scale(sensor, law), *_tail(sensor, law, facts)]
    return [*found, *_independence(facts)]


def clearly(misfit: float, other: float) -> bool:
    """Whether another law fits quantiles clearly better, by both misfits [deviations]."""
    return misfit > UNLIKE and other < CLEARER * misfit


def _law(sensor: ImageSensor, law: Law) -> list[Finding]:
    declared, gaussian = sensor.noise, sensor.noise == "gaussian"
    own, other = law.gaussian_misfit, law.rayleigh_misfit
    if not gaussian:
        own, other = other, own
    unlike = clearly(own, other)
    seen = "a Rayleigh amplitude's" if gaussian else "Gaussian"
    better = f"--noise rayleigh --noise-sigma {law.rayleigh_sigma:.3g}"
    if not gaussian:
        better = f"--noise gaussian --noise-sigma {law.sigma:.3g} --pedestal {law.pedestal:.4g}"
    return [
        Fact(0.0, own, not unlike, math.nan).finding(
            "noise.law",
            f"Noise declared {declared} is {seen}: its quantiles miss the declared law by {own:.2g} deviations and "
            f"that one by {other:.2g}, and what is common in the one is taken for a target in the other.",
            f"Give {better}.",
        )
    ]


def _level(sensor: ImageSensor, law: Law, parameters: ImageTracking, facts: FrameFacts) -> list[Finding]:
    """Check the level of frames without a target, of all together and of each."""
    if sensor.noise == "rayleigh":  # which has none
        return []
    declared, sign = parameters.pedestal, 1 if parameters.polarity == "bright" else -1
    seen, off = declared + sign * law.pedestal, law.pedestal / law.sigma
    spread = float(np.std(facts.medians)) / law.sigma
    level = Fact(declared, seen, abs(off) <= LEVEL, math.nan).finding(
        "frames.pedestal",
        f"Frames declared white about {declared:g} lie about {seen:.4g}, {abs(off):.1f} deviations of their noise off: "
        f"the level itself is taken for {'targets' if off > 0 else 'their absence'}.",
        f"Give --pedestal {seen:.4g}, {LEARN}.",
    )
    drift = Fact(0.0, spread, spread <= LEVEL, math.nan).finding(
        "frames.level-drifts",
        f"The level of the frames, declared constant, changes by {spread:.2g} deviations of their noise from frame to "
        "frame: where it is high, noise is taken for targets.",
        "Leave out --noise-sigma: frames are then taken as recorded, and each is compared with its own level.",
    )
    return [level, drift]


def _scale(sensor: ImageSensor, law: Law) -> list[Finding]:
    seen = law.sigma if sensor.noise == "gaussian" else law.rayleigh_sigma
    ratio = seen / sensor.noise_sigma
    means = "noise is taken for targets, and existence is too high" if ratio > 1 else "faint targets are missed"
    return [
        Fact(sensor.noise_sigma, seen, 1 / FACTOR <= ratio <= FACTOR, math.nan).finding(
            "noise.scale",
            f"The noise has a deviation of {seen:.3g} where {sensor.noise_sigma:.3g} is declared, {ratio:.2f} times as "
            f"much: {means}.",
            f"Give --noise-sigma {seen:.3g}, {LEARN}.",
        )
    ]


def _tail(sensor: ImageSensor, law: Law, facts: FrameFacts) -> list[Finding]:
    """Check the dark end of Gaussian noise: targets are at the other."""
    if sensor.noise == "rayleigh":
        return []
    share, count = facts.share_beyond(law.pedestal, law.sigma, TAIL)
    fact = share_of(share * count, count, TAIL_SHARE, tolerance=3 * TAIL_SHARE)
    return [
        fact.finding(
            "noise.tail",
            f"{100 * share:.2g} % of the pixels lie {TAIL:g} deviations below the level, {100 * TAIL_SHARE:.2g} % in "
            "Gaussian noise: outliers as far above are taken for targets.",
            "Leave out --noise-sigma: frames are then taken as recorded, with the tail that they have.",
        )
    ]


def _independence(facts: FrameFacts) -> list[Finding]:
    time, *space = facts.correlations
    beside = max(space)
    in_time = Fact(0.0, time, not abs(time) > CORRELATION, math.nan).finding(
        "noise.correlated-in-time",
        f"A pixel's noise, declared new in each frame, is correlated with that of the frame before by {time:.2f}: a "
        "scene or a pattern is in the frames, and is counted as evidence anew in each.",
        "Leave out --noise-sigma: frames are then taken as recorded, and what stays is learnt.",
    )
    in_space = Fact(0.0, beside, not abs(beside) > CORRELATION, math.nan).finding(
        "noise.correlated-in-space",
        f"The noise of neighbouring pixels, declared independent, is correlated by {beside:.2f}: clumps of noise look "
        "like targets.",
        "Leave out --noise-sigma: frames are then taken as recorded, and how strong such clumps are is learnt.",
    )
    return [in_time, in_space]
