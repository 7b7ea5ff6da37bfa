"""A scene repeats itself from its file, and its run agrees with the chain and the scores it is made of."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.experiments.mendieta2017.trial import ChapterFour, trial
from elusive.geometry.areas import Area
from elusive.geometry.places import NamedPlace, along_path
from elusive.model import read_yaml
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.presets import first_simulation
from elusive.systems.links.scene import DrawnPath, LinkScene, coverage_of, radiate
from elusive.systems.links.scene_results import histogram, outcome_of, summary, tracks_csv
from elusive.systems.links.scene_run import run_link_scene, score_scene


@pytest.fixture(scope="module")
def small() -> LinkScene:
    first = first_simulation()
    walks = first.simulation.walks.replace(total_positions=40, latest_entrance=5, users=2)
    return first.replace(simulation=first.simulation.replace(walks=walks))


def test_a_scene_written_and_read_gives_equal_numbers(small: LinkScene, tmp_path: Path) -> None:
    nodes = tuple(
        NamedPlace(name=f"n{k}", x_m=x, y_m=y) for k, (x, y) in enumerate(small.network().positions_m.tolist())
    )
    path = DrawnPath(start=2, places_m=tuple((-12.0 + 0.85 * k, 0.3) for k in range(25)))
    scene = small.replace(nodes=nodes, paths=(path,))
    (tmp_path / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    again = LinkScene(**read_yaml(tmp_path / "scene.yaml"))
    assert again.model_dump() == scene.model_dump()
    assert tracks_csv(run_link_scene(again)) == tracks_csv(run_link_scene(scene))


def test_the_command_line_repeats_a_scene(small: LinkScene, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.yaml").write_text(small.to_yaml(), encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        main(["scene", str(tmp_path / "scene.yaml"), "--out", str(tmp_path / "out")])
    assert ended.value.code == 0
    outcome = outcome_of(run_link_scene(small))
    assert f"{outcome.scores[0].mota:.4f}" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "scores.json").read_text()) == summary(outcome)
    assert (tmp_path / "out" / "tracks.csv").read_text() == tracks_csv(outcome.run)
    assert (tmp_path / "out" / "scene.yaml").read_text() == small.to_yaml()
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "tracks.csv", "events.csv", "scores.json", "scores.png", "scene.yaml",
    }  # fmt: skip


def test_the_radiation_stays_when_sensors_change(small: LinkScene) -> None:
    fewer = small.replace(nodes=(NamedPlace(name="a", x_m=-12, y_m=0), NamedPlace(name="b", x_m=12, y_m=0)))
    for one, other in zip(radiate(small), radiate(fewer), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.validate
def test_a_run_scores_as_the_thesis_experiment_does() -> None:
    """Of eight runs each, drawn by other numbers, the mean MOTA agrees within three standard errors."""
    first = first_simulation()
    mine = [
        score_scene(run_link_scene(first.replace(simulation=first.simulation.replace(seed=seed)))).mota
        for seed in range(8)
    ]
    theirs = [
        float(np.asarray(trial(ChapterFour(), np.random.default_rng(seed))["mota"])[0]) for seed in range(100, 108)
    ]
    error = np.hypot(np.std(mine, ddof=1), np.std(theirs, ddof=1)) / np.sqrt(8)
    assert abs(np.mean(mine) - np.mean(theirs)) < 3 * error
    assert error < 0.1


def test_each_stage_of_a_frame_follows_from_the_one_before(small: LinkScene) -> None:
    run = run_link_scene(small)
    grid = small.grid
    assert any(len(frame.heads) for frame in run.frames)
    for frame in run.frames:
        bright = np.flatnonzero(frame.clusters)
        assert (frame.image[bright] > frame.threshold - 1e-6).all()
        assert len(frame.heads) == frame.clusters.max()
        for x, y in frame.heads:
            voxel = np.argmin(np.hypot(*(grid.centres - [x, y]).T))
            assert frame.clusters[voxel] > 0


def test_scores_count_what_is_in_the_table(small: LinkScene) -> None:
    outcome = outcome_of(run_link_scene(small))
    everyone, confirmed = outcome.scores
    rows = list(csv.DictReader(io.StringIO(tracks_csv(outcome.run))))
    pairs = everyone.targets - everyone.misses
    assert len(everyone.deviations) == pairs
    assert len(rows) == pairs + everyone.false_positives
    assert sum(row["status"] == "confirmed" for row in rows) == len(confirmed.deviations) + confirmed.false_positives
    assert all(sum(count) == pairs for count in histogram(everyone)[1])
    assert everyone.mota == pytest.approx(
        1 - (everyone.misses + everyone.false_positives + everyone.mismatches) / everyone.targets
    )


def test_what_cannot_be_a_scene_is_refused(small: LinkScene) -> None:
    long = DrawnPath(start=30, places_m=tuple((0.1 * k, 0.0) for k in range(20)))
    with pytest.raises(ParameterError, match="path 1 ends at step 50, the scene has 40 steps"):
        small.replace(paths=(long,))
    with pytest.raises(ParameterError, match="more than a scene keeps"):
        small.replace(simulation=first_simulation().simulation.replace(voxel_m=0.025))
    with pytest.raises(ParameterError, match="must be a Kalman filter"):
        LinkScene(method={"smoothing": {"kind": "particle"}})
    with pytest.raises(DataError, match="give at least two nodes"):
        run_link_scene(small.replace(nodes=()))
    outside = DrawnPath(places_m=((0.0, 0.0),))
    run = run_link_scene(small.replace(paths=(outside,)))
    nobody = run._replace(radiated=run.radiated._replace(truth=np.full_like(run.radiated.truth, np.nan)))
    with pytest.raises(DataError, match="nobody walks in the scene"):
        score_scene(nobody)


def test_coverage_counts_the_voxels_no_link_sees(small: LinkScene) -> None:
    two = small.replace(nodes=(NamedPlace(name="a", x_m=-12, y_m=0), NamedPlace(name="b", x_m=12, y_m=0)))
    found = coverage_of(two)
    grid = two.grid
    apart = np.hypot(*(grid.centres - [-12, 0]).T) + np.hypot(*(grid.centres - [12, 0]).T)
    within = apart < 24 + two.simulation.weights.excess_m
    assert found.voxels == 48 * 48
    assert found.blind == int((~within).sum())


def test_paths_drawn_by_hand_join_those_made_by_rule() -> None:
    state = LinksState()
    state.truth = state.scene.truth(state.scene.streams()[0])
    made = state.truth.copy()
    places = along_path(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]]), 0.5)
    np.testing.assert_allclose(np.hypot(*np.diff(places, axis=0).T)[:5], 0.5)
    assert len(places) == 15
    state.add_path(places, 140)
    assert state.truth is not None
    np.testing.assert_array_equal(state.truth[:, :3], made)
    np.testing.assert_allclose(state.truth[140:, 3], places[:10])
    state.within(Area(corners_m=((0, 0), (5, 0), (0, 5))))
    assert state.scene.method.tracker.entrance.area.corners_m == state.scene.area.corners_m
