"""Jiang et al. (2024): flights, bound, table and figures; the table's rows by an independent prototype."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import ParameterError
from elusive.experiments.jiang2024.reproduce import TARGETS, reproduce
from elusive.experiments.jiang2024.scenario import (
    SIGMAS_DEG,
    STEPS,
    FlightCase,
    bound_rmse,
    path_information,
    velocities,
)
from elusive.experiments.jiang2024.table import PAPER, bound_of, samples_for
from elusive.experiments.jiang2024.trial import ESTIMATORS, trial

# of a NumPy prototype with other random numbers, 100 runs
ITERATED = {
    "cv": (0.53, 1.46, 3.23, 4.12, 5.00),
    "ca": (0.47, 1.36, 2.94, 3.64, 4.31),
    "ctrv": (0.62, 1.82, 4.42, 5.71, 7.01),
}
SMOOTHED = {
    "cv": (0.48, 1.28, 2.88, 3.68, 4.49),
    "ca": (0.40, 1.07, 2.34, 2.91, 3.46),
    "ctrv": (0.54, 1.57, 3.90, 5.06, 6.21),
}
BATCH = {
    "cv": (0.46, 1.26, 2.80, 3.57, 4.35),
    "ca": (0.39, 1.07, 2.33, 2.89, 3.43),
    "ctrv": (0.53, 1.54, 3.76, 4.87, 5.98),
}
BOUND = {
    "cv": (0.47, 1.25, 2.61, 3.28, 3.97),
    "ca": (0.39, 1.08, 2.27, 2.81, 3.32),
}
DEVIATIONS = 3.5
RUNS = 400


@pytest.mark.parametrize("motion", STEPS)
def test_a_flight_is_the_papers(motion):
    case = FlightCase(motion=motion, sigma_deg=1e-6, samples=1)
    flight = case.simulate(np.random.default_rng(1))
    assert flight.states.shape == (STEPS[motion], 4)
    places = np.array([[0.0, 0.0], [70.0, 12.0], [-60.0, 81.0]])
    east, north = (flight.states[:, None, [0, 2]] - places).transpose(2, 0, 1)
    np.testing.assert_allclose(np.exp(1j * flight.azimuth_rad), np.exp(1j * np.arctan2(east, north)), atol=1e-6)
    steps = np.diff(flight.states[:, [0, 2]], axis=0) - velocities(motion)[1:]
    assert steps.std() == pytest.approx(0.5, rel=0.3)


def test_velocities_are_those_of_the_equations():
    np.testing.assert_allclose(velocities("cv"), 10.0)
    np.testing.assert_allclose(velocities("ca")[[0, 69]], [[0.2, 0.2], [7.1, 7.1]])
    turn = velocities("ctrv")
    np.testing.assert_allclose(np.hypot(*turn.T), 10 * np.sqrt(2))
    np.testing.assert_allclose(np.degrees(np.arctan2(turn[0, 1], turn[0, 0])), 19.0)
    np.testing.assert_allclose(np.degrees(np.arctan2(turn[-1, 1], turn[-1, 0])), 43.0)


@pytest.mark.parametrize("motion", BOUND)
def test_the_bound_is_the_prototypes(motion):
    for sigma, value in zip(SIGMAS_DEG, BOUND[motion], strict=True):
        assert bound_of(FlightCase(motion=motion, sigma_deg=sigma)) == pytest.approx(value, rel=0.01, abs=0.005)


def test_the_bound_hardly_depends_on_the_paths_drawn_and_falls_with_the_noise():
    case = FlightCase(sigma_deg=1.0)
    few, many = (bound_rmse(path_information("cv", np.random.default_rng(seed), 50), case) for seed in (1, 2))
    assert few == pytest.approx(many, rel=0.02)
    assert bound_of(case.replace(sigma_deg=0.1)) < 0.2 * bound_of(case)


def test_the_samples_at_which_the_papers_row_is_possible():
    samples = samples_for("cv", 5.0, PAPER["cv"]["fg-eks"][1])
    assert 500 < samples < 5000
    case = FlightCase(sigma_deg=5.0, samples=round(samples))
    assert bound_of(case) == pytest.approx(0.51, rel=0.01)
    assert np.isnan(samples_for("cv", 5.0, np.nan))


def test_a_trial_measures_all_estimators():
    case = FlightCase(motion="ctrv", sigma_deg=5.0)
    found = trial(case, np.random.default_rng(3))
    again = trial(case, np.random.default_rng(3))
    off = found["estimate"] - found["truth"]
    np.testing.assert_allclose(found["mean_square"], (off**2).sum(axis=-1).mean(axis=-1))
    np.testing.assert_array_equal(found["estimate"], again["estimate"])
    assert off.shape == (len(ESTIMATORS), STEPS["ctrv"], 2)
    assert (found["nees"] > 0).all()


@pytest.mark.validate
def test_reproduced_from_the_command_line(tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["reproduce", "jiang2024", "--trials", "3", "--out", str(tmp_path)])
    assert not stop.value.code
    said = capsys.readouterr()
    assert "3 runs" in said.out
    with (tmp_path / "table1.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 5 * len(ESTIMATORS)
    assert {"motion", "sigma_deg", "filter", "rmse_m", "standard_error", "paper_m", "bound_m"} <= rows[0].keys()
    eks = next(row for row in rows if row["filter"] == "fg-eks")
    assert (eks["motion"], eks["sigma_deg"], eks["paper_m"]) == ("cv", "1", "0.15")
    assert all((tmp_path / f"{name}.png").stat().st_size > 20_000 for name in TARGETS if name.startswith("fig"))


@pytest.mark.thorough
def test_a_figure_alone_needs_its_motion_alone(tmp_path):
    done = reproduce(tmp_path, ["fig3"], trials=2)
    assert done.written == ["fig3.png"]
    assert done.cells == []
    assert [path.name for path in tmp_path.glob("*.zarr")] == ["campaign-ca-2-seed2024.zarr"]
    with pytest.raises(ParameterError, match="'fig9': jiang2024 has no such table or figure; known are fig2"):
        reproduce(tmp_path, ["fig9"])


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return reproduce(tmp_path_factory.mktemp("table"), ["table1"], trials=RUNS).cells


@pytest.mark.validate
@pytest.mark.parametrize("motion", STEPS)
def test_rows_of_the_table(table, motion):
    """Against the prototype by 3.5 standard errors of the difference, and against the bound and the paper's EKF."""
    cells = {(cell.sigma_deg, cell.filter): cell for cell in table if cell.motion == motion}
    for column, sigma in enumerate(SIGMAS_DEG):
        for name, rows in (("iekf", ITERATED), ("rts", SMOOTHED), ("map", BATCH)):
            cell, value = cells[sigma, name], rows[motion][column]
            assert cell.rmse_m == pytest.approx(value, abs=DEVIATIONS * np.sqrt(1 + RUNS / 100) * cell.standard_error)
        batch = cells[sigma, "map"]
        assert batch.rmse_m < PAPER[motion]["fg-ekf"][column] + 0.005
        assert batch.rmse_m > batch.bound_m - DEVIATIONS * batch.standard_error
        for name in ("rts", "map"):
            if sigma <= 5:
                assert cells[sigma, name].nees == pytest.approx(
                    2, abs=DEVIATIONS * cells[sigma, name].nees_standard_error
                )
        assert cells[sigma, "fg-eks"].nees > cells[sigma, "fg-ekf"].nees > 3
