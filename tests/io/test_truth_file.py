"""The truth file: written by NumPy, read back; every bad line named."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from elusive.errors import DataError
from elusive.io import read_truth


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    points=arrays(np.float64, st.tuples(st.integers(1, 6), st.just(2)), elements=st.floats(-1e6, 1e6)),
    delimiter=st.sampled_from([" ", ",", "\t", ", ", "  "]),
    header=st.sampled_from(["", "x y", "# truth\n\nx_px, y_px"]),
)
def test_what_numpy_writes_reads_back(tmp_path, points, delimiter, header):
    points[0] = np.nan
    np.savetxt(tmp_path / "t.txt", points, fmt="%.17g", delimiter=delimiter, header=header, comments="")
    got = read_truth(tmp_path / "t.txt")
    assert got.dtype == np.float64
    np.testing.assert_array_equal(got, points[:, None])


def test_pixels_that_count_from_one(tmp_path):
    (tmp_path / "t.txt").write_text("1 1 # first pixel\nnan nan\n-.5 +2e1\n")
    np.testing.assert_array_equal(
        read_truth(tmp_path / "t.txt", one_based=True)[:, 0], [[0, 0], [np.nan, np.nan], [-1.5, 19]]
    )


@pytest.mark.parametrize("text", ["\ufeffx,y\r\n1,2\r\n", "1\t2", "  1 , 2  \n\n\n"])
def test_harmless_differences_of_form(tmp_path, text):
    (tmp_path / "t.txt").write_bytes(text.encode())
    np.testing.assert_array_equal(read_truth(tmp_path / "t.txt"), [[[1, 2]]])


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "t.txt: holds no position"),
        ("# nothing\n", "t.txt: holds no position"),
        ("x y\n", "t.txt: holds no position"),
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
    ],
)
def test_bad_lines_are_named(tmp_path, text, match):
    (tmp_path / "t.txt").write_text(text)
    with pytest.raises(DataError, match=match):
        read_truth(tmp_path / "t.txt")


def test_missing_and_binary_files(tmp_path):
    with pytest.raises(DataError, match=r"gone\.txt: cannot be read"):
        read_truth(tmp_path / "gone.txt")
    (tmp_path / "b.txt").write_bytes(b"\x80\x81")
    with pytest.raises(DataError, match="is not text in UTF-8"):
        read_truth(tmp_path / "b.txt")
