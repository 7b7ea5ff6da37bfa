"""Live runs that pages show while they go on: of a command that the workbench runs, or of an `elusive serve`."""

from __future__ import annotations

import asyncio
import http.client
import json
import threading
from collections import deque
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

from elusive.errors import DataError
from elusive.io.sinks.formats import json_line
from elusive.report.live import MOST, LiveDrawing
from elusive.workbench.jobs import Errand

LOOK_S = 0.01  # between looks at what is new
PICTURES = 150  # latest that are told to a page that is loaded anew
LIVE: dict[str, Live] = {}
"""Those that pages may fetch."""
HELD_MOST = 8
SERVED = ("health.url", "token")  # files of a folder that `elusive serve` keeps
REACH_S, PATIENCE_S = 20.0, 60.0  # to reach a serve; with one that says nothing, as it has much to do


class Live(Errand):
    """A live run as it is told to pages.

    Its work ends as the source does, or when it is stopped; what it wrote until then is whole. A second Cancel does
    not wait for that.
    """

    ends_by = "Stop"

    def __init__(self, title: str) -> None:
        super().__init__()
        self._drawing = LiveDrawing(title)
        self._turn = threading.Lock()
        self._first = ""
        self._steps: deque[tuple[int, str]] = deque(maxlen=MOST)
        self._pictures: dict[int, str] = {}
        self._count = 0
        self.is_over, self.stopping = False, threading.Event()
        self.key = f"{id(self):x}"
        LIVE[self.key] = self
        for key in list(LIVE)[:-HELD_MOST]:
            del LIVE[key]

    def cancel(self) -> None:
        """Let the source end; called again, do not wait for what is still to be written."""
        if self.stopping.is_set():
            super().cancel()
        self.stopping.set()

    def take(self, line: str) -> None:
        """Take in a line that was told; one that is none of a live run is left out."""
        try:
            for drawn in self._drawing.take(json.loads(line)):
                self._add(drawn)
        except (ValueError, KeyError, TypeError, AttributeError):
            return

    def _add(self, drawn: dict[str, Any]) -> None:
        if not self._first:
            self._first = json_line(drawn)
            return
        plane = drawn["panels"][0]
        layers = plane["layers"]
        with self._turn:
            self._count += 1
            if layers and "picture" in layers[0]:
                self._pictures[self._count] = json_line(drawn)
                self._pictures.pop(self._count - PICTURES, None)
                plane["layers"] = layers[1:]
            self._steps.append((self._count, json_line(drawn)))
        self.done = self._count

    def since(self, number: int) -> tuple[int, list[str]]:
        """Return the number of the latest step, and those after one, as text."""
        with self._turn:
            behind = min(self._count - number, len(self._steps))
            new = [self._steps[i] for i in range(len(self._steps) - behind, len(self._steps))]
            return self._count, [self._pictures.get(count, text) for count, text in new]

    async def lines(self) -> AsyncIterator[str]:
        """Yield the drawing, then lists of what is added to it, until the run is over."""
        number = 0
        yield "\n"  # so that the page knows that it is heard
        while not self._first:
            if self.is_over:
                return
            await asyncio.sleep(LOOK_S)
        yield self._first + "\n"
        while True:
            over = self.is_over
            number, new = self.since(number)
            if new:
                yield f"[{','.join(new)}]\n"
            elif over:
                return
            await asyncio.sleep(LOOK_S)


def watch(address: str, live: Live) -> None:
    """Take in what an `elusive serve` tells until it ends, or watching is stopped.

    Parameters
    ----------
    address
        Of its health page, with ``?token=``.
    live
        Is told the steps.

    Raises
    ------
    DataError
        If it cannot be reached, or refuses the token.
    """
    parts = urlsplit(address)
    try:
        asked = http.client.HTTPConnection(parts.hostname or "", parts.port or 80, timeout=REACH_S)
    except (ValueError, http.client.InvalidURL):
        raise DataError("the serve's address: is none; it looks like http://127.0.0.1:8765/?token=...") from None
    where = f"{parts.hostname}:{parts.port}"
    token = parse_qs(parts.query).get("token", [""])[0]
    try:
        asked.connect()
        asked.sock.settimeout(PATIENCE_S)
        asked.request("GET", "/steps.ndjson", headers={"Authorization": f"Bearer {token}"})
        answer = asked.getresponse()
        if answer.status != http.client.OK:
            raise DataError(f"{where}: does not tell its steps ({answer.status} {answer.reason}); check the token.")
        while not live.stopping.is_set() and (line := answer.readline()):
            live.take(line.decode())
    except (OSError, http.client.HTTPException, ValueError) as error:
        if isinstance(error, DataError):  # said already
            raise
        if not live.done:
            raise DataError(f"{where}: cannot be reached ({error}); is that `elusive serve` running?") from None
    finally:
        live.is_over = True
        asked.close()


def serves(folder: Path) -> dict[str, str]:
    """Return addresses of what is or was served from folders in the workbench's, by name."""
    found = {}
    for one in sorted(folder.iterdir()):
        if not one.is_symlink() and all((one / name).is_file() for name in SERVED):
            url, token = ((one / name).read_text(encoding="utf-8").strip() for name in SERVED)
            found[one.name] = f"{url}?token={token}"
    return found
