"""Frames of a video, decoded to grey by ffmpeg through a pipe of self-describing YUV4MPEG2 frames.

The pipe is ours and not imageio's: imageio leaves its pipes open, and gives 8-bit colour whatever the recording holds.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

import numpy as np

from elusive.errors import DataError
from elusive.io._stack import Stack, check_size

ADVICE = "check that it plays, or convert it (ffmpeg -i IN -c:v ffv1 OUT.mkv)."


class _Pipe(NamedTuple):
    shape: tuple[int, int]
    rate_hz: float | None
    dtype: np.dtype[Any]
    frames: IO[bytes]
    process: subprocess.Popen[bytes]
    log: IO[bytes]


def open_video(path: Path) -> Stack:
    """Read the first video stream at constant rate; the length is known only once the end is reached.

    The pixels are the luma of the stream's own colour matrix, full range, at 8 bits or, of deeper recordings, up to 16.
    """
    with _decode(path) as pipe:
        shape, rate_hz = pipe.shape, pipe.rate_hz
    check_size(shape, str(path))

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with _decode(path) as pipe:
            size = shape[0] * shape[1] * pipe.dtype.itemsize
            k = 0
            while stop is None or k < stop:
                mark = pipe.frames.readline(256)
                data = pipe.frames.read(size) if mark.startswith(b"FRAME") else b""
                if len(data) < size:
                    break
                if k >= start:
                    yield f"{path}, frame {k}", np.frombuffer(data, pipe.dtype).reshape(shape)
                k += 1
            else:
                return
            fault = _fault(pipe)
            if fault:
                raise DataError(f"{path}: breaks off after {k} frames ({fault}); pass stop={k} to use those before.")

    return Stack(str(path), shape, None, rate_hz, read)


@contextmanager
def _decode(path: Path) -> Iterator[_Pipe]:
    command = [
        *(_ffmpeg(path), "-v", "error", "-nostdin"),
        # A playlist in disguise must not make ffmpeg fetch from a network.
        *("-protocol_whitelist", "file", "-i", str(path.absolute())),
        *("-map", "0:v:0", "-vf", "format=gray|gray10le|gray12le|gray16le", "-strict", "-1"),
        *("-f", "yuv4mpegpipe", "-"),
    ]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
        with process:
            try:
                frames = cast(IO[bytes], process.stdout)
                header = frames.readline(1024).decode("ascii", "replace")
                match = re.match(r"YUV4MPEG2 W(\d+) H(\d+) F(\d+):(\d+) .*Cmono(\d*)", header)
                if match is None:
                    fault = _words(process, log)
                    raise DataError(f"{path}: holds no video that can be read ({fault}); {ADVICE}")
                cols, rows, numerator, denominator = (int(match[i]) for i in range(1, 5))
                rate_hz = numerator / denominator if numerator and denominator else None
                dtype = np.dtype("<u2" if match[5] else "u1")
                yield _Pipe((rows, cols), rate_hz, dtype, frames, process, log)
            finally:
                process.kill()


def _fault(pipe: _Pipe) -> str | None:
    status = pipe.process.wait()
    return _words(pipe.process, pipe.log) if status or pipe.log.seek(0, os.SEEK_END) else None


def _words(process: subprocess.Popen[bytes], log: IO[bytes]) -> str:
    """Return ffmpeg's own first complaint, without the addresses it puts before them."""
    status = process.wait()
    log.seek(0)
    lines = log.read().decode("utf-8", "replace").strip().splitlines()
    return (
        re.sub(r"^(\[[^\]]*\]\s*)+", "", lines[0])[:160].rstrip(".") if lines else f"ffmpeg ended with status {status}"
    )


def _ffmpeg(path: Path) -> str:
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise DataError(
            f"{path}: reading a video needs ffmpeg; install it with: pip install 'elusive[video]'"
        ) from None
