"""A real radio log: what the links' variance alone says of somebody who walks and carries nothing.

642 rows of 720 directed links of ten nodes, in whole dBm, a row each .63 s. Nobody is there in the first 50 rows. A
person walks from 56 s on; between the two the log does not say when the person came in. Only the model and the first
50 rows have chosen the settings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from elusive.filters.accumulate.false_alarm import ExtremeValue, FalseAlarm, fit
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess.standardise import learn_standard
from elusive.preprocess.windows import LikelihoodRatio
from elusive.runner import run
from tests import recordings

DATA = recordings.DATA / "rti" / "basement"
LOG = DATA / "basement_listenx_out_1.txt"
EMPTY_ROWS, WALK_S = 50, 56.0
CALIBRATION = 35  # rows; the other 15 empty ones are held out
CLIP = 3.0  # deviations: single readings jump by as much as 20 with nobody there
SMOOTHING = 0.9  # ten rows, 6 s, in which one walks a few metres

pytestmark = pytest.mark.skipif(not LOG.exists(), reason=f"needs the radio log under {DATA}")


class Alarms(NamedTuple):
    times_s: np.ndarray  # (rows,)
    score: np.ndarray  # (rows,) largest over the links [dimensionless]
    law: ExtremeValue  # of the score of a row with nobody there

    @property
    def raised(self) -> np.ndarray:
        return self.score > self.law.threshold(FalseAlarm().probability)


def read(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Read times [s] and levels [dB]; a missing reading is the link's last one, before any its first.

    Readings are whole numbers: noise of the same width is added, so that a quiet link's deviation is not zero.
    """
    table = np.loadtxt(LOG)
    levels = np.where(table[:, :-1] > -10, np.nan, table[:, :-1])
    before = np.array([link[np.isfinite(link)][0] for link in levels.T])
    for row in levels:
        row[np.isnan(row)] = before[np.isnan(row)]
        before = row
    return table[:, -1] / 1000, levels + np.random.default_rng(seed).uniform(-0.5, 0.5, levels.shape)


def accumulated(changes: np.ndarray, calibration: int, smoothing: float) -> tuple[np.ndarray, ExtremeValue]:
    """Accumulate the evidence that the changes from row to row are larger than in the first ones, over all links.

    Changes, because levels drift; standardised link by link; at velocity zero, because links do not move. Each half
    of the calibration rows is standardised by the other half: what is learnt from a row itself fits it too well.
    """
    half = calibration // 2
    standards = [
        learn_standard(list(rows)) for rows in (changes[half:calibration], changes[:half], changes[:calibration])
    ]
    standard_of = [standards[0]] * half + [standards[1]] * (calibration - half)
    standard_of += [standards[2]] * (len(changes) - calibration)
    statistic = LikelihoodRatio(window=changes.shape[1] - 1, background_deviation=1.0)
    links = [np.clip(standard.apply(row), -CLIP, CLIP) for standard, row in zip(standard_of, changes, strict=True)]
    evidence = np.array([statistic.statistic(row) for row in links])
    evidence -= evidence[:calibration].mean()
    states = run(RecurrentFilter(smoothing=smoothing, max_velocity=0), evidence, np.random.default_rng(0), start_s=-1.0)
    # not the filter's own scale: that grows where all links change at once
    score = np.array([(state.score * state.deviation).max() for state in states])
    settled = round(1 / (1 - smoothing))
    return score, fit(score[settled:calibration])


def watched(seed: int, smoothing: float = SMOOTHING) -> Alarms:
    """Watch the log; the room is the object, and all links are its window."""
    times, levels = read(seed)
    score, law = accumulated(np.diff(levels, axis=0), CALIBRATION - 1, smoothing)  # the second row has the first change
    return Alarms(times[1:], score, law)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_somebody_is_there_and_nobody_was(seed: int) -> None:
    alarms = watched(seed)
    assert not alarms.raised[: EMPTY_ROWS - 1].any()
    walking = alarms.times_s >= WALK_S
    assert walking.sum() > 500
    assert alarms.raised[walking].mean() > 0.98  # .986 to .993 over eight seeds of the added noise
    first = alarms.times_s[EMPTY_ROWS - 1 :][alarms.raised[EMPTY_ROWS - 1 :]][0]
    assert first < WALK_S + 2.0


def test_half_the_memory_says_the_same() -> None:
    alarms = watched(1, smoothing=0.8)
    assert not alarms.raised[: EMPTY_ROWS - 1].any()
    assert alarms.raised[alarms.times_s >= WALK_S].mean() > 0.96


def test_in_random_order_there_is_nothing_to_tell() -> None:
    """Each link's changes shuffled in time: the first rows are then as the others, and the alarm stays silent."""
    changes = np.random.default_rng(2).permuted(np.diff(read(1)[1], axis=0), axis=0)
    score, law = accumulated(changes, 200, SMOOTHING)
    assert (score[200:] > law.threshold(FalseAlarm().probability)).mean() < 0.02
