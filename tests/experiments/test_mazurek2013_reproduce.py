"""Reproducing Mazurek (2013): the scenario, each search against NumPy, what is written, refused and gone on with."""

from __future__ import annotations

import csv
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elusive.campaign import Progress, open_campaign
from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.mazurek2013.figures import BIN_EDGES, CHANCE_LEVEL, FIGURES
from elusive.experiments.mazurek2013.reproduce import reproduce
from elusive.experiments.mazurek2013.scenario import NoiseObjectCase
from elusive.experiments.mazurek2013.table import CHECK, METHODS, SIGMAS
from elusive.experiments.mazurek2013.trial import METHODS as EVERY_METHOD
from elusive.experiments.mazurek2013.trial import NoiseObjectTrial, trial
from tests.experiments.transitions import transition
from tests.longer import longer
from tests.reference.waveform import accumulated

COLUMNS = ["object_size", "window", "smoothing", "statistic", "background_sigma", "mean_error", "standard_error"]
PAPER = {
    "fig3": (3, 0.95),
    "fig4": (3, 0.98),
    "fig5": (5, 0.95),
    "fig6": (5, 0.98),
    "fig7": (7, 0.95),
    "fig8": (7, 0.98),
}


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def visible(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.parametrize("border", longer(["circular", "bounded"], "bounded"))
def test_the_scenario_is_the_papers(border: str) -> None:
    scenario = NoiseObjectCase(object_size=5, border=border)
    cases = [scenario.simulate(np.random.default_rng(seed)) for seed in range(150)]
    assert {case.frames.shape for case in cases} == {(80, 1200)}
    assert {case.velocity for case in cases} == set(range(11))
    sigmas = np.array([case.background_sigma for case in cases])
    assert 0.1 <= sigmas.min() < 0.2
    assert 2.9 < sigmas.max() <= 3.0
    assert sigmas.mean() == pytest.approx(1.55, abs=4 * 2.9 / np.sqrt(12 * 150))
    inside, outside = [], []
    for case in cases:
        steps = np.diff(case.positions)
        np.testing.assert_array_equal(steps % 1200 if border == "circular" else steps, case.velocity)
        assert case.positions.min() >= (0 if border == "circular" else 2)
        assert case.positions.max() <= (1199 if border == "circular" else 1197)
        at = (case.positions[:, None].astype(int) + np.arange(-2, 3)) % 1200
        covered = np.zeros((80, 1200), dtype=bool)
        np.put_along_axis(covered, at, values=True, axis=1)
        inside.append((case.frames[covered] ** 2).mean() - case.background_sigma**2)
        outside.append((case.frames[~covered] ** 2).mean() / case.background_sigma**2)
    # the object adds a variance of one: 400 samples a case, each square with deviation sqrt 2 (s^2 + 1)
    error = np.sqrt(np.mean(2 * (sigmas**2 + 1) ** 2) / 400 / 150)
    assert np.mean(inside) == pytest.approx(1.0, abs=4 * error)
    assert np.mean(outside) == pytest.approx(1.0, abs=4 * np.sqrt(2 / (150 * 80 * 1195)))


def test_starts_cover_what_the_border_leaves() -> None:
    scenario = NoiseObjectCase(object_size=4, samples=40, iterations=4, max_velocity=3, border="bounded")
    cases = [scenario.simulate(np.random.default_rng(seed)) for seed in range(1500)]
    for velocity in range(4):
        starts = {case.positions[0] for case in cases if case.velocity == velocity}
        assert starts == set(range(2, 39 - 3 * velocity))  # the first and last sample are covered, none beyond
    around = [NoiseObjectCase(samples=20, iterations=2).simulate(np.random.default_rng(s)) for s in range(300)]
    assert {case.positions[0] for case in around} == set(range(20))
    assert NoiseObjectCase(samples=20).distance(1, 19) == 2
    assert NoiseObjectCase(samples=20, border="bounded", iterations=1).distance(1, 19) == 18
    with pytest.raises(ParameterError, match="samples: an object needs 795 of them"):
        NoiseObjectCase(samples=794, border="bounded")


def test_cases_differ_in_nothing_but_the_background() -> None:
    one, other = (
        NoiseObjectCase(background_deviation=sigma, object_deviation=1e-12).simulate(np.random.default_rng(3))
        for sigma in (0.5, 2.0)
    )
    np.testing.assert_array_equal(one.positions, other.positions)
    np.testing.assert_allclose(4 * one.frames, other.frames, atol=1e-9)


@pytest.mark.parametrize(
    "method", [*((name, w) for name in ("dot", "std", "chi2", "llr") for w in (3, 7)), ("dot-similar", 5)]
)
def test_every_search_ends_where_numpy_does(method: tuple[str, int]) -> None:
    small = {"samples": 150, "iterations": 25, "max_velocity": 3}
    for seed in range(4):
        case = NoiseObjectCase(**small).simulate(np.random.default_rng(seed))
        model = NoiseObjectTrial(**small, methods=(method,), smoothings=(0.9, 0.98))
        found = trial(model, np.random.default_rng(seed))
        assert found["background_sigma"] == case.background_sigma
        for smoothing, errors in zip((0.9, 0.98), found["error"], strict=True):
            P = accumulated(case.frames, *method, smoothing, range(4)).max(axis=0)
            # the filter sums in single precision: cells within its rounding of the best may stand for it
            best = np.flatnonzero(P.max() - P < 1e-5 * P.std())
            apart = np.abs(best - case.positions[-1])
            assert errors.tolist()[0] in np.minimum(apart, 150 - apart).tolist()


@pytest.mark.validate
def test_all_figures_and_the_table(tmp_path: Path) -> None:
    reports: list[Progress] = []
    done = reproduce(tmp_path / "new" / "out", trials=2, on_progress=reports.append)
    out = tmp_path / "new" / "out"
    assert visible(out) == sorted(
        ["campaign-size3-size5-size7-alpha0.95-alpha0.98-2-seed2013.zarr", "campaign-table-2-seed2013.zarr"]
        + [f"{name}.{kind}" for name in PAPER for kind in ("csv", "png")]
        + ["table.csv", "boundaries.csv", "boundaries.png"]
    )
    assert {name: tuple(figure) for name, figure in FIGURES.items()} == PAPER
    results = open_campaign(out / "campaign-size3-size5-size7-alpha0.95-alpha0.98-2-seed2013.zarr").load()
    for name, (size, smoothing) in PAPER.items():
        with Image.open(out / f"{name}.png") as image:
            grey = np.asarray(image.convert("L"))
        assert grey.shape[0] > 700
        assert 0.005 < (grey < 250).mean() < 0.9  # something is drawn, and not over everything
        rows = rows_of(out / f"{name}.csv")
        assert list(rows[0]) == COLUMNS
        assert {(int(row["object_size"]), float(row["smoothing"])) for row in rows} == {(size, smoothing)}
        assert {(row["statistic"], int(row["window"])) for row in rows} == set(EVERY_METHOD)
        # every case stands in the one bin that its background lies in
        sigmas = results["background_sigma"].sel(object_size=size).values
        errors = results["error"].sel(object_size=size).values[:, (0.95, 0.98).index(smoothing)]
        for row in rows:
            number = EVERY_METHOD.index((row["statistic"], int(row["window"])))
            near = np.abs(sigmas - float(row["background_sigma"])) <= 0.0726
            assert near.any()
            assert float(row["mean_error"]) == pytest.approx(errors[near, number].mean(), rel=5e-4)
            if near.sum() == 1:
                assert row["standard_error"] == ""
            else:
                expected = errors[near, number].std(ddof=1) / np.sqrt(near.sum())
                assert float(row["standard_error"]) == pytest.approx(expected, rel=5e-4)
        assert len(rows) == len(EVERY_METHOD) * len({int(np.digitize(sigma, BIN_EDGES)) for sigma in sigmas})
    table = rows_of(out / "table.csv")
    assert len(table) == len(CHECK) * len(SIGMAS) == 66 == len(done.cells)
    assert [row["check"] for row in table[:6]] == ["0", "0", "79", "202", "266", "285"]
    assert {row["trials"] for row in table} == {"2"}
    fixed = open_campaign(out / "campaign-table-2-seed2013.zarr").load()
    for row in table:
        at = (
            fixed["error"]
            .sel(object_size=int(row["object_size"]), background_deviation=float(row["background_sigma"]))
            .values[
                :, (0.95, 0.98).index(float(row["smoothing"])), METHODS.index((row["statistic"], int(row["window"])))
            ]
        )
        assert float(row["mean_error"]) == pytest.approx(at.mean(), rel=5e-4)
    assert reports[-1].done == reports[-1].total == 2 * 18
    assert CHANCE_LEVEL == 300


@pytest.mark.thorough
def test_a_named_target_runs_only_what_it_shows(tmp_path: Path) -> None:
    done = reproduce(tmp_path, ["fig6"], trials=2)
    assert visible(tmp_path) == ["campaign-size5-alpha0.98-2-seed2013.zarr", "fig6.csv", "fig6.png"]
    assert done.cells == []
    assert list(done.curves) == ["fig6"]


def test_unknown_targets_are_named_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = "'fig2': mazurek2013 has no such figure; known are fig3, fig4, fig5, fig6, fig7, fig8, table, boundaries."
    with pytest.raises(ParameterError, match=said):
        reproduce(tmp_path / "out", ["fig3", "fig2"], trials=2)
    monkeypatch.setenv("COLUMNS", "300")
    with pytest.raises(SystemExit) as end:
        main(["reproduce", "mazurek2013", "fig3", "fig2", "--out", str(tmp_path / "out")])
    assert end.value.code == 2
    assert said in capsys.readouterr().err
    assert visible(tmp_path) == []


def test_out_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(DataError, match="out: is a file; give the name of a folder"):
        reproduce(tmp_path / "out", ["fig3"], trials=2)
    with pytest.raises(DataError, match="cannot be written"):
        reproduce(tmp_path / "out" / "inner", ["fig3"], trials=2)
    assert (tmp_path / "out").read_text() == "mine"


def test_a_fault_while_drawing_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(path: Path, *rest: Any) -> None:
        path.write_bytes(b"half")
        raise DataError("the disk is full")

    monkeypatch.setattr("elusive.experiments.mazurek2013.reproduce.draw", fails)
    with pytest.raises(DataError, match="the disk is full"):
        reproduce(tmp_path, ["fig3"], trials=2)
    assert visible(tmp_path) == ["campaign-size3-alpha0.95-2-seed2013.zarr"]


@pytest.mark.validate
def test_stopped_between_two_threads_it_goes_on_in_one_to_the_same_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A case depends on its number alone: not on who runs it, how many there are, or which figures are drawn."""
    stopped, whole = tmp_path / "stopped", tmp_path / "whole"
    monkeypatch.setattr("elusive.experiments.mazurek2013.reproduce.CHUNK", 2)

    def stop(progress: Progress) -> None:
        if progress.done:
            raise KeyboardInterrupt

    with ThreadPoolExecutor(2) as pair, pytest.raises(KeyboardInterrupt):
        reproduce(stopped, ["fig3"], trials=6, executor=pair, on_progress=stop)
    assert visible(stopped) == ["campaign-size3-alpha0.95-6-seed2013.zarr"]
    reports: list[Progress] = []
    reproduce(stopped, ["fig3"], trials=6, on_progress=reports.append)
    assert 0 < reports[0].done < reports[0].total  # what was done is not done again
    reproduce(whole, ["fig3", "fig4"], trials=6)
    for name in ("fig3.csv", "fig3.png"):
        assert (stopped / name).read_bytes() == (whole / name).read_bytes()
    assert (whole / "fig3.csv").read_bytes() != (whole / "fig4.csv").read_bytes()


@pytest.mark.validate
def test_another_seed_draws_other_cases(tmp_path: Path) -> None:
    for seed in (1, 2):
        reproduce(tmp_path / str(seed), ["fig3"], trials=2, seed=seed)
    assert (tmp_path / "1" / "fig3.csv").read_bytes() != (tmp_path / "2" / "fig3.csv").read_bytes()


@pytest.mark.thorough
def test_the_command_shows_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    with pytest.raises(SystemExit) as end:
        main(["reproduce", "mazurek2013", "table", "--trials", "2", "--out", str(tmp_path)])
    assert not end.value.code
    said = capfd.readouterr()
    assert "size 5, dot, window 13, 0.98" in said.out
    assert said.out.count("±") == 66
    assert "table.csv" in said.err


@pytest.mark.parametrize(
    ("errors", "expected"),
    [([0, 100, 200, 300], 1.5), ([200, 300, 300, 300], 0.0), ([0, 0, 0, 149], np.nan), ([0, 150, 0, 300], 1.0)],
)
def test_transition_is_where_half_the_chance_level_is_first_reached(errors: list[float], expected: float) -> None:
    np.testing.assert_equal(transition(np.arange(4.0), np.array(errors, dtype=float)), expected)


@pytest.mark.thorough
def test_boundaries_at_the_quartiles_are_next_to_chance(tmp_path: Path) -> None:
    done = reproduce(tmp_path, ["boundaries"])
    found = {(row.statistic, row.layout, row.outermost): row.contrast for row in done.boundaries}
    best = found["llr", "none", 0.0]
    # a window of five sums chi-squares: (E1 - E0) / sd0 = (u^2 / s^2 - 1) sqrt(5 / 2), the frame's own deviation for s
    assert best == pytest.approx(math.sqrt(5 / 2), abs=0.1)
    assert found["dot", "quartiles", 0.6745] < 0.2 * best
    assert found["chi2", "quartiles", 0.6745] < 0.2 * best
    assert found["dot", "two", 2.0] > 0.9 * best > found["dot", "five", 2.0]
    with Image.open(tmp_path / "boundaries.png") as image:
        assert image.width > 800
    assert len((tmp_path / "boundaries.csv").read_text().splitlines()) == 1 + len(done.boundaries)
