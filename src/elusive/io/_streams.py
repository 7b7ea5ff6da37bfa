"""Frames of a camera or a network stream, decoded to grey by ffmpeg, with the stream's own times."""

from __future__ import annotations

import platform
import queue
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO, cast

from elusive.errors import DataError
from elusive.io._arrived import ArrivedFrame
from elusive.io._stack import check_size
from elusive.io._video import GREY, TO_PIPE, complaint, ffmpeg
from elusive.io._y4m import read_frame, read_header

CAMERA = "camera:"
SCHEMES = ("rtsp", "rtsps", "rtmp", "http", "https", "udp", "tcp", "rtp", "srt")
# no file: a playlist from the network must not make ffmpeg read what is on this machine
PROTOCOLS = "rtsp,rtsps,rtmp,rtmps,http,https,tls,tcp,udp,rtp,srtp,srt,httpproxy,crypto"
SHOWN = re.compile(r"\[Parsed_showinfo.*\] n: *\d+ pts: *\S+ pts_time:(\S+)")
COMPLAINT = re.compile(r"\[(error|fatal|panic)\] (.*)")
TIME_S = 1.0  # a frame's time stands in the log before its pixels in the pipe


def is_stream(source: str) -> bool:
    """Whether a source is a camera or a network stream."""
    return source.startswith(CAMERA) or (source.partition("://")[0].lower() in SCHEMES and "://" in source)


class Stream:
    """A camera or network stream, opened once.

    Parameters
    ----------
    source
        ``camera:0``, or an address such as ``rtsp://host/path``.
    idle_s
        End after this time without a frame; None waits for ever.

    Raises
    ------
    DataError
        If ffmpeg is not installed or there is no such camera.
    """

    def __init__(self, source: str, idle_s: float | None = None) -> None:
        self.name = _without_password(source)
        self._idle_s = idle_s
        self._times: queue.SimpleQueue[float] = queue.SimpleQueue()
        self._said: list[str] = []  # the first complaint and the last
        self._halted = False
        self._process: subprocess.Popen[bytes] | None = None  # from when it is read, or frames would wait in it
        self._command = [
            *(ffmpeg(self.name), "-hide_banner", "-nostdin", "-nostats", "-v", "level+info"),
            # who joins in the middle of a stream waits for a whole picture: errors of decoding until then are let pass
            *("-flags", "low_delay", "-analyzeduration", "1000000", "-max_error_rate", "1", *_input(source)),
            *("-map", "0:v:0", "-vf", f"{GREY},showinfo=checksum=0", "-fps_mode", "passthrough", *TO_PIPE),
        ]

    def halt(self) -> None:
        """End the stream."""
        self._halted = True
        if self._process is not None:
            self._process.kill()

    def __iter__(self) -> Iterator[ArrivedFrame]:
        """Yield the frames.

        Raises
        ------
        DataError
            If there is no video in it, or it breaks off; the sentence gives ffmpeg's own words.
        """
        self._came_s, number = time.monotonic(), 0
        with subprocess.Popen(
            self._command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as process:
            self._process = process
            if self._halted:  # meanwhile
                process.kill()
            log = threading.Thread(target=self._listen, args=(process,), name="ffmpeg's log", daemon=True)
            log.start()
            if self._idle_s is not None:
                threading.Thread(target=self._watch, args=(process,), name="idle", daemon=True).start()
            pipe = cast(IO[bytes], process.stdout)
            try:
                header = read_header(pipe)
                if header is not None:
                    check_size(header.shape, self.name)
                    while (pixels := read_frame(pipe, header)) is not None:
                        self._came_s = time.monotonic()
                        yield ArrivedFrame(f"{self.name}, frame {number}", pixels, self._came_s, self._time_s())
                        number += 1
            finally:
                if not self._halted and header is not None:
                    process.wait()
                process.kill()
                log.join(TIME_S)  # before its pipe is closed
        if self._halted:
            return
        said = [complaint(line) for line in self._said] or [f"ffmpeg ended with status {process.returncode}"]
        if not number:
            raise DataError(f"{self.name}: no video came of it ({said[0]}); check the address, and that it plays.")
        if process.returncode:
            raise DataError(f"{self.name}: broke off after {number} frames ({said[-1]}).")

    def _time_s(self) -> float | None:
        try:
            return self._times.get(timeout=TIME_S)
        except queue.Empty:
            return None

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        """Take frames' times and complaints from ffmpeg's log, and the rest away from it."""
        for line in cast(IO[bytes], process.stderr):
            text = line.decode("utf-8", "replace").rstrip()
            if shown := SHOWN.search(text):
                self._times.put(float(shown[1]) if shown[1] != "NOPTS" else float("nan"))
            elif complained := COMPLAINT.search(text):
                self._said[1:] = [complained[2]]  # of an empty list, the first

    def _watch(self, process: subprocess.Popen[bytes]) -> None:
        assert self._idle_s is not None
        while process.poll() is None:
            left_s = self._came_s + self._idle_s - time.monotonic()
            if left_s <= 0:
                self.halt()
                return
            time.sleep(min(left_s, 0.5))


def _input(source: str) -> list[str]:
    """Return ffmpeg's options for what is read.

    Raises
    ------
    DataError
        If there is no such camera.
    """
    if not source.startswith(CAMERA):
        transport = ["-rtsp_flags", "prefer_tcp"] if source.lower().startswith("rtsp") else []
        return [*transport, "-protocol_whitelist", PROTOCOLS, "-i", source]
    which, system = source.removeprefix(CAMERA), platform.system()
    if system == "Linux":
        device = Path(f"/dev/video{which}") if which.isdecimal() else Path(which)
        if not device.exists():
            known = ", ".join(sorted(path.name.replace("video", CAMERA) for path in Path("/dev").glob("video*")))
            raise DataError(f"{source}: there is no {device}; the cameras here are: {known or 'none'}.")
        return ["-f", "v4l2", "-i", str(device)]
    if system == "Darwin":
        return ["-f", "avfoundation", "-framerate", "30", "-i", which]
    return ["-f", "dshow", "-i", f"video={which}"]  # Windows knows cameras by name


def _without_password(source: str) -> str:
    """Return an address as it may be shown and kept in a configuration."""
    return re.sub(r"(://[^/@:]*):[^/@]*@", r"\1:***@", source)
