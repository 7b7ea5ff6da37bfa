"""The files of a cell: whole, in order, of one edition."""

from __future__ import annotations

import pytest

from elusive.charts.s57_files import Identity, check_sequence, read_identity
from elusive.errors import DataError

from .scenes import cell_path, head


def write(folder, **files):
    """Write files by their number, and return the base."""
    for number, content in files.items():
        (folder / f"AA5TEST.{number[1:]}").write_bytes(content)
    return folder / "AA5TEST.000"


def test_the_head_is_read(tmp_path):
    base = write(tmp_path, n000=head(edition="7", update=3))
    assert read_identity(base) == Identity(1, "AA5TEST.000", "7", 3)


def test_real_cells_and_their_updates():
    identity, last = check_sequence(cell_path("US4MD81M"))
    assert (identity.name, identity.edition, identity.update, last) == ("US4MD81M.000", "31", 0, 3)


def test_a_base_alone_and_one_with_updates(tmp_path):
    base = write(tmp_path, n000=head())
    assert check_sequence(base)[1] == 0
    write(tmp_path, n001=head(update=1, purpose=2), n002=head(update=2, purpose=2))
    assert check_sequence(base)[1] == 2


def test_a_reissue_stands_alone(tmp_path):
    base = write(tmp_path, n000=head(update=5))
    assert check_sequence(base)[1] == 5
    write(tmp_path, n006=head(update=6, purpose=2))
    with pytest.raises(DataError, match="re-issue at update 5"):
        check_sequence(base)


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"n000": head(), "n002": head(update=2, purpose=2)}, r"update \.001 is missing, \.002 is there"),
        ({"n000": head(), "n001": head(update=1), "n003": head(update=3)}, r"update \.002 is missing"),
        ({"n000": head(), "n001": head(update=1, edition="3")}, r"\.001: is update 1 of edition 3, where .* edition 2"),
        ({"n000": head(), "n001": head(update=2)}, r"\.001: is update 2 of edition 2, where update 1"),
        ({"n000": head(), "n001": head(update=1, edition="0")}, "cancels the cell"),
        ({"n000": head(), "n001": b"no"}, r"\.001: is not an S-57 file"),
        ({"n000": head(update=1, purpose=2)}, "holds update 1, not a base cell"),
        ({"n000": b"hello " * 100}, "is not an S-57 file"),
        ({"n000": b""}, "is not an S-57 file"),
        ({"n000": head()[:70]}, "is not an S-57 file"),
        ({"n000": head(records=9)}, r"\.000: is cut short, 3 of 9 records are there"),
        ({"n000": head().replace(b"DSSI", b"DSSX")}, "does not state its number of records"),
        ({"n000": b"<OGRVRTDataSource></OGRVRTDataSource>"}, "is not an S-57 file"),
    ],
)
def test_what_is_not_whole_is_refused(tmp_path, files, message):
    with pytest.raises(DataError, match=message):
        check_sequence(write(tmp_path, **files))


def test_what_is_no_base_cell_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"none\.000: cannot be read \(No such file"):
        check_sequence(tmp_path / "none.000")
    with pytest.raises(DataError, match=r"give the base cell, \.000"):
        check_sequence(tmp_path / "none.001")
    with pytest.raises(DataError, match=r"give a chart on \.000, \.geojson or \.shp"):
        check_sequence(tmp_path / "chart.tif")
    (tmp_path / "folder.000").mkdir()
    with pytest.raises(DataError, match="Is a directory"):
        check_sequence(tmp_path / "folder.000")
