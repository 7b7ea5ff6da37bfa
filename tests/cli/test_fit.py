"""`elusive fit links` as a user types it: what it writes is tracked with, and what cannot be fitted is told."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.results import STATUSES, read_tracks_csv
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.systems.links.track import LinkTracking
from tests.commands import ran
from tests.longer import longer
from tests.walked_room import EMPTY, FRAMES, all_missing, changed, walker, write_room

FAR = """
method:
  kind: links
  effect: {kind: shadowing, far_sd_db: 0.6, far_length_m: 0.3, floor_sd_db: 1.2}
  people: {particles: 300}
seed: 5
"""


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return write_room(tmp_path_factory.mktemp("network"))


def fit(capsys, log, network, *more):
    return ran(
        capsys, "fit", "links", log, "--nodes", network / "nodes.csv", "--calibration-frames", EMPTY,
        "--pitch-m", 0.5, *more,
    )  # fmt: skip


def test_fitted_constants_are_tracked_with(network, tmp_path, capsys):
    start, out = tmp_path / "far.yaml", tmp_path / "fitted"
    start.write_text(FAR)
    code, said = fit(capsys, network / "log.csv", network, "--start", start, "--iterations", 6, "--out", out)
    assert code == 0, said
    assert "constant before after" in said.replace("┃", "").replace("  ", " ")
    assert "sfar [dB]" in said
    assert {path.name for path in out.iterdir()} == {"config.yaml", "constants.csv", "presence.csv"}

    fitted = LinkTracking.from_yaml(out / "config.yaml")
    given = LinkTracking.from_yaml(start)
    constants = fitted.method.effect
    assert fitted == given.replace(
        calibration_frames=EMPTY, fit_frames=0, method=given.method.replace(effect=constants)
    )  # all else is kept
    # the walker's effect on links nearby, 2.5 dB and a metre, is found again; the noise is .4 dB and whole dB's
    assert constants.far_sd_db == pytest.approx(2.5, rel=0.25)
    assert constants.far_length_m == pytest.approx(0.5, rel=0.35)  # of the variance: half of a metre
    lines = (out / "constants.csv").read_text().splitlines()
    assert lines[0] == "constant,before,after"
    assert f"far_sd_db,0.6,{constants.far_sd_db!r}" in lines
    assert {line.partition(",")[0] for line in lines[1:]} == set(LinkShadowing.model_fields)

    presence = np.loadtxt(out / "presence.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(presence[:, 0], 0.5 * np.arange(EMPTY, FRAMES))
    assert presence[:9, 1].max() < 0.1
    assert presence[12:, 1].min() > 0.9
    assert f"Frames with somebody │ {100 * (presence[:, 1] >= 0.5).mean():.0f} %" in said

    code, said = ran(
        capsys, "track", "links", network / "log.csv", "--nodes", network / "nodes.csv", "--config",
        out / "config.yaml", "--out", tmp_path / "tracked",
    )  # fmt: skip
    assert code == 0, said
    rows = read_tracks_csv(tmp_path / "tracked" / "tracks.csv").rows
    rows = rows[rows["status"] == STATUSES.index("confirmed")]
    errors = [np.hypot(*(row["position"] - walker(round(2 * row["time_s"])))) for row in rows]
    assert len(errors) >= 0.8 * (FRAMES - 40)
    assert np.mean(errors) < 0.6


@pytest.mark.thorough
def test_one_file_alone(network, tmp_path, capsys):
    """Of an area's polygon; a second fit from the result of the first has little left to gain."""
    area = tmp_path / "area.csv"
    area.write_text("0,0\n6,0\n6,6\n0,6\n")
    first, again = tmp_path / "first.yaml", tmp_path / "again.yml"
    more = ("--iterations", 3, "--area-file", area)
    assert fit(capsys, network / "log.csv", network, *more, "--out", first)[0] == 0
    code, said = fit(capsys, network / "log.csv", network, "--start", first, *more, "--out", again)
    assert code == 0, said
    assert {path.name for path in tmp_path.iterdir()} == {"area.csv", "first.yaml", "again.yml"}
    before, after = (float(word) for word in said.partition("tempered │ ")[2].replace("before,", "").split()[:2])
    assert 0 <= after - before < 0.002 * abs(before)
    assert LinkTracking.from_yaml(again).area.bounds_m == (0, 6, 0, 6)


def empty_room(lines):
    """Nobody comes: the first lines again and again."""
    times = [line.partition(",")[0] for line in lines[1:]]
    return [
        lines[0],
        *(f"{time},{lines[1 + k % EMPTY].partition(',')[2]}" for k, time in enumerate(times)),
    ]


def missing_after(lines):
    return [*lines[: 1 + EMPTY], *all_missing([lines[0], *lines[1 + EMPTY :]])[1:]]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda lines: lines[: EMPTY + 11], "has 10 frames after the 30 of calibration; the fit needs at least 20"),
        (lambda lines: lines[:10], "has 0 frames after the 9 of calibration"),
        (empty_room, "nobody seems to have been there in any frame"),
        (all_missing, "nothing was heard"),
        (missing_after, "has no reading after the calibration"),
        (lambda lines: ["once upon a time", "there was"], "one column must be named time_s"),
        (lambda lines: [*lines[:50], "oops", *lines[51:]], "changed.csv, line 51: has 1 cells"),
        (lambda lines: [*lines[:50], lines[44], *lines[51:]], "times must go forwards"),
    ],
    ids=["short", "shorter", "nobody", "missing", "missing-later", "no-log", "text", "backwards"],
)
@pytest.mark.parametrize("out", longer(["out", "out.yaml"], "out"))
def test_a_log_that_cannot_be_fitted(network, tmp_path, capsys, change, sentence, out):
    code, said = fit(capsys, changed(network, tmp_path, change), network, "--out", tmp_path / out)
    assert code == 2
    assert sentence in said
    assert {path.name for path in tmp_path.iterdir()} == {"changed.csv"}


@pytest.mark.parametrize(
    ("start", "more", "sentence"),
    [
        ("method: {kind: image}", (), "'image' has no constants to fit"),
        ("metod: {kind: links}", (), "did you mean 'method'?"),
        (None, ("--iterations", 0), "LinkFitting.iterations"),
        (None, ("--start", "nowhere.yaml"), "cannot be read"),
        (None, ("--area", 0, 1, 0, 1, "--area-file", "x"), "give one of them"),
        (None, ("--area-file", "nowhere.csv"), "cannot be read"),
    ],
)
def test_options_that_cannot_be_used(network, tmp_path, capsys, start, more, sentence):
    if start is not None:
        (tmp_path / "start.yaml").write_text(start)
        more = (*more, "--start", tmp_path / "start.yaml")
    code, said = fit(capsys, network / "log.csv", network, *more, "--out", tmp_path / "out")
    assert code == 2
    assert sentence in said
    assert not (tmp_path / "out").exists()


def test_an_area_between_the_cells_is_told(network, tmp_path, capsys):
    (tmp_path / "area.csv").write_text("0,0\n4,0\n4,.1\n.1,.1\n.1,4\n0,4\n")
    more = ("--area-file", tmp_path / "area.csv", "--pitch-m", 2, "--out", tmp_path / "out")
    code, said = fit(capsys, network / "log.csv", network, *more)
    assert code == 2
    assert "holds no voxel's centre" in said


def test_a_file_that_cannot_be_written_is_told_before_the_fit(network, tmp_path, capsys):
    code, said = fit(capsys, network / "log.csv", network, "--out", tmp_path / "nowhere" / "fitted.yaml")
    assert code == 2
    assert "there is no folder" in said
    assert "Constants" not in said
