"""Tell the user once that kernels are compiling: a first run takes longer."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener


class _First(Listener):
    def __init__(self, announce: Callable[[], None]) -> None:
        self._announce, self._is_known = announce, False

    def on_start(self, event: Event) -> None:
        if not self._is_known:
            self._announce()
        self._is_known = True

    def on_end(self, event: Event) -> None:
        pass


@contextmanager
def announced_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call at the first compilation within; what is compiled already is loaded without a word."""
    with install_listener("numba:compile", _First(announce)):
        yield
