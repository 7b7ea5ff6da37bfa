"""Says once, in a terminal, that kernels are being compiled: nobody shall wonder what a first run waits for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from numba.core.event import Event, Listener, install_listener

from elusive.cli.terminal import console


class _Told(Listener):
    def __init__(self) -> None:
        self._is_told = False

    def on_start(self, event: Event) -> None:
        if console.is_terminal and not self._is_told:
            console.print("Compiling: the first run of a filter takes up to a minute longer.", highlight=False)
        self._is_told = True

    def on_end(self, event: Event) -> None:
        pass


@contextmanager
def compilation_told() -> Iterator[None]:
    """Say so at the first compilation within; what is compiled already is loaded without a word."""
    with install_listener("numba:compile", _Told()):
        yield
