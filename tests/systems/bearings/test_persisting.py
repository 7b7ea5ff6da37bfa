"""Errors that persist make places of several emitters less sure: by how much is found from their own bearings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import chdtri

from elusive.metrics.consistency import squared_deviations
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import less_sure, persisting_finding, with_persisting
from elusive.systems.bearings.several_fit import fitted
from elusive.systems.bearings.track import track
from tests.systems.bearings.crowd import FOUND_OUT, SITES, crowd
from tests.systems.bearings.test_deviation import persisting

ASKED = BearingTracking(emitters={"kind": "several"}, motion={"kind": "cv", "q": 0.5}, sigma_deg=2.0)


def test_errors_that_persist_are_found_and_independent_ones_are_none():
    alone = [persisting(1, 0.0, 2.0)[1]]
    found = with_persisting(ASKED, None, SITES, alone)
    # a mean of errors of two degrees that last for 15 times is as sure as one of 30 times fewer; the path takes a part
    assert 1.5 < found.emitters.persisting < math.sqrt(30)
    finding = persisting_finding(found)
    assert not finding.holds
    assert not finding.grave
    assert with_persisting(found, None, SITES, []) == found
    calm = with_persisting(ASKED.replace(sigma_deg=1.0), None, SITES, [persisting(1, 0.0, 0.0)[1]])
    assert calm.emitters.persisting == 1.0
    assert persisting_finding(calm).holds


def test_tracks_are_as_much_less_sure():
    _, sets = crowd(4, 1, times=6, false=0.0)
    told = ASKED.replace(emitters={**ASKED.emitters.model_dump(), "persisting": 2.0})
    *_, last = track(sets, told.replace(sigma_deg=1.0), SITES)
    wider = less_sure(last, told)
    assert less_sure(last, ASKED) is last
    for one, other in zip(last.tracks, wider.tracks, strict=True):
        np.testing.assert_allclose(other.covariance, 4 * one.covariance)


@pytest.mark.thorough
def test_ellipses_of_several_hold_where_errors_persist():
    """Errors of two degrees that wander within 8 s; those of one flight err alike, so that a flight is about a draw."""
    inside, exact, kept = [], [], math.exp(-1 / 8)
    for seed in range(21, 25):
        truth, sets = crowd(seed, 2, false=0.3, sigma_deg=0.3)
        rng, heard = np.random.default_rng([seed, 6]), []
        error = 2.0 * rng.standard_normal(4)
        for one in sets:
            error = kept * error + 2.0 * math.sqrt(1 - kept**2) * rng.standard_normal(4)
            heard.append(one._replace(azimuth_rad=one.azimuth_rad + np.deg2rad(error)[one.sensor]))
        found = fitted(FOUND_OUT, SITES, heard)
        for step, at in zip(track(heard, found, SITES), truth, strict=True):
            for way, sizes in ((step, exact), (less_sure(step, found), inside)):
                for one in way.tracks:
                    if one.status == "confirmed":
                        off = at[:, [0, 2]] - one.mean[[0, 2]]
                        spread = np.repeat(one.covariance[None][np.ix_([0], [0, 2], [0, 2])], len(off), axis=0)
                        sizes.append(squared_deviations(off, spread).min())
    limit = chdtri(2, 0.05)
    assert np.mean(np.array(inside) < limit) > 0.95 - 3 * math.sqrt(0.95 * 0.05 / 8)
    assert np.mean(np.array(exact) < limit) < 0.7
