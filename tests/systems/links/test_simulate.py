"""Simulated radio networks: changes by eq. 3.10, logs by the link budget, truth beside them; what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.geometry.areas import Area
from elusive.io import read_truth
from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.preprocess.link_calibration import Calibrate
from elusive.sensors.radio_network import directed_links_of, links_of
from elusive.systems.links.coverage import write_coverage
from elusive.systems.links.networks import BorderNodes, GridNodes, ListedNodes
from elusive.systems.links.radiation import VoxelRadiation
from elusive.systems.links.recording import simulate_links
from elusive.systems.links.run import track_links_recording
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.track import LinksMethod, LinkTracking

FILES = ["coverage.csv", "coverage.png", "log.csv", "nodes.csv", "simulation.yaml", "truth.csv"]
SMALL = {
    "walks": {"users": 2, "total_positions": 40, "area": Area.rectangle(0, 6, 0, 4), "step_distance_m": 0.4},
    "network": {"kind": "border", "nodes": 8},
}
CLEAN = {"radiation": {"voxel_noise_db": 0.0}, "quantiser": {"bits": 32, "bit_error_rate": 0.0}}


def written_out(simulation: LinkSimulation, place: np.ndarray) -> np.ndarray:
    """Changes of eqs. 3.5, 3.10 and 3.11 with one person, link by link and voxel by voxel."""
    network = simulation.bind()
    nodes, half = network.nodes.positions_m, simulation.weights.voxel_m / 2
    changes = []
    for a, b in links_of(len(nodes)):
        A, B = nodes[a], nodes[b]
        total = 0.0
        for voxel in network.grid.centres:
            dA, dB, dAB = math.dist(A, voxel), math.dist(B, voxel), math.dist(A, B)
            if dA + dB < dAB + 0.2:
                (ux, uy), (vx, vy) = (B - A) / dAB, voxel - A
                k = 2.5 if abs(ux * vy - uy * vx) < half else 2.0
                total += (k + max(dA, dB)) / dAB * 20 * math.exp(-(math.dist(place, voxel) ** 2) / (2 * 0.5**2))
        changes.append(total)
    return np.array(changes)


def test_changes_are_the_weighted_sums_of_eq_3_10() -> None:
    simulation = LinkSimulation(**SMALL, **CLEAN)
    drawn = simulation.draw(np.random.default_rng(3))
    assert drawn.empty.shape == (10, 28)
    assert drawn.changes.shape == (40, 28)
    assert np.abs(drawn.empty).max() <= simulation.quantiser.step_db
    alone = np.flatnonzero(np.isfinite(drawn.truth[..., 0]).sum(axis=1) == 1)[:5]
    for step in alone:
        place = drawn.truth[step][np.isfinite(drawn.truth[step, :, 0])][0]
        np.testing.assert_allclose(drawn.changes[step], written_out(simulation, place), atol=1e-6)


def test_paths_are_the_same_whatever_the_network_and_the_noise() -> None:
    one = LinkSimulation(**SMALL).draw(np.random.default_rng(1))
    other = LinkSimulation(**{**SMALL, "network": {"kind": "border", "nodes": 5}}, **CLEAN)
    np.testing.assert_array_equal(one.truth, other.draw(np.random.default_rng(1)).truth)
    again = LinkSimulation(**SMALL).draw(np.random.default_rng(1))
    np.testing.assert_array_equal(one.changes, again.changes)
    assert not np.array_equal(one.truth, LinkSimulation(**SMALL).draw(np.random.default_rng(2)).truth, equal_nan=True)


def test_coarse_bits_and_bit_errors_reach_the_centre() -> None:
    coarse = LinkSimulation(**SMALL, quantiser={"bits": 4, "bit_error_rate": 0.0})
    drawn = coarse.draw(np.random.default_rng(0))
    assert len(np.unique(drawn.changes)) <= 16
    wrong = LinkSimulation(**SMALL, radiation={"voxel_noise_db": 0.0}, quantiser={"bits": 4, "bit_error_rate": 0.01})
    turned = (wrong.draw(np.random.default_rng(0)).empty != 8.0).any(axis=1)  # zero is sent as the level from 0 to 16
    assert turned.any()


def test_nodes_along_the_border_on_a_grid_and_from_a_file(tmp_path: Path) -> None:
    square = Area.rectangle(-12, 12, -12, 12)
    border = BorderNodes().bind(square)
    assert len(border.names) == 41
    along = [square.on_border(96 * k / 41)[0] for k in range(41)]
    np.testing.assert_allclose(border.positions_m, along)
    assert np.abs(square.depth_m(border.positions_m)).max() < 1e-9
    grid = GridNodes(rows=2, columns=4).bind(Area.rectangle(0, 8, 0, 2))
    np.testing.assert_allclose(grid.positions_m, [(x, y) for y in (0.5, 1.5) for x in (1, 3, 5, 7)])
    triangle = Area(corners_m=((0, 0), (10, 0), (0, 10)))
    assert len(GridNodes(rows=2, columns=2).bind(triangle).names) == 3
    with pytest.raises(ParameterError, match=r"GridNodes\.rows: 1 rows and 1 columns put 1 nodes into the area"):
        GridNodes(rows=1, columns=1).bind(triangle)
    (tmp_path / "nodes.csv").write_text("node,x_m,y_m\na,0,0\nb,6,4\nc,0,4\n")
    listed = {"kind": "file", "path": str(tmp_path / "nodes.csv")}
    assert LinkSimulation(**{**SMALL, "network": listed}).bind().nodes.names == ("a", "b", "c")
    with pytest.raises(DataError, match=r"gone\.csv"):
        ListedNodes(path=str(tmp_path / "gone.csv")).bind(square)
    (tmp_path / "far.csv").write_text("node,x_m,y_m\na,100,0\nb,106,4\n")
    far = LinkSimulation(**{**SMALL, "network": {"kind": "file", "path": str(tmp_path / "far.csv")}})
    with pytest.raises(DataError, match="no link passes any voxel"):
        far.draw(np.random.default_rng(0))


def test_a_log_is_the_link_budget_less_the_change(tmp_path: Path) -> None:
    simulation = LinkSimulation(
        **SMALL, quantiser=CLEAN["quantiser"], seed=4, interval_s=0.5, budget={"transmitted_dbm": 4.0},
        radiation={"voxel_noise_db": 0.0, "amplitude_db": 3.0, "channels": 2},
    )  # fmt: skip
    told: list[int] = []
    simulate_links(simulation, tmp_path / "new" / "out", on_frame=told.append)
    out = tmp_path / "new" / "out"
    assert sorted(path.name for path in out.iterdir()) == FILES
    assert told == list(range(1, 51))
    nodes = read_nodes(out / "nodes.csv")
    np.testing.assert_allclose(nodes.positions_m, simulation.bind().nodes.positions_m)
    log = open_link_log(out / "log.csv", nodes)
    frames = list(log)
    assert log.channels == ("0", "1")
    np.testing.assert_allclose([frame.time_s for frame in frames], 0.5 * np.arange(50))
    ends = nodes.positions_m[directed_links_of(8)]
    apart = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    for channel, frequency in enumerate((2.45e9, 2.455e9)):
        expected = 4.0 - 20 * np.log10(4 * np.pi * apart * frequency / 299_792_458)
        np.testing.assert_allclose(frames[0].rss_dbm[:, channel], expected, atol=0.006)
    truth = read_truth(out / "truth.csv", "m").at([frame.time_s for frame in frames])
    drawn = simulation.truth()
    assert np.isnan(truth[:10]).all()
    np.testing.assert_allclose(
        truth[10:], drawn[:, [int(n) - 1 for n in read_truth(out / "truth.csv", "m").names]], atol=1e-4
    )
    step = int(np.flatnonzero(np.isfinite(drawn[..., 0]).sum(axis=1) == 1)[0])
    place = drawn[step][np.isfinite(drawn[step, :, 0])][0]
    expected = frames[0].rss_dbm - 0.15 * np.repeat(written_out(simulation, place), 1)[_undirected(8)][:, None]
    np.testing.assert_allclose(frames[10 + step].rss_dbm, expected, atol=0.011)


def _undirected(nodes: int) -> np.ndarray:
    number = {pair: k for k, pair in enumerate(map(tuple, links_of(nodes).tolist()))}
    return np.array([number[min(a, b), max(a, b)] for a, b in directed_links_of(nodes).tolist()])


def test_a_log_of_many_channels_fades_and_is_noisy_as_asked(tmp_path: Path) -> None:
    simulation = LinkSimulation(
        **SMALL, calibration_steps=400, fade_sd_db=5.0, quantiser=CLEAN["quantiser"],
        radiation={"voxel_noise_db": 0.0, "link_noise_db": 1.0, "channels": 3},
    )  # fmt: skip
    truth = np.full((1, 1, 2), np.nan)
    calibration = Calibrate().over(simulation.frames(simulation.images(truth)))
    noise = np.sqrt(calibration.variance_db2)
    assert noise.mean() == pytest.approx(1.0, abs=0.05)  # of an exponential of mean 1, each of 168 within 14 %
    budget = LinkSimulation(**SMALL, **CLEAN)
    plain = next(iter(budget.frames(budget.images(truth)))).rss_dbm
    own = calibration.mean_dbm - plain
    assert own.std() == pytest.approx(5.0, rel=0.25)  # 84 draws
    up = directed_links_of(8)
    back = [np.flatnonzero((up == (b, a)).all(axis=1))[0] for a, b in up]
    np.testing.assert_allclose(own, own[back], atol=0.5)  # both ways alike, but for the noise's mean over 400 frames
    assert calibration.remarks == ()


def test_the_command_repeats_from_its_own_configuration(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    asked = ["--users", "2", "--total-positions", "30", "--nodes", "7", "--area", "0", "6", "0", "4", "--seed", "9"]
    for given, out in ((asked, first), (["--config", str(first / "simulation.yaml")], second)):
        with pytest.raises(SystemExit) as end:
            main(["simulate", "links", *given, "--out", str(out)])
        assert not end.value.code
    for name in (name for name in FILES if name != "coverage.png"):
        assert (first / name).read_bytes() == (second / name).read_bytes()
    assert yaml.safe_load((first / "simulation.yaml").read_text())["network"] == {"kind": "border", "nodes": 7}
    said = capfd.readouterr()
    assert "7 nodes, 21 links, 1 channel " in said.out
    command = said.err.split("To track: elusive ")[1].splitlines()[0].split()
    assert command[-4:-2] == ["--calibration-frames", "10"]
    with pytest.raises(SystemExit) as end:
        main([*command[:-1], str(tmp_path / "tracks")])
    assert not end.value.code
    assert (tmp_path / "tracks" / "report.html").is_file()


def test_coverage_counts_the_links_through_each_voxel(tmp_path: Path) -> None:
    area = Area(corners_m=((0, 0), (6, 0), (6, 4), (0, 2)))
    simulation = LinkSimulation(walks={**SMALL["walks"], "area": area}, network=SMALL["network"])
    network = simulation.bind()
    words = write_coverage(tmp_path, network.nodes, network.grid, network.weights)
    table = np.loadtxt(tmp_path / "coverage.csv", delimiter=",", skiprows=1)
    assert (tmp_path / "coverage.csv").read_text().startswith("x_m,y_m,links,weight\n")
    ends = network.nodes.positions_m[links_of(8)]
    expected = []
    for x, y in table[:, :2]:
        assert area.contains(np.array([[x, y]]))[0]
        by_way = np.linalg.norm(ends - (x, y), axis=2).sum(axis=1)
        expected.append((by_way < np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) + 0.2).sum())
    np.testing.assert_array_equal(table[:, 2], expected)
    assert len(table) == network.grid.inside.sum()
    np.testing.assert_allclose(table[:, 3].sum(), network.weights.sum(), rtol=1e-5)
    blind = expected.count(0)
    assert words.startswith(f"{min(expected)} to {max(expected)} links a voxel, {np.median(expected):g} at the median")
    assert words.endswith(f"; {blind} of {len(table)} voxels see none") == (blind > 0)
    with Image.open(tmp_path / "coverage.png") as picture:
        assert 0.2 < (np.asarray(picture.convert("L")) < 250).mean() < 0.9


def test_the_command_takes_a_polygon_and_refuses_two_areas(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "area.csv").write_text("x_m,y_m\n0,0\n8,0\n8,3\n3,3\n3,6\n0,6\n")
    command = ["simulate", "links", "--area-file", str(tmp_path / "area.csv"), "--nodes", "9", "--total-positions", "9"]
    with pytest.raises(SystemExit) as end:
        main([*command, "--out", str(tmp_path / "out")])
    assert not end.value.code
    nodes = read_nodes(tmp_path / "out" / "nodes.csv")
    corners = Area(corners_m=((0, 0), (8, 0), (8, 3), (3, 3), (3, 6), (0, 6)))
    assert np.abs(corners.depth_m(nodes.positions_m)).max() < 1e-9
    with pytest.raises(SystemExit) as end:
        main([*command, "--area", "0", "1", "0", "1", "--out", str(tmp_path / "other")])
    assert end.value.code == 2
    assert "--area-file: --area is given too" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


@pytest.mark.thorough
def test_straight_on_the_links_of_a_simulated_log_by_its_own_model(tmp_path: Path) -> None:
    """Radiation added up is the model the log was made with: nobody is left out, and places are within a voxel."""
    walks = {**SMALL["walks"], "area": Area.rectangle(0, 8, 0, 6), "users": 4, "total_positions": 60}
    simulate_links(LinkSimulation(walks=walks, network=BorderNodes(nodes=14), calibration_steps=20), tmp_path / "room")
    nodes = read_nodes(tmp_path / "room" / "nodes.csv")
    parameters = LinkTracking(
        calibration_frames=20, method=LinksMethod(effect=VoxelRadiation(), people={"particles": 200})
    )
    truth = read_truth(tmp_path / "room" / "truth.csv", "m")
    log = open_link_log(tmp_path / "room" / "log.csv", nodes)
    outcome = track_links_recording(log, nodes, parameters, tmp_path / "tracks", truth=truth)
    assert outcome.scored is not None
    scores = outcome.scored.candidates_too
    assert scores.mota >= 0.95
    assert scores.rmse <= 0.25  # half a voxel
