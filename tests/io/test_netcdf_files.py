"""netCDF files: the same bytes each time, and a disk that is full."""

import resource
import subprocess
import sys

import h5netcdf
import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.atomic import atomic_path
from elusive.io.netcdf_files import new_netcdf

VALUES = np.random.default_rng(0).normal(size=20_000)
FILLED = """
import sys
import numpy as np
from tests.io.test_netcdf_files import fill
fill(sys.argv[1])
"""


def fill(path):
    with atomic_path(path) as temporary, new_netcdf(temporary) as file:
        file.dimensions = {"row": len(VALUES)}
        for name in ("x", "y"):
            file.create_variable(name, ("row",), VALUES.dtype, data=VALUES).attrs.update({"units": "m"})
        for start in range(0, len(VALUES), 7000):
            file["y"][start : start + 7000] = -VALUES[start : start + 7000]


def test_what_is_written_reads_back(tmp_path):
    (tmp_path / "a.nc").write_bytes(b"what stood there" * 100_000)
    fill(tmp_path / "a.nc")
    with h5netcdf.File(tmp_path / "a.nc", "r") as file:
        np.testing.assert_array_equal(file["x"][:], VALUES)
        np.testing.assert_array_equal(file["y"][:], -VALUES)
        assert file["x"].attrs["units"] == "m"
    fill(tmp_path / "b.nc")
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@pytest.mark.parametrize("held", [False, True])
def test_when_a_handle_is_let_go_does_not_show(tmp_path, held):
    """A coordinate takes the place of its dimension's dummy, which a handle keeps alive."""
    written = []
    for name, hold in (("a.nc", held), ("b.nc", False)):
        with new_netcdf(tmp_path / name) as file:
            for dimension in ("track", "row"):
                file.dimensions[dimension] = 4
            handle = file._h5file["track"] if hold else None
            for variable in ("track", "row_size"):
                file.create_variable(variable, ("track",), data=np.arange(4))
            del handle
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]


def test_a_full_disk_is_a_sentence(tmp_path):
    for size in (10, 3000, 30_000, 200_000):  # in the head, in the values, in what is written on closing
        soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
        try:
            with pytest.raises(DataError, match=r"a\.nc: cannot be written \(File too large\); check space"):
                fill(tmp_path / "a.nc")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert list(tmp_path.iterdir()) == []


def test_a_process_that_met_a_full_disk_ends_as_any_other(tmp_path):
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, -1)){FILLED}"
    ended = subprocess.run(
        [sys.executable, "-B", "-c", limited, str(tmp_path / "a.nc")], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 1  # a crash would be negative
    assert ended.stderr.count("Traceback") == 1  # that of the DataError itself
    assert "DataError" in ended.stderr.splitlines()[-1]
