"""The report of an emitter tracked by its bearings: complete in itself, true to the track, alive in a browser."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elusive.systems.bearings.report import BearingsTracked, bearings_report
from elusive.systems.bearings.report.page import TIMES_SHOWN
from tests.browsing import data_in, is_drawn, layers, names, numbers, stands_alone, titles
from tests.longer import longer

SENSORS = np.array([[0.0, 0.0], [70.0, 12.0], [500.0, 900.0]])


def tracked(times: int = 30, *, truth: bool = True, solid: bool = False, started: int = 3) -> BearingsTracked:
    rng = np.random.default_rng(3)
    k = np.arange(times)
    places = np.column_stack([10 + k, 40 + 5 * np.sin(k / 5)])
    true = np.column_stack([places, np.full(times, 4.0)])
    found = places + rng.normal(size=places.shape)
    found[: min(started, 1)] = np.nan
    covariances = np.broadcast_to([[4.0, 1.0], [1.0, 1.0]], (times, 2, 2)).copy()
    sensor = np.tile([0, 1], times)
    azimuth = np.arctan2(*(np.repeat(places, 2, axis=0) - SENSORS[sensor]).T)
    return BearingsTracked(
        "A <b>& title</b> </script>", "A track & more.", ["mast </script>", "roof", "silent"], SENSORS, 0.5 * k,
        found, covariances,
        np.column_stack([4 + 0.1 * k, np.full(times, 0.5)]) if solid else None, started,
        2 * np.arange(times + 1), sensor, azimuth, rng.normal(size=2 * times), true if truth else None,
        [("Estimator", "map")],
    )  # fmt: skip


CASES = [(30, True, False, 3), (30, False, True, 0), (1, False, False, 0), (2, True, False, 2), (9000, True, True, 5)]


def made(times: int, truth: bool, solid: bool, started: int) -> BearingsTracked:
    return tracked(times, truth=truth, solid=solid, started=started)


def test_errors_and_deviations() -> None:
    one = tracked()
    assert one.error is not None
    np.testing.assert_allclose(one.error[5], np.hypot(*(one.places[5] - one.truth[5, :2])))
    np.testing.assert_allclose(one.deviation, np.sqrt(5.0))
    assert one.known.tolist() == [False] * 3 + [True] * 27


def test_a_sensor_that_never_reports_does_not_widen_the_ground() -> None:
    west, east, south, north = tracked().extent
    assert (west, south) < (0, 0)
    assert east < 80
    assert north < 60


def written(folder: Path, given: BearingsTracked) -> Path:
    bearings_report(given).write_page(folder / "r.html")
    return folder / "r.html"


def test_the_page_stands_alone(tmp_path: Path) -> None:
    stands_alone(written(tmp_path, tracked()))


def test_the_page_holds_what_was_tracked(tmp_path: Path) -> None:
    one = tracked(solid=True)
    data = data_in(written(tmp_path, one))
    assert data["times"] == one.times_s.tolist()
    (track,) = layers(data, type="track")
    assert track["times"] == one.times_s[3:].tolist()
    np.testing.assert_allclose(np.column_stack([track["x"], track["y"]]), one.places[3:], atol=0.006)
    np.testing.assert_allclose([track["sx"][0], track["sy"][0], track["cxy"][0]], [2.0, 1.0, 1.0], atol=0.00051)
    (bearings,) = layers(data, name="bearings now")
    assert bearings["times"] == np.repeat(one.times_s, 2).tolist()
    ends = np.array(bearings["ends"])
    np.testing.assert_allclose(ends[:, :2], SENSORS[one.sensor], atol=0.00051)
    np.testing.assert_allclose(np.arctan2(*(ends[:, 2:] - ends[:, :2]).T), one.azimuth_rad, atol=1e-4)
    (height,) = layers(data, name="height")
    np.testing.assert_allclose(height["y"], one.heights[:, 0], atol=0.00051)
    left = [layers(data, name=name)[0] for name in one.names[:2]]
    np.testing.assert_allclose([layer["y"] for layer in left], one.residual_deg.reshape(-1, 2).T, atol=0.0051)
    assert data["start"] == 16  # the middle of the times with a place, 3 to 29


def test_a_long_recording_is_thinned_for_the_page(tmp_path: Path) -> None:
    data = data_in(written(tmp_path, tracked(9000)))
    assert TIMES_SHOWN / 2 < len(data["times"]) <= TIMES_SHOWN
    assert set(layers(data, name="bearings now")[0]["times"]) == set(data["times"])
    assert len(numbers(layers(data, name="truth")[0]["x"])) == len(data["times"])


@pytest.mark.parametrize(("times", "truth", "solid", "started"), longer(CASES, *CASES[:2], CASES[3]))
def test_the_figure_is_drawn(tmp_path: Path, times: int, truth: bool, solid: bool, started: int) -> None:
    bearings_report(made(times, truth, solid, started)).write_figure(tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


@pytest.mark.parametrize(("times", "truth", "solid", "started"), CASES)
def test_the_page_shows_what_there_is(tmp_path: Path, times: int, truth: bool, solid: bool, started: int) -> None:
    data = data_in(written(tmp_path, made(times, truth, solid, started)))
    assert ("truth" in names(data)) == ("distance to the truth" in names(data)) == truth
    assert titles(data)[1:3] == ["How far off" if truth else "How sure", "What did the bearings leave"]
    assert ("How high" in titles(data)) == solid


@pytest.mark.parametrize(("times", "solid", "width"), longer([(30, True, 1280), (1, False, 800)], (1, False, 800)))
def test_a_browser_draws_it_without_complaint(tmp_path: Path, times: int, solid: bool, width: int) -> None:
    is_drawn(written(tmp_path, tracked(times, solid=solid, started=0)), width)
