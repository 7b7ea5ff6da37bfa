"""Wrong inputs of `elusive track links`, each told in a sentence, and right ones without a word."""

from __future__ import annotations

import json
from itertools import islice

import numpy as np
import pytest

from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.sensors.radio_network import directed_links_of
from tests.commands import ran
from tests.longer import longer
from tests.tracking.link_scenes import DATA
from tests.walked_room import EMPTY, changed, excess_of, other, walker, write_room

LOG, NODES, RECORDED_EMPTY = DATA / "basement_listenx_out_1.txt", DATA / "sensor_coords_basement_m.txt", 50
recorded = pytest.mark.skipif(not DATA.exists(), reason=f"needs the radio log under {DATA}")


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("network"))


@pytest.fixture(scope="module")
def basement(tmp_path_factory):
    """Nodes, and the first 110 frames of the log: fifty of the empty room and a minute of somebody."""
    folder = tmp_path_factory.mktemp("basement")
    lines = LOG.read_text().splitlines()[: RECORDED_EMPTY + 60]
    (folder / "log.txt").write_text("\n".join(lines) + "\n")
    (folder / "nodes.txt").write_text(NODES.read_text())
    return folder


def told(capsys, log, nodes, out, *more, empty=RECORDED_EMPTY):
    """Exit code with --strict, names of the findings, and what was said."""
    asked = ["track", "links", log, "--nodes", nodes, "--calibration-frames", empty, "--out", out, "--strict", *more]
    code, said = ran(capsys, *asked)
    checks = out / "checks.json"
    found = json.loads(checks.read_text()) if checks.exists() else []
    found = found if isinstance(found, list) else found["findings"]
    assert len({one["name"] for one in found}) == len(found), "a finding stands twice"
    names = {one["name"] for one in found if not one["holds"]}
    return code, names, said


def rewritten(basement, folder, change):
    """Write the nodes' lines changed."""
    path = folder / "nodes.txt"
    path.write_text("\n".join(change((basement / "nodes.txt").read_text().split("\n")[:10])) + "\n")
    return path


@pytest.mark.validate
@recorded
def test_the_recorded_log_is_right(basement, tmp_path, capsys):
    code, names, said = told(capsys, basement / "log.txt", basement / "nodes.txt", tmp_path / "out")
    assert (code, names) == (0, set()), said


@recorded
@pytest.mark.parametrize(
    ("change", "name", "words"),
    [
        pytest.param(lambda lines: lines[:9], "links.reciprocity", "read with nine", marks=pytest.mark.thorough),
        pytest.param(lambda lines: lines[::-1], "links.path-loss", "in another order", marks=pytest.mark.thorough),
    ],
)
def test_nodes_that_are_not_the_logs(basement, tmp_path, capsys, change, name, words):
    nodes = rewritten(basement, tmp_path, change)
    code, names, said = told(capsys, basement / "log.txt", nodes, tmp_path / "out", "--most-targets", 3)
    assert code == 3, said
    assert name in names
    assert words in said


@recorded
@pytest.mark.parametrize(("factor", "words"), [(100, "given in centimetres"), (0.001, "given in kilometres")])
def test_other_units_of_length_are_refused(basement, tmp_path, capsys, factor, words):
    nodes = rewritten(
        basement, tmp_path, lambda lines: [" ".join(str(factor * float(x)) for x in line.split()) for line in lines]
    )
    code, _, said = told(capsys, basement / "log.txt", nodes, tmp_path / "out")
    assert code == 2
    assert words in said


@pytest.mark.thorough
@recorded
def test_two_nodes_that_are_exchanged_are_named(basement, tmp_path, capsys):
    nodes = rewritten(basement, tmp_path, lambda lines: [lines[5], *lines[1:5], lines[0], *lines[6:]])
    _, names, said = told(capsys, basement / "log.txt", nodes, tmp_path / "out")
    assert "links.nodes" in names
    assert "with the nodes 0 and 5 exchanged" in said


@recorded
def test_seconds_that_are_milliseconds(basement, tmp_path, capsys):
    """The recorded log as a wide table, its times left in milliseconds."""
    nodes = read_nodes(basement / "nodes.txt")
    frames = list(islice(open_link_log(basement / "log.txt", nodes), 110))
    pairs = [f"{a}-{b}" for a, b in directed_links_of(10)]
    rows = [",".join(["time_s", *(f"{pair}-{c}" for pair in pairs for c in range(8))])]
    for frame in frames:
        cells = np.where(np.isnan(frame.rss_dbm), "", frame.rss_dbm.astype(str)).ravel().tolist()
        rows.append(",".join([repr(1000 * frame.time_s), *cells]))
    (tmp_path / "log.csv").write_text("\n".join(rows) + "\n")
    code, _, said = told(capsys, tmp_path / "log.csv", basement / "nodes.txt", tmp_path / "out")
    assert code == 2, said
    assert "as if times were in milliseconds" in said


