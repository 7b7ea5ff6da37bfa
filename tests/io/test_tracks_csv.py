"""The table of tracks: exact columns, an exact round trip, and every contradiction refused."""

import csv
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from elusive.errors import DataError
from elusive.io import TrackRow, read_tracks_csv, write_tracks_csv

HEAD = "time_s,track,status,existence,x_px,y_px,vx_px,vy_px,sd_x_px,sd_y_px"
METRIC = "time_s,track,status,existence,x_m,y_m,vx_mps,vy_mps,sd_x_m,sd_y_m"
ROWS = [
    TrackRow(0.0, None, "none", 0.125),
    TrackRow(0.04, 1, "confirmed", 0.9, 10.5, 20.25, 1.0, -1.0, 0.3, 0.4),
    TrackRow(0.08, 1, "confirmed", 1.0, 11.0, 20.0),
]


def same(left, right):
    return all(a == b or (a != a and b != b) for a, b in zip(left, right, strict=True))


def test_the_text_is_exactly_this(tmp_path):
    write_tracks_csv(tmp_path / "t.csv", ROWS)
    assert (tmp_path / "t.csv").read_bytes().decode() == (
        f"{HEAD}\n"
        "0.0,,none,0.125,,,,,,\n"
        "0.04,1,confirmed,0.9,10.5,20.25,1.0,-1.0,0.3,0.4\n"
        "0.08,1,confirmed,1.0,11.0,20.0,,,,\n"
    )


def test_the_metric_table_and_its_geographic_columns(tmp_path):
    write_tracks_csv(tmp_path / "m.csv", ROWS, unit="m")
    assert (tmp_path / "m.csv").read_text().splitlines()[0] == METRIC
    rows = [*ROWS, ROWS[1]._replace(lon_deg=-4.5, lat_deg=48.25)]
    write_tracks_csv(tmp_path / "g.csv", iter(rows), unit="m")
    with (tmp_path / "g.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    assert list(table[0]) == [*METRIC.split(","), "lon_deg", "lat_deg"]
    assert (table[1]["lon_deg"], table[3]["lon_deg"], table[3]["lat_deg"]) == ("", "-4.5", "48.25")
    assert all(map(same, read_tracks_csv(tmp_path / "g.csv", unit="m"), rows))
    with pytest.raises(DataError, match=rf"line 1: the columns are {METRIC}; tracks in px have {HEAD}"):
        read_tracks_csv(tmp_path / "m.csv")


def test_an_empty_table_is_a_header(tmp_path):
    write_tracks_csv(tmp_path / "t.csv", [])
    assert (tmp_path / "t.csv").read_text() == HEAD + "\n"
    assert read_tracks_csv(tmp_path / "t.csv") == []


def test_numpy_scalars_are_written_as_numbers(tmp_path):
    row = TrackRow(np.float64(1.5), np.int64(3), "confirmed", np.float32(0.5), np.float64(2), 3, np.float32("nan"))
    write_tracks_csv(tmp_path / "t.csv", [row])
    assert (tmp_path / "t.csv").read_text().splitlines()[1] == "1.5,3,confirmed,0.5,2.0,3.0,,,,"


numbers = st.floats(allow_infinity=False)
finite = st.floats(allow_infinity=False, allow_nan=False)
deviations = st.floats(0, allow_infinity=False) | st.just(math.nan)
chance = st.floats(0, 1)
statuses = st.text(st.characters(codec="utf-8", exclude_characters="\0"), min_size=1).filter(
    lambda text: text.isprintable() and text != "none"
)
absent = st.tuples(finite, st.none(), st.just("none"), chance).map(lambda cells: TrackRow(*cells))
present = st.tuples(
    *(finite, st.integers(), statuses, chance, finite, finite, numbers, numbers, deviations, deviations)
).map(lambda cells: TrackRow(*cells))
located = st.builds(
    lambda row, lon, lat: row._replace(lon_deg=lon, lat_deg=lat), present, st.floats(-180, 180), st.floats(-90, 90)
)


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=st.lists(absent | present | located, max_size=6), unit=st.sampled_from(["px", "m"]))
def test_every_table_reads_back_exactly(tmp_path, rows, unit):
    write_tracks_csv(tmp_path / "t.csv", rows, unit)
    got = read_tracks_csv(tmp_path / "t.csv", unit)
    assert len(got) == len(rows)
    assert all(map(same, got, rows))


BAD = [
    ({"time_s": math.nan}, "has the time nan"),
    ({"existence": 1.5}, "has the existence 1.5; a probability is from 0 to 1"),
    ({"existence": math.nan}, "has the existence nan"),
    ({"status": ""}, "has the status ''; give it a plain name"),
    ({"status": "a\r"}, r"has the status 'a\\r'; give"),
    ({"track": None}, "has the track None and the status 'confirmed'"),
    ({"status": "none"}, "has the track 1 and the status 'none'"),
    ({"track": None, "status": "none"}, "has a position but no track"),
    ({"x": math.nan}, "gives track 1 no position"),
    ({"vx": math.inf}, "has an infinite number"),
    ({"sd_x": -1.0}, "has a negative standard deviation"),
    ({"lon_deg": 3.0}, "has one of lon_deg and lat_deg"),
    ({"lon_deg": 200.0, "lat_deg": 0.0}, "has lon_deg 200.0, lat_deg 0.0; they are at most 180 and 90"),
]


@pytest.mark.parametrize(("change", "match"), BAD)
def test_a_contradiction_is_not_written(tmp_path, change, match):
    with pytest.raises(DataError, match=f"row 2 of the tracks {match}"):
        write_tracks_csv(tmp_path / "t.csv", [ROWS[0], ROWS[1]._replace(**change)])
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_unit(tmp_path):
    with pytest.raises(DataError, match=r"unit='ft': a table of tracks is in 'px' or 'm'"):
        write_tracks_csv(tmp_path / "t.csv", [], unit="ft")


def test_a_generator_that_fails_leaves_nothing(tmp_path):
    def rows():
        yield ROWS[0]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_tracks_csv(tmp_path / "t.csv", rows())
    assert list(tmp_path.iterdir()) == []


LINES = [
    ("", r"line 1: the columns are missing"),
    ("a,b\n", r"line 1: the columns are a,b;"),
    (f"{HEAD}\n0,,none,0.1,,,,,\n", r"line 2: has 9 cells for 10 columns: '0,,none,0.1,,,,,'"),
    (f"{HEAD}\n0,,none,0.1,,,,,,\n1,,none,much,,,,,,\n", r"line 3, column existence: 'much' is no number"),
    (f"{HEAD}\n0,1.5,new,0.1,1,1,,,,\n", r"line 2, column track: '1.5' is no whole number"),
    (f"{HEAD}\n0,one,new,0.1,1,1,,,,\n", r"line 2, column track: 'one' is no whole number"),
    (f"{HEAD}\n0,1,new,0.1,,,,,,\n", r"line 2 gives track 1 no position; .*: '0,1,new"),
    (f'{HEAD}\n0,1,"new,0.1\n', r"line 2: is not CSV"),
]


@pytest.mark.parametrize(("text", "match"), LINES)
def test_a_bad_line_is_named(tmp_path, text, match):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(DataError, match=r"t\.csv, " + match):
        read_tracks_csv(tmp_path / "t.csv")


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(DataError, match=r"gone\.csv: cannot be read \(No such file"):
        read_tracks_csv(tmp_path / "gone.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DataError, match=r"b\.csv: is not text in UTF-8"):
        read_tracks_csv(tmp_path / "b.csv")
