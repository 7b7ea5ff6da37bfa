"""Reproducing the paper: what is written, what is refused, and going on after a stop."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elusive.campaign import Progress
from elusive.errors import DataError, ParameterError
from elusive.experiments.amrouche2018.figures import FIGURES
from elusive.experiments.amrouche2018.reproduce import reproduce
from elusive.experiments.amrouche2018.scenario import APPEARS, FRAMES, LEAVES, START, WeakTarget
from elusive.metrics import rmse_over_window

COLUMNS = [
    "motion",
    "snr_db",
    "filter",
    "trials",
    "existence_10_24",
    "existence_10_24_se",
    "existence_26_27",
    "existence_26_27_se",
    "rmse_10_24",
    "rmse_10_24_se",
]
FILTERS = [
    "paper",
    "paper-bright",
    "paper-measurement",
    "bernoulli-uniform",
    "bernoulli-measurement",
    "bernoulli-smoothed",
    "near-optimal",
]


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        rows = list(reader)
    assert reader.fieldnames == COLUMNS
    return rows


def check_picture(path: Path) -> None:
    with Image.open(path) as image:
        grey = np.asarray(image.convert("L"))
    assert grey.shape[0] > 400
    assert grey.shape[1] > 800
    assert 0.005 < (grey < 250).mean() < 0.9  # something is drawn, and not over everything


def visible(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.validate
def test_all_figures_and_the_table(tmp_path: Path) -> None:
    reports: list[Progress] = []
    cells = reproduce(tmp_path / "new" / "out", trials=2, on_progress=reports.append)
    written = visible(tmp_path / "new" / "out")
    assert written == ["campaign-cv-ct-7x2-seed2018.zarr", *sorted(f"{name}.png" for name in FIGURES), "summary.csv"]
    assert set(FIGURES) == {f"fig{number}" for number in range(1, 9)}
    for name in FIGURES:
        check_picture(tmp_path / "new" / "out" / f"{name}.png")
    rows = table(tmp_path / "new" / "out" / "summary.csv")
    keys = [(row["motion"], float(row["snr_db"]), row["filter"]) for row in rows]
    assert keys == [(m, snr_db, name) for m in ("cv", "ct") for name in FILTERS for snr_db in (3.18, 6.71, 12.0)]
    for row, cell in zip(rows, cells, strict=True):
        assert row["trials"] == "2"
        for name in COLUMNS[4:]:
            assert float(row[name]) == pytest.approx(getattr(cell, name), rel=5e-4)  # four digits
    assert reports[-1].done == reports[-1].total == 2 * len(rows)


def test_a_named_figure_runs_only_what_it_shows(tmp_path: Path) -> None:
    cells = reproduce(tmp_path, ["fig7"], trials=2)
    assert visible(tmp_path) == ["campaign-ct-2x2-seed2018.zarr", "fig7.png", "summary.csv"]
    assert {(cell.motion, cell.filter) for cell in cells} == {("ct", "paper"), ("ct", "bernoulli-measurement")}
    assert len(table(tmp_path / "summary.csv")) == 6


@pytest.mark.thorough
def test_the_summary_is_of_the_frames_it_says(tmp_path: Path) -> None:
    from elusive.campaign import open_campaign

    cells = reproduce(tmp_path, ["fig2"], trials=6)
    results = open_campaign(next(tmp_path.glob("*.zarr"))).load()
    for cell in cells:
        at = results.sel(motion=cell.motion, snr_db=cell.snr_db, filter=cell.filter)
        existence = at["existence"].values
        during = np.array([[trial[k - 1] for k in range(10, 25)] for trial in existence]).mean(axis=1)
        after = np.array([[trial[25], trial[26]] for trial in existence]).mean(axis=1)
        assert cell.existence_10_24 == pytest.approx(during.mean())
        assert cell.existence_10_24_se == pytest.approx(during.std(ddof=1) / np.sqrt(6))
        assert cell.existence_26_27 == pytest.approx(after.mean())
        assert cell.existence_26_27_se == pytest.approx(after.std(ddof=1) / np.sqrt(6))
        error = (at["estimate"] - at["truth"]).values[:, 9:24]
        rmse = np.sqrt((error**2).sum(axis=2).mean(axis=0)).mean()
        assert cell.rmse_10_24 == pytest.approx(rmse)
        assert cell.rmse_10_24_se == pytest.approx(rmse_over_window(error).standard_error)
        assert cell.rmse_10_24_se > 0


def test_unknown_figures_are_named_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"^'fig9': amrouche2018 has no such figure; known are fig1, .*fig8\.$"):
        reproduce(tmp_path / "out", ["fig2", "fig9"], trials=2)
    assert visible(tmp_path) == []


def test_out_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(DataError, match="out: is a file; give the name of a folder"):
        reproduce(tmp_path / "out", ["fig2"], trials=2)
    with pytest.raises(DataError, match="cannot be written"):
        reproduce(tmp_path / "out" / "inner", ["fig2"], trials=2)
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.thorough
def test_stopped_and_started_again_it_goes_on_to_the_same_files(tmp_path: Path) -> None:
    def stop(progress: Progress) -> None:
        if progress.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reproduce(tmp_path / "stopped", ["fig5"], trials=6, on_progress=stop)
    assert not (tmp_path / "stopped" / "summary.csv").exists()
    reports: list[Progress] = []
    reproduce(tmp_path / "stopped", ["fig5"], trials=6, on_progress=reports.append)
    assert 0 < reports[0].done < reports[0].total  # what was done is not done again
    reproduce(tmp_path / "whole", ["fig5"], trials=6)
    assert visible(tmp_path / "stopped") == visible(tmp_path / "whole")
    for name in ("summary.csv", "fig5.png"):
        assert (tmp_path / "stopped" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize("motion", ["cv", "ct"])
def test_the_scenario_is_the_papers(motion: str) -> None:
    scenario = WeakTarget(motion=motion, snr_db=12.0)
    recording = scenario.simulate(np.random.default_rng(1))
    assert recording.frames.shape == (30, 20, 20) == (FRAMES, 20, 20)
    here = np.isfinite(recording.truth[:, 0])
    assert np.flatnonzero(here).tolist() == list(range(5, 24)) == list(range(APPEARS - 1, LEAVES))
    np.testing.assert_array_equal(recording.present, here)
    np.testing.assert_array_equal(recording.truth[5, :4], START)
    assert recording.truth[5, 4] == pytest.approx(36.77, abs=0.01)  # the intensity of 12 dB
    noise = recording.frames[~here]
    assert noise.std() == pytest.approx(3.0, abs=4 * 3.0 / np.sqrt(2 * noise.size))
    turned = np.unwrap(np.arctan2(recording.truth[here, 3], recording.truth[here, 1]))
    expected = np.deg2rad(6.0) * 18 if motion == "ct" else 0.0
    # eighteen steps of white acceleration, power .001, across a speed of .515
    assert turned[-1] - turned[0] == pytest.approx(expected, abs=4 * np.sqrt(0.018) / np.hypot(0.45, 0.25))


def test_a_deviation_in_the_filter_is_a_deviation_in_the_table() -> None:
    """The trial uses the filter it is asked for: each row of the table has its own parts."""
    from elusive.experiments.amrouche2018.trial import WeakTargetTrial

    built = {name: WeakTargetTrial(filter=name, snr_db=3.18).build() for name in FILTERS}
    assert {name: (model.kind, model.birth.kind, model.particles) for name, model in built.items()} == {
        "paper": ("existence", "uniform", 2000),
        "paper-bright": ("existence", "bright", 2000),
        "paper-measurement": ("existence", "measurement", 2000),
        "bernoulli-uniform": ("single", "uniform", 1500),
        "bernoulli-measurement": ("single", "measurement", 1500),
        "bernoulli-smoothed": ("single", "measurement", 1500),
        "near-optimal": ("single", "measurement", 20_000),
    }
    assert [built[name].newborns for name in FILTERS[3:]] == [500, 500, 500, 20_000]
    assert [built[name].spread_within for name in FILTERS[3:]] == [0.0, 0.0, None, 0.0]
    assert all(model.birth.snr_db == 3.18 for model in built.values())
    assert all(model.birth_probability == model.death_probability == 0.05 for model in built.values())