def test_levels_that_are_positive_are_refused(network, tmp_path, capsys):
    def positive(lines):
        cells = (line.split(",") for line in lines[1:])
        return [lines[0], *(",".join([time, *(str(-float(cell)) for cell in rest)]) for time, *rest in cells)]

    log = changed(network, tmp_path, positive)
    code, _, said = told(capsys, log, network / "nodes.csv", tmp_path / "out", empty=EMPTY)
    assert code == 2, said
    assert "every reading so far is above -10 dBm" in said
    assert "losses with the sign turned" in said
    code, _, said = told(capsys, log, network / "nodes.csv", tmp_path / "out", "--missing-above-dbm", 100, empty=EMPTY)
    assert code == 2
    assert "louder than radios can be" in said


@pytest.mark.parametrize("door", longer([False, True], True))
def test_a_door_that_opens_in_an_empty_room_is_named_and_its_ghost_goes(network, tmp_path, capsys, door):
    """Two minutes of nobody; after 50 s four links of ten read otherwise, by 4 dB in deviation."""
    rng = np.random.default_rng(4)

    def nobody(lines):
        level = np.array([line.split(",")[1:] for line in lines[1 : EMPTY + 1]], dtype=float).mean(axis=0)
        links = np.repeat(rng.random(len(level) // 4) < 0.4, 4)
        step = door * np.where(links, rng.normal(0, 4, len(level)), 0.0)
        seen = (np.round(level + step * (k >= 100) + rng.normal(0, 0.4, len(level))) for k in range(240))
        return [lines[0], *(",".join([str(0.5 * k), *map(str, row)]) for k, row in enumerate(seen))]

    log = changed(network, tmp_path, nobody)
    quick = "--fit-frames", 0
    code, names, said = told(capsys, log, network / "nodes.csv", tmp_path / "out", *quick, empty=EMPTY)
    assert (code, "links.room" in names) == ((3, True) if door else (0, False)), said
    rows = (tmp_path / "out" / "tracks.csv").read_text().splitlines()[1:]
    assert not [row for row in rows if float(row.split(",")[0]) > 90 and "confirmed" in row]


def test_a_room_with_somebody_is_right(network, tmp_path, capsys):
    code, names, said = told(capsys, network / "log.csv", network / "nodes.csv", tmp_path / "out", empty=EMPTY)
    assert (code, names) == (0, set()), said


def test_a_log_that_ends_too_soon_to_tell_how_long_readings_err_alike_says_so(network, tmp_path, capsys):
    lines = (network / "log.csv").read_text().splitlines()
    log = tmp_path / "short.csv"
    log.write_text("\n".join(lines[: 1 + EMPTY + 16]) + "\n")  # somebody comes in after ten
    quick = "--fit-frames", 0
    code, names, said = told(capsys, log, network / "nodes.csv", tmp_path / "out", *quick, empty=EMPTY)
    assert (code, names) == (0, {"links.alike"}), said
    assert "frames tell how alike the readings of a link err" in said


@pytest.mark.thorough
@pytest.mark.parametrize("most", [1, 2])
def test_two_people_are_two_or_are_named(tmp_path, capsys, most):
    """Eight nodes of two channels; the site is fitted to both."""
    room = write_room(tmp_path, other)
    asked = room / "log.csv", room / "nodes.csv", tmp_path / "out", "--most-targets", most
    code, names, said = told(capsys, *asked, empty=EMPTY)
    assert (code, names) == ((3, {"links.people"}) if most == 1 else (0, set())), said
    if most == 1:
        assert "two may be tracked as one" in said
        return
    rows = [row.split(",") for row in (tmp_path / "out" / "tracks.csv").read_text().splitlines()[1:]]
    for frame in range(50, 66):
        seen = [np.array(row[4:6], float) for row in rows if float(row[0]) == 0.5 * frame and row[2] == "confirmed"]
        for person in (walker, other):
            assert min(np.linalg.norm(place - person(frame)) for place in seen) < 1.0


@pytest.mark.parametrize("stood", longer([False, True], False))
def test_somebody_who_stood_through_the_calibration_and_left_is_named(tmp_path, capsys, stood):
    """They leave a track that never moves where they stood, after 20 s, for half a minute; nobody is there."""
    room, rng = write_room(tmp_path, frames=120), np.random.default_rng(5)
    excess = excess_of((3.2, 2.1))
    fall = 9 * np.exp(-excess / 0.03) - 2.5 * rng.normal(size=len(excess)) * np.exp(-excess)

    def changing(lines):
        cells = [np.array(line.split(","), dtype=float) for line in lines[1:]]
        inside = [stood * (k < 40) * np.concatenate([[0.0], fall]) for k in range(len(cells))]
        empty = [cells[k % EMPTY] for k in range(len(cells))]  # nobody walks
        rows = ([0.5 * k, *np.round(empty[k] - inside[k])[1:]] for k in range(len(cells)))
        return [lines[0], *(",".join(map(str, row)) for row in rows)]

    log, quick = changed(room, tmp_path, changing), ("--fit-frames", 0)
    _, names, said = told(capsys, log, room / "nodes.csv", tmp_path / "out", *quick, empty=EMPTY)
    assert ("links.changed" in names) == stood, said
