"""Tables as CSV: quoted as the standard library reads them back, and short where they are results."""

import csv
import math

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.csv_files import csv_text, write_csv, write_results


def test_what_is_written_is_read_back(tmp_path):
    rows = [("a, b", 'say "x"', 0.1 + 0.2), ("", None, -3)]
    write_csv(tmp_path / "a.csv", ("name", "words", "number"), iter(rows))
    text = (tmp_path / "a.csv").read_bytes()
    assert text == csv_text(("name", "words", "number"), rows).encode()
    assert b"\r" not in text
    back = list(csv.reader(text.decode().splitlines()))
    assert back == [["name", "words", "number"], ["a, b", 'say "x"', "0.30000000000000004"], ["", "", "-3"]]
    assert float(back[1][2]) == rows[0][2]


def test_results_have_four_digits_and_an_empty_cell_where_there_is_no_number(tmp_path):
    rows = [("x", 12345.678, 7), ("y", math.nan, np.float64(0.00012345678))]
    write_results(tmp_path / "a.csv", ("name", "value", "other"), rows)
    assert (tmp_path / "a.csv").read_text() == "name,value,other\nx,1.235e+04,7\ny,,0.0001235\n"


def test_a_row_that_fails_leaves_the_earlier_file(tmp_path):
    (tmp_path / "a.csv").write_text("mine")

    def rows():
        yield (1,)
        raise DataError("row 2 is wrong")

    with pytest.raises(DataError, match="row 2"):
        write_csv(tmp_path / "a.csv", ("x",), rows())
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == "mine"
    with pytest.raises(DataError, match="there is no folder"):
        write_csv(tmp_path / "none" / "a.csv", ("x",), [])
