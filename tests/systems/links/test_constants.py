"""Constants of the links fitted without labels: known ones are found again, the likelihood never falls."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.systems.links.constants import LinkFitting
from tests.tracking.link_scenes import shadowed_links, states_of

ROOM = Area.rectangle(-4.0, 4.0, -4.0, 4.0)
TRUE = LinkShadowing(loss_length_m=0.05, near_length_m=0.05, temper=0.3)


def log_of(frames=150, empty=30):
    """Changes of a room that is empty at first and then walked through, with the true constants."""
    rng = np.random.default_rng(0)
    sensor = shadowed_links(nodes=8, half=3.0, model=TRUE)
    place, changes = np.array([0.0, 0.0]), []
    for k in range(frames):
        place = np.clip(place + rng.normal(0, 0.3, 2), -2.5, 2.5)
        changes.append(sensor.simulate(states_of(place[None] if k >= empty else place[None] * np.nan), rng))
    return sensor, np.array(changes)


@pytest.mark.thorough
def test_known_constants_are_found_from_afar():
    sensor, changes = log_of()
    start = TRUE.replace(loss_db=4.0, far_sd_db=1.2, far_length_m=2.5, fade_slope=0.4, floor_sd_db=0.8, near_sd_db=3.0)
    fit = LinkFitting(pitch_m=0.4, spread_m=0.3, iterations=6).fit(
        sensor.with_model(start), np.arange(150.0), changes, ROOM
    )
    gains = np.diff(fit.log_likelihood)
    assert (gains > -1e-6 * abs(fit.log_likelihood[0])).all()
    assert fit.log_likelihood[-1] > fit.log_likelihood[0] + 10
    # a dozen kept from each of 224 readings over 120 frames; cells of .4 m blur what is narrow
    assert fit.model.far_sd_db == pytest.approx(TRUE.far_sd_db, rel=0.1)
    assert fit.model.far_length_m == pytest.approx(TRUE.far_length_m, rel=0.15)
    assert fit.model.fade_slope == pytest.approx(TRUE.fade_slope, abs=0.08)
    assert fit.model.floor_sd_db == pytest.approx(TRUE.floor_sd_db, abs=0.1)
    assert fit.model.loss_db == pytest.approx(TRUE.loss_db, rel=0.35)
    assert (fit.model.temper, fit.model.degrees) == (TRUE.temper, TRUE.degrees)
    assert fit.presence[:28].max() < 0.1
    assert fit.presence[33:].min() > 0.9


def test_a_log_that_cannot_be_fitted_is_refused():
    sensor, changes = log_of(frames=30, empty=30)
    with pytest.raises(DataError, match="nobody seems to have been there"):
        LinkFitting().fit(sensor, np.arange(30.0), changes, ROOM)
    with pytest.raises(DataError, match="the fit needs at least 20"):
        LinkFitting().fit(sensor, np.arange(19.0), changes[:19], ROOM)
    with pytest.raises(DataError, match="frame: has shape"):
        LinkFitting().fit(sensor, np.arange(30.0), changes[:, :5], ROOM)
