"""YUV4MPEG2: a stream of frames that says itself what they are; the luma of each."""

from __future__ import annotations

import re
from typing import IO, Any, NamedTuple

import numpy as np

MAGIC = b"YUV4MPEG2"
LINE = 1024  # bytes of a header at most
HALVED = {"420": (2, 2), "422": (1, 2), "411": (1, 4), "444": (1, 1), "mono": None}  # rows and columns of the colours


class Y4m(NamedTuple):
    """What a stream's header says."""

    shape: tuple[int, int]  # rows, columns
    rate_hz: float | None
    dtype: np.dtype[Any]
    chroma: int  # bytes after the luma of each frame

    @property
    def size(self) -> int:
        """Bytes of a frame's luma."""
        return self.shape[0] * self.shape[1] * self.dtype.itemsize


def read_header(stream: IO[bytes]) -> Y4m | None:
    """Read the header; None where there is none that is understood."""
    line = stream.readline(LINE).decode("ascii", "replace")
    if not line.startswith(MAGIC.decode()) or not line.endswith("\n"):
        return None
    given = {word[0]: word[1:] for word in line.split()[1:]}
    colour = re.match(r"(mono|\d{3})(\D*?)p?(\d*)$", given.get("C", "420"))
    if colour is None or colour[1] not in HALVED or not (given.get("W", "").isdigit() and given.get("H", "").isdigit()):
        return None
    rows, columns = int(given["H"]), int(given["W"])
    dtype = np.dtype("<u2" if colour[3] and int(colour[3]) > 8 else "u1")
    numerator, _, denominator = given.get("F", "0:0").partition(":")
    rate_hz = int(numerator) / int(denominator) if int(numerator or 0) and int(denominator or 0) else None
    halved = HALVED[colour[1]]
    chroma = 0 if halved is None else 2 * -(-rows // halved[0]) * -(-columns // halved[1])
    alpha = rows * columns if colour[2] == "alpha" else 0
    return Y4m((rows, columns), rate_hz, dtype, (chroma + alpha) * dtype.itemsize)


def read_frame(stream: IO[bytes], header: Y4m) -> np.ndarray[Any, Any] | None:
    """Read the next frame's luma, ``(rows, columns)``; None at the end, also in the middle of a frame."""
    mark = stream.readline(LINE)
    data = stream.read(header.size) if mark.startswith(b"FRAME") else b""
    if len(data) < header.size or len(stream.read(header.chroma)) < header.chroma:
        return None
    return np.frombuffer(data, header.dtype).reshape(header.shape)
