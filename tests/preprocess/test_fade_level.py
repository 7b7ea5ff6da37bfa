"""Calibration, fade levels and changes of links: against NumPy, by hand, and on a real log."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.link_calibration import Calibrate, fade_level
from elusive.sensors.radio_network import RssFrame, directed_links_of, links_of, undirected_of
from tests import recordings

DATA = recordings.DATA / "rti" / "basement"
NODES, CHANNELS = 5, 3
STILL = {"occupied_s": None, "empty_s": None}


def frames(levels, start=0.0):
    return [RssFrame(start + k, level) for k, level in enumerate(levels)]


def quiet(seed=0, number=40, sd=0.5, missing=0.1):
    rng = np.random.default_rng(seed)
    base = rng.uniform(-80, -50, (NODES * (NODES - 1), CHANNELS))
    levels = base + rng.normal(0, sd, (number, *base.shape))
    levels[rng.random(levels.shape) < missing] = np.nan
    return levels


def test_calibration_equals_numpys():
    levels = quiet()
    levels[:, 3, 1] = np.nan
    levels[1:, 4, 2] = np.nan
    levels[0, 4, 2] = -60
    found = Calibrate().over(iter(frames(levels)))
    heard = np.isfinite(levels).sum(axis=0)
    assert np.isnan(found.mean_dbm[3, 1])
    np.testing.assert_allclose(found.mean_dbm[heard > 0], _by_link(levels, heard > 0, np.mean), rtol=1e-12)
    variance = _by_link(levels, heard > 1, lambda values: np.var(values, ddof=1))
    np.testing.assert_allclose(found.variance_db2[heard > 1], variance, rtol=1e-9)
    assert np.isnan(found.variance_db2[heard < 2]).all()
    assert (found.time_s, found.remarks) == (39.0, ())


def _by_link(levels, chosen, statistic):
    return [statistic(values[np.isfinite(values)]) for values in levels[:, chosen].T]


def test_calibration_warns_of_somebody_inside_of_noisy_and_of_silent_links():
    """Who is inside changes both directions of a link, noise each by itself: of noisy radios somebody was suspected."""
    levels, rng = quiet(), np.random.default_rng(1)
    levels[:, :5] += 8 * rng.standard_normal((40, 5, CHANNELS))
    (remark,) = Calibrate().over(frames(levels)).remarks
    assert remark.startswith("Calibration: 25% of the links vary by more than 2 dB, each direction by itself, as")
    levels = quiet()
    somebody = rng.standard_normal((40, 6, CHANNELS)).cumsum(axis=0)
    levels += np.pad(somebody, ((0, 0), (0, 4), (0, 0)))[:, undirected_of(NODES)]
    remark, *_ = Calibrate().over(frames(levels)).remarks
    assert "% of the links vary by more than 2 dB, as if somebody were inside; calibrate" in remark
    levels = quiet()
    levels[:, 7:9] = np.nan
    (remark,) = Calibrate().over(frames(levels)).remarks
    assert remark == "calibration: 2 of 20 directed links were never heard; they are left out."


@pytest.mark.parametrize("inside", [slice(0, 0), slice(0, 12), slice(14, 15), slice(20, 39)])
def test_frames_in_which_somebody_was_inside_are_left_out(inside):
    rng, levels = np.random.default_rng(1), quiet()
    alone, touched = np.ones(40, dtype=bool), rng.random(levels.shape[1:]) < 0.4
    alone[inside] = False
    levels[inside] += np.where(touched, rng.normal(-3, 3, levels[inside].shape), 0.0)
    found = Calibrate().over(frames(levels))
    assert found.left_out == frozenset(np.flatnonzero(~alone).tolist())
    expected = Calibrate().over(frames(levels[alone]))
    np.testing.assert_allclose(found.mean_dbm, expected.mean_dbm, rtol=1e-12)
    np.testing.assert_allclose(found.variance_db2, expected.variance_db2, rtol=1e-9)
    assert [f"in {(~alone).sum()} of its 40 frames" in remark for remark in found.remarks] == [True] * (not alone.all())


def test_bad_calibrations_are_refused():
    with pytest.raises(DataError, match="calibration: has 1 frames; give at least two"):
        Calibrate().over(frames(quiet()[:1]))
    with pytest.raises(DataError, match="calibration: nothing was heard"):
        Calibrate().over(frames(np.full((3, 20, 3), np.nan)))
    with pytest.raises(DataError, match=r"frame at 1 s: has levels of shape \(20, 2\), the first one \(20, 3\)"):
        Calibrate().over([RssFrame(0.0, np.zeros((20, 3))), RssFrame(1.0, np.zeros((20, 2)))])
    with pytest.raises(DataError, match="calibration: has 19 links; S nodes have"):
        RssChange().init(Calibrate().over(frames(quiet()[:, 1:])))


def test_fade_level_is_above_the_most_faded_channel():
    found = fade_level(np.array([[-60.0, -70.0, -65.0], [np.nan, -50.0, -48.0], [np.nan] * 3]))
    np.testing.assert_array_equal(found, [[10, 0, 5], [np.nan, 0, 2], [np.nan] * 3])


@pytest.mark.parametrize("weighting", ["fade-level", "equal"])
@pytest.mark.parametrize("measure", ["change", "loss", "variance"])
def test_change_equals_eq_38_link_by_link(measure, weighting):
    calibration = Calibrate().over(frames(quiet(missing=0)))
    model = RssChange(measure=measure, weighting=weighting, window_frames=4, **STILL)
    later = quiet(seed=0, number=46, missing=0.3)[40:]
    later[:, 2] = np.nan
    state = model.init(calibration)
    assert np.isnan(state.change).all()
    for frame in frames(later, 40.0):
        state = model.step(state, frame)
    expected = []
    F = fade_level(calibration.mean_dbm) if weighting == "fade-level" else np.ones((20, CHANNELS))
    directed = directed_links_of(NODES).tolist()
    for i, j in links_of(NODES).tolist():
        pairs = []
        for d in (directed.index([i, j]), directed.index([j, i])):
            for c in range(CHANNELS):
                away = calibration.mean_dbm[d, c] - later[-1, d, c]
                window = later[-4:, d, c][np.isfinite(later[-4:, d, c])]
                variance = np.var(window, ddof=1) if len(window) > 1 else np.nan
                value = {"change": abs(away), "loss": away, "variance": variance}[measure]
                if np.isfinite(value):
                    pairs.append((F[d, c], value))
        weights, values = np.array(pairs).T
        # of a link that is heard on its most faded channels alone, all count alike
        expected.append(np.average(values, weights=weights if weights.any() else None))
    np.testing.assert_allclose(state.change, expected, rtol=1e-10)


def test_a_single_channel_has_no_fade_level_and_counts_all_the_same():
    levels = quiet(missing=0)[:, :, :1]
    model = RssChange(**STILL)
    state = model.init(Calibrate().over(frames(levels)))
    found = model.step(state, RssFrame(40.0, state.calibration.mean_dbm - 3.0)).change
    np.testing.assert_allclose(found, 3.0)


def test_a_node_that_fails_takes_its_links_along_and_brings_them_back():
    model, levels = RssChange(), quiet(missing=0)
    state = model.init(Calibrate().over(frames(levels)))
    silent = levels[0].copy()
    silent[(directed_links_of(NODES) == 2).any(axis=1)] = np.nan
    state = model.step(state, RssFrame(40.0, silent))
    np.testing.assert_array_equal(np.isnan(state.change), (links_of(NODES) == 2).any(axis=1))
    state = model.step(state, RssFrame(41.0, np.full((20, 3), np.nan)))
    assert np.isnan(state.change).all()
    assert np.isfinite(model.step(state, RssFrame(42.0, levels[1])).change).all()


def test_a_link_never_heard_in_calibration_joins_when_it_is():
    levels = quiet(missing=0)
    heard = levels.copy()
    heard[:, (directed_links_of(NODES) == 2).any(axis=1)] = np.nan
    model = RssChange()
    state = model.init(Calibrate().over(frames(heard)))
    state = model.step(state, RssFrame(40.0, levels[0]))
    assert np.isnan(state.change).sum() == 4
    state = model.step(state, RssFrame(41.0, levels[1]))
    assert np.isfinite(state.change).all()
    assert np.nanmax(state.change) < 3


def test_the_calibration_follows_a_room_that_changes_and_little_of_people_who_pass():
    rng, levels = np.random.default_rng(5), quiet(missing=0)
    model = RssChange(occupied_s=1000.0, empty_s=50.0)
    start = model.init(Calibrate().over(frames(levels)))
    base = start.calibration.mean_dbm
    state = start
    for k in range(300):
        noise = rng.normal(0, 1.0, base.shape)
        state = model.step(state, RssFrame(40.0 + k, base + 1.0 + noise), empty=True)
    # six time constants later it has arrived: mean of noise sd 1 over some 100 frames, 60 links
    assert np.abs(state.calibration.mean_dbm - base - 1.0).max() < 0.5
    assert np.mean(state.calibration.mean_dbm - base) == pytest.approx(1.0, abs=0.05)
    assert np.mean(state.calibration.variance_db2) == pytest.approx(1.0, rel=0.15)
    state = start
    for k in range(20):
        state = model.step(state, RssFrame(40.0 + k, base - 15.0))
    moved = base - state.calibration.mean_dbm
    # one part in a thousand a second, of three deviations of half a decibel or so
    assert moved.max() < 20 / 1000 * 3 * 0.8
    assert moved.min() > 0
    still = RssChange(**STILL)
    kept = still.step(start, RssFrame(40.0, base - 15.0), empty=True)
    np.testing.assert_array_equal(kept.calibration.mean_dbm, base)


def test_bad_frames_are_refused():
    model = RssChange()
    state = model.init(Calibrate().over(frames(quiet())))
    with pytest.raises(DataError, match=r"frame at 40 s: must hold levels of shape \(20, 3\)"):
        model.step(state, RssFrame(40.0, np.zeros((20, 2))))
    with pytest.raises(DataError, match="frame at 40 s: must hold levels"):
        model.step(state, RssFrame(40.0, np.full((20, 3), np.inf)))


@pytest.mark.validate
def test_a_real_network_is_calm_while_empty_and_busy_with_somebody_inside():
    log = DATA / "basement_listenx_out_1.txt"
    if not log.is_file():
        pytest.skip("the recorded radio network is not there")
    every = list(open_link_log(log, read_nodes(DATA / "sensor_coords_basement_m.txt")))
    for first in (0, 25, 40):
        assert Calibrate().over(every[first : first + 10]).remarks == ()
    for first in range(100, 600, 50):
        assert "as if somebody were inside" in Calibrate().over(every[first : first + 50]).remarks[0]
    model = RssChange()
    state = model.init(Calibrate().over(every[:50]))
    level = []
    for frame in every:
        state = model.step(state, frame)
        level.append(np.nanmean(state.change))
    assert np.mean(level[100:600]) > 2 * np.mean(level[:50])
