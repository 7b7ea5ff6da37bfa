"""Another radar's pulses, one in a spoke: spirals, since that radar's rate is not this one's.

An echo is in all spokes of a beam; what is in one of them alone is none (interference rejection by the correlation of
neighbouring sweeps; Skolnik, 2008, Radar handbook, section 22.3). Speckle exceeds both neighbours' power by a factor a
with probability 2 / ((a + 1) (a + 2)), whatever texture they share.
"""

from __future__ import annotations

import numpy as np

from elusive.checks import Finding
from elusive.sensors.spokes import Spokes

SPARSE = 8  # samples of a spoke of which one is looked at
LOUDER = 10.0  # in amplitude: speckle is so once in 5000 samples
MANY = 0.002  # share of samples at which ships were found less


def single_samples(spokes: Spokes) -> tuple[int, int]:
    """Return how many samples are far stronger than those of both neighbouring spokes, and of how many."""
    amplitude = spokes.amplitude[:, ::SPARSE].astype(np.float32)
    if len(amplitude) < 3:
        return 0, 0
    beside = np.maximum(amplitude[:-2], amplitude[2:])
    known = beside > 0 if not spokes.bits else np.ones(beside.shape, np.bool_)
    single = known & (amplitude[1:-1] > LOUDER * np.maximum(beside, 1.0 if spokes.bits else 0.0))
    return int(np.count_nonzero(single)), int(np.count_nonzero(known))


def spirals(single: int, samples: int) -> Finding:
    """Whether more samples than speckle makes stand in one spoke alone."""
    share = single / max(samples, 1)
    return Finding(
        "video.spirals", share < MANY, 0.0, share,
        f"{100 * share:.1f} % of the samples are far stronger than those of both spokes beside: pulses of another "
        "radar, or of more. Among them ships are found less.",
        "Turn the radar's interference rejection on.", grave=False,
    )  # fmt: skip
