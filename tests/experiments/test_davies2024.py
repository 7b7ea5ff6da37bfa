"""Davies and Garcia-Fernandez (2024): scenes read, drawn anew and scored; the published scenes against their filter."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.davies2024.reproduce import reproduce, score_run
from elusive.experiments.davies2024.scene import read_scene
from elusive.metrics.set_distances import gospa
from elusive.metrics.target_table import sightings
from tests.experiments.field_scene import STEPS, write_scene
from tests.recordings import DATA

PUBLISHED = {1: 4.012, 2: 4.779}  # root mean square GOSPA of the authors' filter on these measurements [m]


def test_a_scene_is_read_and_drawn_anew(tmp_path):
    held = write_scene(tmp_path)
    scene = read_scene(tmp_path, 1)
    np.testing.assert_array_equal(scene.measurements, held["measurements"])
    np.testing.assert_array_equal(scene.places(3), held["truth"][:, [0, 2], 3])
    drawn = np.array([scene.drawn_anew(np.random.default_rng(seed)) for seed in range(300)])
    expected = scene.sensor.added(held["truth"][:, :, 2]).sum(axis=0)
    np.testing.assert_allclose(drawn[:, :, 2].mean(axis=0), expected, atol=4.5 / math.sqrt(300))


def test_a_run_is_scored_by_gospa(tmp_path):
    write_scene(tmp_path)
    scene = read_scene(tmp_path, 1)
    tracker = scene.tracker(200)
    scores = score_run(scene, tracker, scene.measurements[0], 5)
    state, rng = tracker.init(np.random.default_rng(5)), np.random.default_rng(5)
    for step in range(STEPS):
        state = tracker.step(state, float(step), scene.measurements[0][:, step], rng)
    found = np.array([t.mean[[0, 2]] for t in state.targets if t.existence > 0.5])
    truth, one = scene.places(STEPS - 1), np.zeros
    last = gospa(
        sightings(one(2, int), np.arange(2), truth), sightings(one(len(found), int), np.arange(len(found)), found), 5.0
    )
    assert scores.gospa2[-1] == pytest.approx(last.distance[0] ** 2)
    np.testing.assert_allclose(scores.localisation + 12.5 * (scores.missed + scores.false), scores.gospa2)


def test_the_command_writes_a_row_a_filter_and_the_figure(tmp_path):
    write_scene(tmp_path / "data", 1)
    write_scene(tmp_path / "data", 2)
    out = tmp_path / "results"
    command = ["reproduce", "davies2024", "--data", str(tmp_path / "data"), "--out", str(out)]
    with pytest.raises(SystemExit) as ended:
        main([*command, "--particles", "100", "--anew", "1"])
    assert not ended.value.code
    with (out / "summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    each = [("2", "superposed"), ("1", "superposed, noise drawn anew")]
    assert [(row["runs"], row["filter"]) for row in rows if "published" not in row["filter"]] == each * 2
    assert [row["scene"] for row in rows] == ["1"] * 3 + ["2"] * 3
    assert [float(row["rms_gospa"]) for row in rows[::3]] == [3.0, 3.0]
    assert list(rows[0])[2:] == [
        "runs", "rms_gospa", "localisation", "missed", "false", "seconds_per_step"
    ]  # fmt: skip
    assert {path.name for path in out.iterdir()} == {"summary.csv", "gospa.csv", "gospa.png"}


def test_what_is_no_scene_is_refused(tmp_path):
    with pytest.raises(DataError, match="name the folder"):
        read_scene(tmp_path, 1)
    write_scene(tmp_path, sensors_m=np.zeros((4, 2)))
    with pytest.raises(DataError, match="do not fit"):
        read_scene(tmp_path, 1)
    with pytest.raises(ParameterError, match="no such scene"):
        reproduce(tmp_path / "out", tmp_path, [3])


@pytest.mark.skipif(not (DATA / "superposed").is_dir(), reason="the published scenes are not here")
@pytest.mark.validate
@pytest.mark.parametrize("number", [1, 2])
def test_the_published_filter_is_beaten_on_its_own_measurements(number):
    scene = read_scene(DATA / "superposed", number)
    scores = [
        score_run(scene, scene.tracker(1000), readings, 2024 + run) for run, readings in enumerate(scene.measurements)
    ]
    published = math.sqrt(scene.published_gospa2.mean())
    assert published == pytest.approx(PUBLISHED[number], abs=5e-4)
    assert math.sqrt(np.mean([score.gospa2 for score in scores])) < 0.9 * published
