"""Work off the event loop: in a few threads, with progress and Cancel; the page goes on answering."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

Done = TypeVar("Done")
WORKERS = 4
PATIENCE_S = 1.0  # with which work that was called off is waited for; what it comes to then is nobody's
POOL = ThreadPoolExecutor(WORKERS, thread_name_prefix="elusive-work")
WAITING = ThreadPoolExecutor(24, thread_name_prefix="elusive-wait")  # for other processes; each tab at most once


class CancelledError(Exception):
    """The user called a job off."""


class Job:
    """What a page knows of its work, and tells it: how much is done, of how much if that is known."""

    ends_by = "Cancel"  # what a person presses
    pool = POOL  # whose threads do it

    def __init__(self) -> None:
        self._off = threading.Event()
        self.done = 0
        self.total: int | None = None

    def advance(self, done: int) -> None:
        """Note how far it is; called by the work itself.

        Raises
        ------
        CancelledError
            If it was called off.
        """
        self.done = done
        if self._off.is_set():
            raise CancelledError

    def cancel(self) -> None:
        """Call it off: the work ends at its next step, and is not waited for until then."""
        self._off.set()

    @property
    def is_off(self) -> bool:
        """Whether it was called off."""
        return self._off.is_set()


class Errand(Job):
    """A job that another process does, or another machine: it is not put off by what is computed here."""

    pool = WAITING


class Latest:
    """Tells whether what was asked for was asked for last: of what is done away, the later may come first."""

    def __init__(self) -> None:
        self._asked = 0

    def ask(self) -> Callable[[], bool]:
        """Ask anew; what is returned tells whether nothing was asked for since."""
        self._asked = mine = self._asked + 1
        return lambda: mine == self._asked


async def away(work: Callable[[], Done], job: Job | None = None) -> Done:
    """Do work in a thread and wait for it without holding up the page.

    Raises
    ------
    CancelledError
        If ``job`` was called off, though the work may not have noticed.
    """
    done = asyncio.get_running_loop().run_in_executor(POOL if job is None else job.pool, work)
    while job is not None and not done.done():
        await asyncio.wait([done], timeout=PATIENCE_S)
        if job.is_off and not done.done():
            done.add_done_callback(lambda late: late.exception())
            raise CancelledError
    return await done
