"""A scene repeats itself from its file, and its run agrees with the chain and the scores it is made of."""

from __future__ import annotations

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
from elusive.systems.links.networks import PlacedNodes
from elusive.systems.links.page.panels import tracking_spec
from elusive.systems.links.page.performance import estimates
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.presets import first_simulation, links_method
from elusive.systems.links.scene import LinkScene, SceneRun, coverage_of, radiate, run_scene
from elusive.systems.links.walks import DrawnPath


@pytest.fixture(scope="module")
def small() -> LinkScene:
    first = first_simulation()
    walks = first.simulation.walks.replace(total_positions=40, latest_entrance=5, users=2)
    return first.replace(simulation=first.simulation.replace(walks=walks))


@pytest.fixture(scope="module")
def ran(small: LinkScene) -> SceneRun:
    return run_scene(small)


def placed(scene: LinkScene, places: list[tuple[float, float]]) -> LinkScene:
    nodes = tuple(NamedPlace(name=f"n{k}", x_m=x, y_m=y) for k, (x, y) in enumerate(places))
    return scene.replace(simulation=scene.simulation.replace(network=PlacedNodes(places=nodes)))


def test_a_scene_written_and_read_is_equal(small: LinkScene, tmp_path: Path) -> None:
    scene = placed(small, small.simulation.bind().nodes.positions_m.tolist())
    path = DrawnPath(start=2, places_m=tuple((-12.0 + 0.85 * k, 0.3) for k in range(25)))
    scene = scene.replace(simulation=scene.simulation.replace(paths=(path,)))
    (tmp_path / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    again = LinkScene(**read_yaml(tmp_path / "scene.yaml"))
    assert again.model_dump() == scene.model_dump()
    truth = again.simulation.truth()
    assert np.isfinite(truth[:, 0, 0]).sum() == 25


@pytest.mark.thorough
@pytest.mark.parametrize("method", ["image", "links"])
def test_page_scene_and_track_links_give_the_same_numbers(
    small: LinkScene, method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The page's run, `elusive scene`, and `elusive track links` on the log that it exports."""
    if method == "links":
        tracking = small.tracking.replace(method=links_method(small.simulation))
        small = small.replace(tracking=tracking).bound
    (tmp_path / "scene.yaml").write_text(small.to_yaml(), encoding="utf-8")
    out, log = tmp_path / "out", tmp_path / "out" / "recording"
    again = ["--nodes", str(log / "nodes.csv"), "--truth", str(log / "truth.csv"), "--config", str(out / "config.yaml")]
    for command in (
        ["scene", str(tmp_path / "scene.yaml"), "--out", str(out)],
        ["track", "links", str(log / "log.csv"), *again, "--out", str(tmp_path / "again")],
    ):
        with pytest.raises(SystemExit) as ended:
            main(command)
        assert not ended.value.code
    run = run_scene(small)
    tracks, events = run.tables
    assert capsys.readouterr().out.count(f"{run.outcome.scored.confirmed.mota:.3f}: ") == 2
    assert json.loads((out / "scores.json").read_text()) == json.loads(run.outcome.scored.text)
    for folder in (out, tmp_path / "again"):
        assert (folder / "tracks.csv").read_text() == tracks
        assert (folder / "events.csv").read_text() == events
    assert (out / "scene.yaml").read_text() == small.to_yaml()
    assert run.outcome.scored.candidates_too.mota > 0.8


def test_the_radiation_stays_when_sensors_change(small: LinkScene) -> None:
    fewer = placed(small, [(-12, 0), (12, 0)])
    for one, other in zip(radiate(small), radiate(fewer), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.thorough
def test_a_run_scores_as_the_thesis_experiment_does() -> None:
    """Of eight runs each, drawn by other numbers, the mean MOTA agrees within three standard errors."""
    first = first_simulation()
    mine = [
        run_scene(first.replace(simulation=first.simulation.replace(seed=seed))).outcome.scored.candidates_too.mota
        for seed in range(8)
    ]
    theirs = [
        float(np.asarray(trial(ChapterFour(), np.random.default_rng(seed))["mota"])[0]) for seed in range(100, 108)
    ]
    error = np.hypot(np.std(mine, ddof=1), np.std(theirs, ddof=1)) / np.sqrt(8)
    assert abs(np.mean(mine) - np.mean(theirs)) < 3 * error
    assert error < 0.1


def test_each_stage_of_a_frame_follows_from_the_one_before(ran: SceneRun) -> None:
    grid, clusters = ran.scene.grid, ran.tracking.method.clusters
    assert any(len(step.state.heads.positions) for step in ran.steps)
    for step in ran.steps:
        seen = step.state
        labels = clusters.labels(seen.image, grid, seen.level)
        assert (seen.image[labels > 0] > seen.level - 1e-6).all()
        assert len(seen.heads.positions) == labels.max()
        for x, y in seen.heads.positions:
            assert labels[np.argmin(np.hypot(*(grid.centres - [x, y]).T))] > 0


def test_estimates_are_of_pairs_within_the_gate(ran: SceneRun) -> None:
    found = estimates(ran)
    assert list(found) == ["head", "smoothing", "particle filter"]
    scores = ran.outcome.scored.candidates_too
    pairs = scores.targets - scores.misses
    assert len({len(apart) for apart in found.values()}) == 1
    assert abs(len(found["head"]) - pairs) <= 0.1 * pairs  # two tracks may be near one person
    assert found["smoothing"].max() <= 2.0
    assert estimates(ran._replace(truth=None)) == {}


def test_a_run_by_each_method_is_drawn(small: LinkScene, ran: SceneRun) -> None:
    spec = tracking_spec(ran)
    assert len(spec["panels"]) == 8
    straight = small.replace(tracking=small.tracking.replace(method=links_method(small.simulation))).bound
    assert [panel["title"] for panel in tracking_spec(run_scene(straight))["panels"]] == [
        "Radiation", "Particles", "Identities",
    ]  # fmt: skip


def test_what_cannot_be_a_scene_is_refused(small: LinkScene) -> None:
    beyond = DrawnPath(start=30, places_m=tuple((0.1 * k, 0.0) for k in range(20)))
    with pytest.raises(ParameterError, match="path 1 ends at step 50, the scene has 40 steps"):
        small.simulation.replace(paths=(beyond,))
    long = small.simulation.replace(walks=small.simulation.walks.replace(total_positions=20_000))
    with pytest.raises(ParameterError, match="more than a scene keeps"):
        small.replace(simulation=long)
    with pytest.raises(DataError, match="give at least two nodes"):
        run_scene(placed(small, []))


def test_coverage_counts_the_voxels_no_link_sees(small: LinkScene) -> None:
    two = placed(small, [(-12, 0), (12, 0)])
    found = coverage_of(two)
    grid = two.grid
    apart = np.hypot(*(grid.centres - [-12, 0]).T) + np.hypot(*(grid.centres - [12, 0]).T)
    within = apart < 24 + two.simulation.weights.excess_m
    assert found.voxels == 48 * 48
    assert found.blind == int((~within).sum())


def test_paths_drawn_by_hand_join_those_made_by_rule() -> None:
    state = LinksState()
    state.truth = state.scene.simulation.truth()
    made = state.truth.copy()
    places = along_path(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]]), 0.5)
    np.testing.assert_allclose(np.hypot(*np.diff(places, axis=0).T)[:5], 0.5)
    assert len(places) == 15
    state.add_path(places, 140)
    assert state.truth is not None
    np.testing.assert_array_equal(state.truth[:, :3], made)
    np.testing.assert_allclose(state.truth[140:, 3], places[:10])
    state.within(Area(corners_m=((0, 0), (5, 0), (0, 5))))
    assert state.scene.tracking.area == state.scene.area
