"""Reproducing Bootsveld (2012): what is written, refused, and the same from one worker and from two."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from elusive.campaign import make_executor, open_campaign
from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.bootsveld2012 import clouds, curves, influence, maps, partitions, ways
from elusive.experiments.bootsveld2012.case import CANAL_METHODS, PORT_METHODS, scenery
from elusive.experiments.bootsveld2012.clouds import TRAIL_S, cloud
from elusive.experiments.bootsveld2012.reproduce import TARGETS, Settings, reproduce
from elusive.experiments.bootsveld2012.runtimes import METHODS, run_times
from elusive.experiments.bootsveld2012.trial import trial

FEW = Settings(trials=3, particles=120, estimate="mean")


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def visible(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def is_drawn(path: Path) -> bool:
    with Image.open(path) as image:
        grey = np.asarray(image.convert("L"))
    return grey.shape[0] > 400 and bool(0.005 < (grey < 245).mean() < 0.999) and grey.std() > 5


def test_the_targets_are_the_thesis_figures_in_its_order() -> None:
    assert [t for t in TARGETS if t[0] == "a"] == [f"a{number}" for number in range(1, 20)]
    assert [t for t in TARGETS if t[0] == "b"] == [f"b{number}" for number in range(1, 25)]
    chapters = {5: (1, 2, 3, 4), 6: (1, 2, 3, 4, 5, 6, 7, 8, 9), 7: (1, 2, 3)}
    figures = [f"fig{chapter}_{number}" for chapter, numbers in chapters.items() for number in numbers]
    assert [t for t in TARGETS if t.startswith("fig")] == figures
    assert TARGETS[-4:] == ("coast", "phases", "runtimes", "imprecise")
    rooms = (curves, clouds, influence, maps, partitions, ways)
    assert {name for room in rooms for name in room.FIGURES} == {*TARGETS[:-4]}


@pytest.mark.validate
def test_curves_are_the_runs_means_and_deviations_and_do_not_depend_on_the_workers(tmp_path: Path) -> None:
    targets = ["a12", "a13"]
    done = reproduce(tmp_path / "one", targets, FEW)
    with make_executor(2) as executor:
        reproduce(tmp_path / "two", targets, FEW, executor=executor)
    store = "campaign-canal-imprecise-sigma7-mean-3-seed2012.zarr"
    assert visible(tmp_path / "one") == sorted(["a12.csv", "a12.png", "a13.csv", "a13.png", "summary.csv", store])
    assert done.written == ["a12.csv", "a12.png", "a13.csv", "a13.png", "summary.csv"]
    for name in done.written:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    results = open_campaign(tmp_path / "one" / store).load()
    assert results["error"].shape == (3, len(CANAL_METHODS), 1, 101, 2)
    for name, reduced in (("a12", np.mean), ("a13", lambda v, axis: np.std(v, axis=axis, ddof=1))):
        expected = reduced(results["error"].values[:, :, 0, :, 0], axis=0)
        table = rows_of(tmp_path / "one" / f"{name}.csv")
        assert list(table[0]) == ["time_s", "method", "value_m", "standard_error_m"]
        for number, method in enumerate(CANAL_METHODS):
            found = [float(row["value_m"]) for row in table if row["method"] == method]
            np.testing.assert_allclose(found, expected[number], rtol=1e-3, atol=1e-9)
        assert is_drawn(tmp_path / "one" / f"{name}.png")
    # the campaign's trial 1 is the run of its own number
    alone = trial(FEW.case("canal-imprecise"), np.random.default_rng(np.random.SeedSequence(2012, spawn_key=(1,))))
    np.testing.assert_array_equal(results["error"].values[1], alone["error"])
    summary = rows_of(tmp_path / "one" / "summary.csv")
    squares = (results["error"].values[:, :, 0, 9:] ** 2).sum(axis=-1)
    np.testing.assert_allclose([float(row["rmse_m"]) for row in summary], np.sqrt(squares.mean(axis=(0, 2))), rtol=1e-3)
    inside = (results["apart"].values[:, :, 9:] <= 9.2103).mean(axis=(0, 2))
    np.testing.assert_allclose([float(row["inside"]) for row in summary], inside, rtol=1e-3)
    assert {row["runs"] for row in summary} == {"3"}


def test_at_the_port_one_run_is_enough_for_its_errors(tmp_path: Path) -> None:
    reproduce(tmp_path, ["b3", "b4"], FEW)
    store = "campaign-port-imprecise-sigma5-mean-1-seed2012.zarr"
    assert visible(tmp_path) == sorted(["b3.csv", "b3.png", "b4.csv", "b4.png", store])
    errors = open_campaign(tmp_path / store).load()["error"].values
    for axis, name in enumerate(("b3", "b4")):
        table = rows_of(tmp_path / f"{name}.csv")
        found = [float(row["value_m"]) for row in table if row["method"] == "grid"]
        np.testing.assert_allclose(found, errors[0, PORT_METHODS.index("grid"), 0, :, axis], rtol=1e-3, atol=1e-9)
        assert {row["standard_error_m"] for row in table} == {""}


def test_a_cloud_is_the_first_run_of_the_campaign() -> None:
    case = FEW.case("canal-coast")
    at = cloud(case, "hard", 40, seed=2012)
    found = trial(case, np.random.default_rng(np.random.SeedSequence(2012, spawn_key=(0,))))
    mean = found["error"][case.methods.index("hard"), 0, 39] + scenery(case).truth[40, [0, 2]]
    deviation = found["deviation"][case.methods.index("hard"), 39]
    assert at.particles.shape == (120, 2)
    assert np.all(np.abs(at.particles.mean(axis=0) - mean) < 4 * deviation / np.sqrt(120))
    assert at.particles[:, 0].min() >= -25.0
    assert at.modes.shape == (TRAIL_S + 1, 2)
    assert np.all(np.abs(at.plot - scenery(case).truth[40, [0, 2]]) < 5 * 10.2)


@pytest.mark.validate
def test_clouds_influence_and_maps_are_drawn(tmp_path: Path) -> None:
    alone = ["b2", "fig7_1", "fig7_3"]
    targets = ["a9", "a19", "coast", *influence.FIGURES, *maps.FIGURES, "fig5_1", "fig6_1", *alone]
    done = reproduce(tmp_path, targets, FEW._replace(sigma_m=20.0))
    tables = {f"{name}.csv" for name in influence.FIGURES}
    tables |= {f"{name}.csv" for name in alone}
    assert {*done.written} == {f"{name}.png" for name in targets} | tables
    for name in targets:
        assert is_drawn(tmp_path / f"{name}.png"), name
    peaks = {(row["mean_m"], row["chart"], row["sigma_m"]): row["map_m"] for row in rows_of(tmp_path / "fig5_4.csv")}
    assert peaks == {
        ("-26", "imprecise", "7"): "-23.592",
        ("-26", "imprecise", "20"): "-25.024",
        ("-26", "hard", "0"): "-25.000",
    }
    middle = min(rows_of(tmp_path / "fig6_3.csv"), key=lambda row: abs(float(row["x_m"])))
    np.testing.assert_allclose([float(value) for value in middle.values()], [0, 0.478, 0.691, 0.383], atol=1e-3)


@pytest.mark.thorough
def test_run_times_are_told_of_every_method() -> None:
    case = FEW._replace(sigma_m=60.0).case("port-imprecise")
    rows = run_times(case, 2012, enough_s=0.05)
    assert [row.method for row in rows] == list(METHODS)
    assert {row.steps for row in rows} == {110}
    by_name = {row.method: row for row in rows}
    assert by_name["nearest edge of all"].steps_timed < 110
    assert by_name["nearest edge of all"].chart_s > 5 * by_name["nearest edge within 3 s"].chart_s
    assert by_name["nearest edge of all"].chart_s < by_name["nearest edge of all"].run_s
    assert by_name["no chart"].megabytes == by_name["no chart"].prepare_s == by_name["no chart"].chart_s == 0
    grid, field = by_name["grid, cells of .2 s"], by_name["field"]
    cells = 10_000 * 9000 / 12**2  # and six deviations all round
    assert 4e-6 * cells < grid.megabytes < 8e-6 * cells
    assert field.megabytes < 10
    assert by_name["nearest edge of all"].thesis == "6 hours"


@pytest.mark.parametrize(
    ("targets", "settings", "said"),
    [
        (["a4", "a20"], FEW, "'a20': bootsveld2012 has no such figure; known are a1, a2, "),
        (["imprecise"], FEW, "imprecise: needs two charts; give a fine and a coarse one."),
        (["a4"], FEW._replace(fine=Path("x.000")), "imprecise: needs two charts; give a fine and a coarse one."),
        (["a4"], FEW._replace(estimate="median"), "estimate: 'median' is none of mean, map, marginal."),
        (["a4"], FEW._replace(sigma_m=-1.0), "sigma_m"),
        (["b7"], FEW._replace(shoreline=Path("nowhere.geojson")), "nowhere.geojson"),
    ],
)
def test_what_cannot_be_reproduced_is_refused_in_a_sentence(
    targets: list[str], settings: Settings, said: str, tmp_path: Path
) -> None:
    with pytest.raises((ParameterError, DataError), match=said.replace(".", r"\.")):
        reproduce(tmp_path / "out", targets, settings)
    assert visible(tmp_path) == []


def test_a_fault_while_drawing_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(folder: Path, *rest: Any) -> None:
        (folder / "fig5_3.png").write_bytes(b"half")
        raise DataError("the disk is full")

    monkeypatch.setattr("elusive.experiments.bootsveld2012.influence.draw_influence", fails)
    with pytest.raises(DataError, match="the disk is full"):
        reproduce(tmp_path, ["fig5_3"], FEW)
    assert visible(tmp_path) == []


def test_the_command_shows_its_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    command = ["reproduce", "bootsveld2012", "a6", "phases", "--trials", "2", "--particles", "100"]
    with pytest.raises(SystemExit) as end:
        main([*command, "--estimate", "mean", "--sigma-m", "20", "--out", str(tmp_path)])
    assert not end.value.code
    said = capfd.readouterr()
    assert "canal-coast, interval" in said.out
    assert said.out.count("±") == len(CANAL_METHODS) + 12
    assert "t = 100 s, 12.4 m inland, interval" in said.out
    assert "Written to" in said.err
    assert {"a6.csv", "phases.csv", "summary.csv"} < {*visible(tmp_path)}
    with pytest.raises(SystemExit) as end:
        main([*command, "imprecise", "--out", str(tmp_path / "other")])
    assert end.value.code == 2
    assert "imprecise: needs two charts" in capfd.readouterr().err
    assert not (tmp_path / "other").exists()
