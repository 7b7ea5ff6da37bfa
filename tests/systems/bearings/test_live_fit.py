"""What is not told is learnt live: norths that are off, and how precise bearings are."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.sensors.bearing_sets import BearingSet
from elusive.sensors.bearings import BearingSensors
from elusive.systems.bearings.found_norths import exact
from elusive.systems.bearings.live_one import OneFit
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.track import track
from tests.longer import longer
from tests.systems.bearings.crowd import PLACES, SITES, crowd

ONE = BearingTracking(emitters={"kind": "one"}, filter={"kind": "fixed-lag"})
LEARNT = 20  # times, after which the first is learnt


@pytest.mark.parametrize(
    ("norths_deg", "sigma_deg"), longer([(2.0, 1.0), (0.0, 1.0), (0.0, 3.0)], (2.0, 1.0), (0.0, 3.0))
)
def test_ellipses_of_one_emitter_hold(norths_deg, sigma_deg):
    squares = []
    for seed in range(61, 64):
        truth, sets = crowd(seed, 1, false=0.0, sigma_deg=sigma_deg)
        off_deg = tuple((norths_deg * np.random.default_rng([5, seed]).normal(size=4)).tolist())
        norths = exact(SITES)._replace(off_deg=off_deg)
        heard = [norths.as_heard(one) for one in sets if len(one.sensor)]
        for step in list(track(heard, ONE, SITES, live=True))[LEARNT:]:
            (one,) = step.tracks
            off = (truth[int(step.time_s), 0] - one.mean)[[0, 2]]
            squares.append(off @ np.linalg.solve(one.covariance[np.ix_([0, 2], [0, 2])], off))
    # norths of one recording are one draw: .25 of the times are inside without what is learnt, .2 beyond 99.99 %
    assert np.mean(np.array(squares) < 5.99) > 0.6
    assert np.mean(np.array(squares) > 18.4) < 0.02


def test_what_tells_neither_norths_nor_deviation_leaves_them_as_they_were():
    """Sensors that move, and a single one."""
    truth, sets = crowd(61, 1, false=0.0, times=24)
    places = np.array(PLACES)
    moving = [BearingSet(*one[:4], places[one.sensor]) for one in sets]
    alone = BearingSensors(positions_m=PLACES[:1]).simulate(truth[:, 0], np.arange(24.0), np.random.default_rng(1))
    for heard in (moving, alone):
        fit = OneFit(ONE, SITES, heard[0])
        for one in heard:
            fit.heed({1: one})
        assert fit.norths == exact(SITES)
        assert fit.parameters.deviation_deg == BearingTracking.usual_sigma_deg
