"""How far a statistic tells a noise object from the noise about it in one frame: what accumulation starts from."""

from __future__ import annotations

import numpy as np

from elusive.preprocess.sliding import Window

SAMPLES, EVERY = 2**17, 64  # of the frame that is simulated; from one object to the next


def contrast(statistic: Window, deviation: float = 1.0) -> float:
    """Return how much higher evidence is at an object than at noise, in deviations of noise's, to about .03.

    The objects are as long as the window and as loud as the background, to which they add; accumulation over k frames
    raises the contrast by the root of k.

    Parameters
    ----------
    statistic
        Of a sliding window.
    deviation
        Of the background, for boundaries in the signal's units.

    Raises
    ------
    DataError
        If the statistic refuses the frame, as where all samples lie in one region.
    """
    rng, half = np.random.default_rng(0), statistic.window // 2
    frame, at = rng.standard_normal(SAMPLES), np.arange(EVERY // 2, SAMPLES, EVERY)
    inside = at[:, None] + np.arange(-half, half + 1)
    frame[inside] += rng.standard_normal(inside.shape)
    evidence, quiet = statistic.evidence(deviation * frame), np.ones(SAMPLES, bool)
    quiet[(at[:, None] + np.arange(-2 * half, 2 * half + 1)).ravel() % SAMPLES] = False
    return float((evidence[at].mean() - evidence[quiet].mean()) / evidence[quiet].std())
