"""The truth file: tables and lines, written and read back; every bad line named."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from elusive.errors import DataError
from elusive.io import Truth, read_truth, write_truth


def saved(folder, text):
    (folder / "t.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / "t.csv"


def dense(path, unit="px", frames=None, **more):
    truth = read_truth(path, unit, **more)
    return truth.at(np.arange(truth.lines or frames))


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=arrays(np.float64, st.tuples(st.integers(1, 6), st.just(2)), elements=st.floats(-1e6, 1e6)),
    delimiter=st.sampled_from([" ", ",", "\t", ", ", "  "]),
    header=st.sampled_from(["", "x y", "# truth\n\nx_px, y_px"]),
)
def test_what_numpy_writes_reads_back(tmp_path, points, delimiter, header):
    points[0] = np.nan
    np.savetxt(tmp_path / "t.txt", points, fmt="%.17g", delimiter=delimiter, header=header, comments="")
    np.testing.assert_array_equal(dense(tmp_path / "t.txt"), points[:, None])


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    places=arrays(np.float64, st.tuples(st.integers(1, 5), st.integers(1, 3), st.just(2)), elements=st.floats(-9, 9)),
    absent=st.integers(0, 2**15 - 1),
)
def test_a_table_reads_back_exactly(tmp_path, places, absent):
    """Whoever is never there is not in the table; all others keep their names."""
    gone = np.array([(absent >> bit) & 1 for bit in range(places[..., 0].size)], bool).reshape(places.shape[:2])
    places[gone] = np.nan
    path = tmp_path / "t.csv"
    write_truth(path, Truth.of_frames(places), "px")
    assert path.read_text().startswith("frame,track,x_px,y_px\n")
    if gone.all():
        with pytest.raises(DataError, match=r"t\.csv: holds no place; write frame,x_px,y_px"):
            read_truth(path, "px")
        return
    read = read_truth(path, "px")
    assert sorted(read.names) == [str(n + 1) for n in range(places.shape[1]) if not gone[:, n].all()]
    found = read.at(np.zeros(len(places)))
    for column, name in enumerate(read.names):
        np.testing.assert_array_equal(found[:, column], places[:, int(name) - 1])


@pytest.mark.parametrize(
    "text",
    [
        "frame,track,x_px,y_px\n0,a,1,2\n0,b,5,6\n2,a,3,4\n",
        "\ufefftrack;y_px;x_px;colour;frame\r\n# made up\r\na;2;1;red;0\r\n\r\na;4;3;;2\r\nb;6;5;blue;0\r\n",
        "time_s\ttrack\tx_px\ty_px\n0\ta\t1\t2\n0\tb\t5\t6\n1\ta\t2\t3\n2\ta\t3\t4\n",
    ],
)
def test_tables_of_frames_and_of_times(tmp_path, text):
    truth = read_truth(saved(tmp_path, text), "px")
    assert truth.names == ("a", "b")
    middle = [2, 3] if not truth.by_frame else [np.nan] * 2  # between two times places are known, between frames not
    gone = [np.nan] * 2
    np.testing.assert_array_equal(
        truth.at([0, 1, 2, 3]), [[[1, 2], [5, 6]], [middle, gone], [[3, 4], gone], [gone] * 2]
    )
    np.testing.assert_array_equal(truth.aligned([2.0], start=2), [[[3, 4], gone]])


def test_a_signal_and_heights(tmp_path):
    found = read_truth(saved(tmp_path, "frame,track,x_samples\n3,1,7.5\n4,1,8\n"), "samples")
    np.testing.assert_array_equal(found.at([0, 0], start=3), [[[7.5]], [[8]]])
    text = "time_s,person,x_m,y_m,z_m\n1,Ann,0,10,5\n1,Bob,1,1,1\n3,Ann,4,20,7\n"
    both = read_truth(saved(tmp_path, text), "m")
    assert both.names == ("Ann", "Bob")
    np.testing.assert_allclose(both.at([2.0]), [[[2, 15, 6], [np.nan] * 3]])
    assert np.isnan(both.at([0.9, 3.1])).all()
    np.testing.assert_allclose(
        both.distance(np.array([1.0, 2.0, 4.0]), np.array([[1.0, 2], [2, 16], [0, 0]])), [1, 1, np.nan]
    )


def test_what_counts_from_one(tmp_path):
    lines = saved(tmp_path, "1 1 # first pixel\nnan nan\n-.5 +2e1\n")
    np.testing.assert_array_equal(dense(lines, one_based=True)[:, 0], [[0, 0], [np.nan, np.nan], [-1.5, 19]])
    table = saved(tmp_path, "frame,x_px,y_px\n1,1,2\n3,4,5\n")
    np.testing.assert_array_equal(dense(table, frames=3, one_based=True)[:, 0], [[0, 1], [np.nan] * 2, [3, 4]])
    with pytest.raises(
        DataError, match="in frame 3, and the recording's last is 2: frames count from 0; if it counts fr"
    ):
        read_truth(table, "px").aligned(np.arange(3))
    with pytest.raises(DataError, match="line 2, column frame: 0 is no frame; they are whole numbers from 1"):
        read_truth(saved(tmp_path, "frame,x_px,y_px\n0,1,2\n"), "px", one_based=True)


@pytest.mark.parametrize("text", ["\ufeffx,y\r\n1,2\r\n", "1\t2", "  1 , 2  \n\n\n"])
def test_harmless_differences_of_form(tmp_path, text):
    np.testing.assert_array_equal(dense(saved(tmp_path, text)), [[[1, 2]]])


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "t.csv: holds no position"),
        ("# nothing\n", "t.csv: holds no position"),
        ("x y\n", "t.csv: holds no position"),
        ("1 2\n3\n", "line 2: '3' is no pair of numbers"),
        ("1 2\n\n3 4 5\n", "line 3: '3 4 5' is no pair of numbers"),
        ("1,5 2,5\n", "line 1: '1,5 2,5' is no pair of numbers"),
        ("1 2\nx y\n", "line 2: 'x y' is no pair of numbers"),
        ("x y\nx y\n", "line 2: 'x y' is no pair of numbers"),
        ("1 two\n", "line 1: '1 two' is no pair of numbers"),
        ("1_0 2\n", "line 1: '1_0 2' is no pair"),
        ("inf 2\n", "line 1: 'inf 2' is no pair"),
        ("1e999 2\n", "line 1: '1e999 2' is half a position"),
        ("nan 2\n", "line 1: 'nan 2' is half a position"),
        ("1,,2\n", "line 1: '1,,2' is no pair"),
        (b"\x80\x81", "is not text in UTF-8"),
        ("t,id,x,y\n0,1,2,3\n", "line 1: the columns are 't,id,x,y'; name them frame,x_px,y_px"),
        ("frame,track,x,y\n0,1,2,3\n", "line 1: the columns are 'frame,track,x,y'; name them frame,x_px,y_px"),
        ("frame,track,x_m,y_m\n0,1,2,3\n", "t.csv: its places are x_m,y_m; here they are x_px,y_px"),
        ("x_m y_m\n2 3\n", "t.csv: its places are x_m,y_m; here they are x_px,y_px"),
        (
            "frame,x_px,y_px\n0,1,2\n1,3,4\n1,5,6\n",
            "line 4: target 1 is there twice at frame 1; tell several targets ap",
        ),
        (
            "frame,track,x_px,y_px\n0,b,1,2\n0,b,1,2\n",
            "line 3: target b is there twice at frame 0; leave one of the rows",
        ),
        ("frame,track,x_px,y_px\n5,b,1,2\n4,b,1,2\n", "line 3: frame 4 comes after frame 5; a target's times increase"),
        ("frame,x_px,y_px\n0.5,1,2\n", "line 2, column frame: 0.5 is no frame"),
        ("frame,x_px,y_px\n-1,1,2\n", "line 2, column frame: -1 is no frame"),
        ("frame,x_px,y_px\n0,1,nan\n", "line 2, column y_px: 'nan' is no number"),
        ("frame,x_px,y_px\n0,1\n", "line 2: has 2 cells for 3 columns"),
    ],
)
def test_bad_lines_are_named(tmp_path, text, match):
    with pytest.raises(DataError, match=match):
        read_truth(saved(tmp_path, text), "px")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("time_s,x_m\n1,2\n", "line 1: the columns are 'time_s,x_m'; name them time_s,x_m,y_m"),
        ("time_s,x_m,y_m\n1,2\n", "line 2: has 2 cells for 3 columns"),
        ("time_s,x_m,y_m\n1,2,far\n", "line 2, column y_m: 'far' is no number"),
        ("time_s,x_m,y_m\n1,2,3\n1,2,3\n", "line 3: target 1 is there twice at 1 s; tell several targets apart"),
        ("time_s,x_px,y_px\n1,2,3\n", "its places are x_px,y_px; here they are x_m,y_m"),
        ("frame,x_m,y_m\n1,2,3\n", "counts frames; here a target is at a place at a time, time_s"),
        ("time_s,x_m,y_m\n", "holds no place"),
        ("", "is empty; write time_s,x_m,y_m"),
    ],
)
def test_bad_tables_in_metres_are_named(tmp_path, text, match):
    with pytest.raises(DataError, match=match):
        read_truth(saved(tmp_path, text), "m")


def test_a_truth_of_another_recording_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"gone\.txt: cannot be read"):
        read_truth(tmp_path / "gone.txt", "px")
    frames = read_truth(saved(tmp_path, "frame,x_px,y_px\n0,1,2\n7,1,2\n"), "px")
    with pytest.raises(
        DataError, match="has a target in frame 7, and the recording's last is 5: frames count from 0\\."
    ):
        frames.aligned(np.arange(6))
    assert frames.aligned(np.arange(6), whole=False).shape == (6, 1, 2)  # more of the file was not asked for
    lines = read_truth(saved(tmp_path, "1 2\n3 4\n"), "px")
    with pytest.raises(DataError, match="has 2 rows for 3 frames"):
        lines.aligned(np.arange(3))
    times = read_truth(saved(tmp_path, "time_s,x_m,y_m\n100,1,2\n700,1,2\n"), "m")
    assert np.isfinite(times.aligned([99.0, 100.0])[1]).all()
    with pytest.raises(DataError, match=r"is of 100 to 700 s, and the recording of 0 to 0\.7 s; count both"):
        times.aligned([0.0, 0.7])  # milliseconds
