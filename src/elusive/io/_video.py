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

from elusive.errors import DataError
from elusive.io._stack import Stack, check_size
from elusive.io._y4m import Y4m, read_frame, read_header

GREY = "format=gray|gray10le|gray12le|gray16le"  # the first of at least the stream's depth
TO_PIPE = ("-strict", "-1", "-f", "yuv4mpegpipe", "-")
ADVICE = "check that it plays, or convert it (ffmpeg -i IN -c:v ffv1 OUT.mkv)."


class _Pipe(NamedTuple):
    header: Y4m
    frames: IO[bytes]
    process: subprocess.Popen[bytes]
    log: IO[bytes]


def open_video(path: Path) -> Stack:
    """Read the first video stream at constant rate; the length is known only once the end is reached.

    The pixels are the luma of the stream's own colour matrix, full range, at 8 bits or, of deeper recordings, up to 16.
    """
    with _decode(path) as pipe:
        shape, rate_hz = pipe.header.shape, pipe.header.rate_hz
    check_size(shape, str(path))

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        with _decode(path) as pipe:
            k = 0
            while stop is None or k < stop:
                frame = read_frame(pipe.frames, pipe.header)
                if frame is None:
                    break
                if k >= start:
                    yield f"{path}, frame {k}", frame
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
        *(ffmpeg(str(path)), "-v", "error", "-nostdin"),
        # A playlist in disguise must not make ffmpeg fetch from a network.
        *("-protocol_whitelist", "file", "-i", str(path.absolute())),
        *("-map", "0:v:0", "-vf", GREY, *TO_PIPE),
    ]
    with tempfile.TemporaryFile() as log:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
        with process:
            try:
                frames = cast(IO[bytes], process.stdout)
                header = read_header(frames)
                if header is None:
                    fault = _words(process, log)
                    raise DataError(f"{path}: holds no video that can be read ({fault}); {ADVICE}")
                yield _Pipe(header, frames, process, log)
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
    return complaint(lines[0]) if lines else f"ffmpeg ended with status {status}"


def complaint(line: str) -> str:
    """Return what a line of ffmpeg's says, without the addresses it puts before it."""
    return re.sub(r"^(\[[^\]]*\]\s*)+", "", line)[:160].rstrip(".")


def ffmpeg(source: str) -> str:
    """Return the path of the program.

    Raises
    ------
    DataError
        If it is not installed.
    """
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError):
        raise DataError(
            f"{source}: reading a video needs ffmpeg; install it with: pip install 'elusive[video]'"
        ) from None
