"""Where a target truly was: read, interpolated, refused."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.path_truth import read_path_truth


def test_places_are_interpolated_within_their_times(tmp_path):
    file = tmp_path / "truth.csv"
    file.write_text("# made up\ntime_s,name,x_m,y_m,z_m\n1,a,0,10,5\n\n3,a,4,20,7\n")
    truth = read_path_truth(file)
    np.testing.assert_allclose(truth.interpolated([2.0]), [[[2, 15, 6]]])
    assert np.isnan(truth.interpolated([0.9, 3.1])).all()
    file.write_text("time_s,x_m,y_m\n1,0,10\n3,4,20\n")
    np.testing.assert_allclose(read_path_truth(file).interpolated([1.5]), [[[1, 12.5]]])
    file.write_text("time_s,person,x_m,y_m\n1,Ann,0,10\n1,Bob,1,1\n3,Ann,4,20\n")
    both = read_path_truth(file)
    assert both.names == ("Ann", "Bob")
    np.testing.assert_allclose(both.interpolated([2.0]), [[[2, 15], [np.nan, np.nan]]])


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("time_s,x_m\n1,2\n", "line 1: the columns are 'time_s,x_m'; name them time_s,x_m,y_m"),
        ("time_s,x_m,y_m\n1,2\n", "line 2: has 2 cells for 3 columns"),
        ("time_s,x_m,y_m\n1,2,far\n", "line 2, column y_m: 'far' is no number"),
        ("time_s,x_m,y_m\n1,2,3\n1,2,3\n", "line 3: the time 1 s comes after 1 s"),
        ("time_s,x_m,y_m\n", "holds no place"),
        ("", "is empty; write time_s,x_m,y_m"),
    ],
)
def test_refusals(tmp_path, text, sentence):
    file = tmp_path / "truth.csv"
    file.write_text(text)
    with pytest.raises(DataError, match=sentence):
        read_path_truth(file)
