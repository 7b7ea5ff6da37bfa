"""What somebody seems to gain in frames in which nobody is there: told by the empty room's own frames.

A level's spread is known from a few frames, and what disturbs many links at once looks like somebody who spreads them.
Each frame of the calibration is weighed by a calibration on the others (cross-validation: Stone, 1974, J. Roy. Stat.
Soc. B 36(2), 111-147), and who is looked for has to gain more than these frames do. By their median and its deviation
(Rousseeuw and Croux, 1993, J. Amer. Stat. Assoc. 88, 1273-1283), lest a single disturbance hides everybody.
"""

from __future__ import annotations

import warnings

import numpy as np

from elusive.contracts import Array
from elusive.preprocess.robust import MAD
from elusive.sensors.link_shadowing import ShadowedLinks, TemperedRise

FOLDS = 5
FEWEST = 3  # frames: of two, no spread is left
BEYOND = 3.0  # deviations: one frame in 700


def gained_by_chance(sensor: ShadowedLinks, centres: Array, rises_db: Array) -> float:
    """Return the log likelihood, not tempered, that somebody anywhere gains in a frame of the empty room at most.

    Parameters
    ----------
    sensor
        The links.
    centres
        ``(M, 2)`` of cells in which somebody may be [m].
    rises_db
        ``(K, D, C)`` changes of the empty room's frames from their mean, NaN where missing.

    Returns
    -------
    float
        At least nought: of a model that holds, nobody's frames speak against anybody. Nought of too few frames.
    """
    if len(rises_db) < FEWEST:
        return 0.0
    expected, gains = sensor.expected_at(centres), list[float]()
    fold = np.arange(len(rises_db)) % FOLDS
    for number in np.unique(fold):
        others = rises_db[fold != number]
        with warnings.catch_warnings():  # readings that the others do not have
            warnings.simplefilter("ignore", RuntimeWarning)
            mean, variance = np.nanmean(others, axis=0), np.nanvar(others, axis=0, ddof=1)
        left = sensor.with_variance(variance)
        for rise_db in rises_db[fold == number]:
            level = left.log_ratio(expected, TemperedRise(rise_db - mean, 1.0), ())
            top = float(level.max())
            gains.append(top + float(np.log(np.exp(level - top).mean())))
    median = float(np.median(gains))
    deviation = MAD * float(np.median(np.abs(np.array(gains) - median)))
    return max(median + BEYOND * deviation, 0.0)
