"""netCDF 4 files to be filled, in which a full disk is an error like any other.

The HDF5 library writes much of it only when the file is closed, and tries again when the process ends: where the system
refuses, the process crashes. So it is handed a file that takes everything, and says in the end what was refused.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


class _Patient(io.FileIO):
    """A file whose first refusal is kept in ``refusal``; what comes after it is thrown away."""

    refusal: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of it, or seem to."""
        left = memoryview(data).cast("B")
        size = len(left)
        while left and self.refusal is None:
            left = left[self._tried(super().write, left) or 0 :]
        return size

    def readinto(self, buffer: Any) -> int:
        """Fill the buffer, with zeros where nothing could be written."""
        view = memoryview(buffer).cast("B")
        read = super().readinto(view) or 0
        view[read:] = bytes(len(view) - read)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the file's size, or seem to."""
        return self._tried(super().truncate, size) or 0

    def _tried(self, call: Callable[[Any], int | None], value: Any) -> int | None:
        try:
            return call(value)
        except OSError as error:
            self.refusal = self.refusal or error
            return None


@contextmanager
def new_netcdf(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Give an empty netCDF 4 file, an ``h5netcdf.File``, to fill; what stood in the file is gone.

    The same calls give the same bytes, whatever other threads do.

    Raises
    ------
    OSError
        If the system refuses to write: at the start, or once all was written.
    """
    import h5netcdf  # type: ignore[import-untyped]

    with _Patient(path, "w+b") as disk:
        # Space that is freed is not used again: when a handle is let go must not show in the bytes.
        with h5netcdf.File(disk, "w", fs_strategy="none") as file:
            yield file
        if disk.refusal is not None:
            raise disk.refusal
