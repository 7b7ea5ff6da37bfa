"""A stationary emitter: Lenth's printed table, field fixes, his own iteration, coverage of the ellipse, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from elusive.errors import DataError, ParameterError
from elusive.filters.gaussian.geolocation import Geolocation
from tests import recordings
from tests.longer import longer
from tests.reference.geolocation import lenth

DATA = recordings.DATA / "bearings" / "telemetry"
PLACES = np.array([[0.0, 0.0], [70.0, 12.0], [-60.0, 81.0]])
KAPPA = 1 / 0.0019014  # of White and Garrott: 2.5 degrees
NAMES = {"MLE": "ml", "H-1.5": "huber", "A-1.5": "andrews"}


def needs_data():
    if not (DATA / "lenth.dat").is_file():
        pytest.skip("the telemetry recordings are not there; set ELUSIVE_DATA to their folder")


def azimuths(places, x, y):
    return np.arctan2(x - places[:, 0], y - places[:, 1])


def misfit(at, azimuth, places):
    return -np.cos(azimuth - azimuths(places, *at)).sum()


def scene(rng, n, sigma):
    places = rng.uniform(-100, 100, (n, 2))
    x, y = rng.uniform(-100, 100, 2)
    return places, azimuths(places, x, y) + sigma * rng.standard_normal(n)


def test_lenths_table():
    needs_data()
    lines = (DATA / "lenth.dat").read_text().splitlines()[1:]
    table = np.array([[float(cell) for cell in line.split()[1:]] for line in lines])
    seen = 0
    for line in (DATA / "lenthresults.dat").read_text().splitlines()[1:]:
        _, count, name, *printed = line.split()
        if name not in NAMES:
            continue
        seen += 1
        rows = table if count == "8" else np.delete(table, 5, axis=0)
        fix = Geolocation(estimator=NAMES[name]).locate(np.deg2rad(rows[:, 2]), rows[:, :2])
        x, y, distance, sd_x, sd_y, correlation = map(float, printed)
        deviations = np.sqrt(np.diag(fix.covariance))
        np.testing.assert_allclose(fix.position_m, [x, y], atol=0.005001)
        # he has some of the distances lower by one in the last digit
        assert np.hypot(*(fix.position_m - [7.502, 2.198])) == pytest.approx(distance, abs=0.00151)
        # he prints .152 for .15251, and .945 for .94441
        np.testing.assert_allclose(deviations, [sd_x, sd_y], atol=0.0006)
        assert fix.covariance[0, 1] / deviations.prod() == pytest.approx(correlation, abs=0.000501)
    assert seen == 6


def field_fixes():
    """Bearings, their places and the reference, of each triangulation that has one."""
    towers = np.array(
        [line.split(b",") for line in (DATA / "towers.dat").read_bytes().replace(b"\r", b"").split()], float
    )
    for line in (DATA / "fixes.dat").read_bytes().split(b"\n"):
        reference = line[47:63]
        if len(line) < 63 or b"*" in reference or line.split()[-1] == b"2":
            continue
        cells = line[:46].split()[4:]
        told = [(int(tower) - 1, float(azimuth)) for tower, azimuth in zip(cells[::2], cells[1::2], strict=True)]
        rows = [(tower, azimuth) for tower, azimuth in told if azimuth != 0]
        if len(rows) >= 2:
            at = np.array([float(reference[:8]), float(reference[8:])])
            yield np.deg2rad([azimuth for _, azimuth in rows]), towers[[tower for tower, _ in rows]], at


def test_field_triangulations():
    needs_data()
    andrews = Geolocation(estimator="andrews", sigma_deg=np.rad2deg(KAPPA**-0.5))
    apart, refused = {2: [], 3: []}, 0
    for azimuth, places, reference in field_fixes():
        try:
            apart[len(azimuth)].append(np.hypot(*(andrews.locate(azimuth, places).position_m - reference)))
        except DataError:
            refused += 1  # two of its three are strays to each other
    assert (len(apart[2]), len(apart[3])) == (44, 202)
    assert refused == 1
    assert np.median(apart[3]) <= 0.6
    assert np.median(apart[2]) <= 0.35


@pytest.mark.parametrize("estimator", ["ml", "huber", "andrews"])
@pytest.mark.parametrize("kappa", [None, 400.0])
def test_the_fix_is_that_of_lenths_iteration(estimator, kappa):
    rng = np.random.default_rng(3)
    sigma = None if kappa is None else np.rad2deg(kappa**-0.5)
    for _ in range(10):
        places, azimuth = scene(rng, 8, 0.05)
        expected, covariance, weights = lenth(places, azimuth, estimator, kappa=kappa)
        fix = Geolocation(estimator=estimator, sigma_deg=sigma).locate(azimuth, places)
        np.testing.assert_allclose(fix.position_m, expected, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(fix.covariance, covariance, rtol=1e-5)
        np.testing.assert_allclose(fix.weights, weights, atol=1e-6)


def test_maximum_likelihood_is_the_maximum():
    rng = np.random.default_rng(4)
    for _ in range(10):
        places, azimuth = scene(rng, 5, 0.1)
        fix = Geolocation().locate(azimuth, places)
        found = minimize(
            misfit, fix.position_m, (azimuth, places), method="Nelder-Mead", options={"xatol": 1e-7, "fatol": 1e-15}
        )
        np.testing.assert_allclose(fix.position_m, found.x, atol=1e-3)
        assert misfit(fix.position_m, azimuth, places) <= found.fun + 1e-12


@pytest.mark.parametrize(
    "estimator", longer(["ml", "huber", "andrews", "stansfield"], "huber", "andrews", "stansfield")
)
def test_the_ellipse_holds_the_emitter_as_often_as_it_says(estimator):
    rng, runs, inside = np.random.default_rng(5), 600, 0
    azimuth = azimuths(PLACES, 40.0, 60.0)
    geolocation = Geolocation(estimator=estimator, sigma_deg=1.0)
    for _ in range(runs):
        fix = geolocation.locate(azimuth + np.deg2rad(1.0) * rng.standard_normal(3), PLACES)
        off = fix.position_m - [40.0, 60.0]
        inside += off @ np.linalg.solve(fix.covariance, off) < -2 * np.log(0.05)
    # the robust ones lose a little where nothing is stray
    assert inside / runs == pytest.approx(0.95, abs=4 * np.sqrt(0.95 * 0.05 / runs))


def test_noise_is_estimated_and_strays_are_left_out():
    rng = np.random.default_rng(6)
    places = rng.uniform(-100, 100, (400, 2))
    azimuth = azimuths(places, 20.0, -150.0) + np.deg2rad(2.0) * rng.standard_normal(400)
    assert np.rad2deg(Geolocation().locate(azimuth, places).sigma_rad) == pytest.approx(2.0, abs=0.25)
    azimuth[:60] = rng.uniform(0, 2 * np.pi, 60)
    plain, robust = (Geolocation(estimator=name).locate(azimuth, places) for name in ("ml", "andrews"))
    off = [np.hypot(*(fix.position_m - [20.0, -150.0])) for fix in (plain, robust)]
    assert off[1] < 1.0 < off[0]
    assert any("taken for strays" in remark for remark in robust.remarks)
    assert any("point away" in remark for remark in robust.remarks)


def test_an_ellipse_has_its_axes_and_direction():
    azimuth = azimuths(PLACES, 500.0, 500.0)
    fix = Geolocation(sigma_deg=1.0).locate(azimuth, PLACES)
    ellipse = fix.ellipse(0.9)
    values = np.linalg.eigvalsh(fix.covariance)
    scale = -2 * np.log(0.1)
    assert ellipse.semi_major_m == pytest.approx(np.sqrt(scale * values[1]))
    assert ellipse.semi_minor_m == pytest.approx(np.sqrt(scale * values[0]))
    assert ellipse.area_m2 == pytest.approx(np.pi * scale * np.sqrt(values.prod()))
    assert ellipse.azimuth_deg == pytest.approx(45, abs=5)
    assert ellipse.confidence == 0.9


def test_what_two_bearings_do_not_tell_is_said():
    azimuth = azimuths(PLACES[:2], 10.0, 60.0)
    fix = Geolocation().locate(azimuth, PLACES[:2])
    np.testing.assert_allclose(fix.position_m, [10, 60], atol=1e-9)
    assert np.isnan(fix.covariance).all()
    assert np.isnan(fix.ellipse().semi_major_m)
    assert fix.remarks == ("Two bearings always cross, so their noise is not told; give it for an ellipse.",)
    far = Geolocation(sigma_deg=2.0).locate(azimuths(PLACES, 3000.0, 3000.0), PLACES)
    assert "distance is hardly told" in far.remarks[0]


def test_an_emitter_at_a_sensor():
    fix = Geolocation(sigma_deg=1.0).locate(np.array([0.3, np.arctan2(-70, -12), np.arctan2(60, -81)]), PLACES)
    np.testing.assert_allclose(fix.position_m, [0, 0], atol=0.1)


@pytest.mark.parametrize(
    ("azimuth", "places", "sentence"),
    [
        (np.zeros(2), PLACES, r"have shapes \(2,\) and \(3, 2\); give \(n,\) and \(n, 2\)"),
        (np.array([0.0, np.nan, 1.0]), PLACES, "a number is not finite"),
        (np.zeros(1), PLACES[:1], "there are 1; a place needs two or more"),
        (np.array([0.1, 0.2]), PLACES[[0, 0]], "all are taken at one place, which gives a direction and no distance"),
        (np.full(3, 0.7), PLACES, "are parallel, and parallel lines cross nowhere"),
        (np.array([0.7, 0.7 + np.pi]), PLACES[:2], "are parallel"),
        (np.array([-0.5, 0.5]), PLACES[:2], "diverge"),
        (np.array([np.pi, np.pi + 0.01, np.pi - 0.01]), np.array([[0.0, 0], [-9, 0], [9, 0]]), "diverge"),
    ],
)
@pytest.mark.parametrize("estimator", ["ml", "stansfield"])
def test_what_tells_no_place_is_refused(azimuth, places, sentence, estimator):
    with pytest.raises(DataError, match=sentence):
        Geolocation(estimator=estimator, sigma_deg=1.0).locate(azimuth, places)


def test_other_refusals():
    off = azimuths(PLACES, 40.0, 60.0) + np.array([0.1, 0, 0])
    for estimator in ("ml", "stansfield"):
        with pytest.raises(DataError, match="does not settle in 1 steps"):
            Geolocation(iterations=1, estimator=estimator).locate(off, PLACES)
    outwards = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    with pytest.raises(DataError, match="diverge, and no place lies"):
        Geolocation().locate(outwards, np.column_stack([np.sin(outwards), np.cos(outwards)]))
    with pytest.raises(ParameterError, match="estimator"):
        Geolocation(estimator="median")
