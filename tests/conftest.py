"""What all tests share: what was collected is no garbage, and pictures are painted where they are looked at."""

from __future__ import annotations

import gc
import os
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from matplotlib.figure import Figure
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from PIL import Image

from elusive.report import plots

SETTLE, SAVEFIG = plots.settle, Figure.savefig
LOCKS = Path(__file__).parent / "__pycache__" / "locks"  # of this checkout: another has caches of its own
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID")  # one for all processes of a run
COMPOSED = {"cli", "systems"}  # rooms of many short runs, of whose time painting takes more than half
PAINTED = {"test_chart", "test_many", "test_report", "test_scenes", "test_several", "test_simulate"}  # they look

settings.register_profile("same", derandomize=True)  # a suite that passed passes again
settings.load_profile("same")
gc.disable()  # while thousands of tests are collected nothing is left behind


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Walk the workbench after the commands: by one process while others compute, and not by all at the end."""

    def place(item: pytest.Item) -> str:
        return room_of(item.path).replace("workbench", "cli, pages")

    items.sort(key=place)


def pytest_collection_finish() -> None:
    """What is there now stays: no collection need look through it again."""
    gc.freeze()
    gc.enable()


@contextmanager
def held(name: str) -> Iterator[Any]:
    """Let no other process of this checkout be where this one is; gives a file that they share."""
    import fcntl

    LOCKS.mkdir(parents=True, exist_ok=True)
    with open(LOCKS / name, "a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield file


def compiled_once(kernel: Dispatcher, signature: Any, compile_: Any = Dispatcher.compile) -> Any:
    """Compile a kernel while no other process does: one of them compiles, the others take it over from the cache."""
    # its own lock first: a thread that waited for it with a file held would be waited for
    with global_compiler_lock, held(f"{kernel.py_func.__module__}.{kernel.py_func.__qualname__}"):
        return compile_(kernel, signature)


def collected_once() -> Generator[None, Any, Any]:
    """Collect while no other process of the run does, if none has: the others find modules that are compiled."""
    with held("collected") as file:
        file.seek(0)
        if file.read() != RUN:
            collected = yield
            file.truncate(0)
            file.write(str(RUN))
            return collected
    return (yield)


if os.name != "nt":  # which has no such locks
    Dispatcher.compile = compiled_once
    if RUN:
        pytest_collection = pytest.hookimpl(wrapper=True)(collected_once)


def room_of(path: Path) -> str:
    """Return the folder of tests that a file belongs to, or itself."""
    return path.relative_to(Path(__file__).parent).parts[0]


def blank(figure: Figure, path: Any, **_: Any) -> None:
    """Write a picture of the figure's size without painting what it holds."""
    width, height = (figure.get_size_inches() * figure.dpi).astype(int)
    Image.new("L", (width, height), 255).save(path, format="png")


@pytest.fixture(scope="module", autouse=True)
def composed(request: pytest.FixtureRequest) -> Iterator[None]:
    """Let pictures of runs be composed to the last line, and neither laid out nor painted."""
    room = room_of(request.path)
    with pytest.MonkeyPatch.context() as patch:
        if room in COMPOSED and request.path.stem not in PAINTED:
            patch.setattr(plots, "settle", lambda figure: None)
            patch.setattr(Figure, "savefig", blank)
        yield


@pytest.fixture
def painted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paint the pictures of a single test."""
    monkeypatch.setattr(plots, "settle", SETTLE)
    monkeypatch.setattr(Figure, "savefig", SAVEFIG)
