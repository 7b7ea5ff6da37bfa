"""What a run of one system came to, as its page shows it; charts and table of it and of the run kept beside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from elusive.contracts import Array
from elusive.model import Model
from elusive.workbench.blocks import HELD
from elusive.workbench.exports import table_html
from elusive.workbench.jobs import Job

THIS, KEPT, QUIET = "#e8590c", "#4c8dff", "#8a94a3"
MORE = ("#12b886", "#a371f7", "#f2b705")  # further lines of one run
Scene = TypeVar("Scene", bound=Model)


class Line(NamedTuple):
    """One line of a chart."""

    name: str
    y: Array  # (T,), NaN where there is none
    quiet: bool = False  # for reference: thin, dashed, not compared


class Curve(NamedTuple):
    """One chart over the frames of a run."""

    title: str
    ylabel: str
    x: Array  # (T,)
    xlabel: str
    lines: Sequence[Line]
    ylim: tuple[float, float] | None = None


class File(NamedTuple):
    """What can be taken home."""

    label: str
    name: str
    data: bytes


class Run(NamedTuple):
    """What a run came to, as it is shown."""

    name: str  # tells it from another run
    headline: tuple[str, str]  # what is measured, and the number
    player: dict[str, Any]
    curves: Sequence[Curve]
    rows: Sequence[tuple[str, str]]
    files: Sequence[File]
    again: str  # the command that repeats it
    stride: int = 1  # frames of the run for one of the player


class LiveJob(Job):
    """A job that also tells a number a frame while it runs."""

    def __init__(self, title: str, ylabel: str) -> None:
        super().__init__()
        self.title, self.ylabel = title, ylabel
        self.values: list[float] = []

    def tell(self, value: float) -> None:
        """Note one more frame and its number; ends the work if it was called off."""
        self.values.append(value)
        self.advance(len(self.values))


class BenchState(Generic[Scene]):
    """What one tab holds of a system."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.opened: Any = None  # a recording, instead of the scene
        self.run: Run | None = None
        self.kept: Run | None = None
        self._before: Run | None = None
        self.job: LiveJob | None = None

    def take(self, run: Run) -> None:
        """Show another run; frames are held a run longer, as a browser may still be asking for them."""
        if self._before is not None:
            for name in ("url", "marks"):
                HELD.drop(str(self._before.player.get(name, "")).rpartition("/")[2])
        self._before, self.run = self.run, run


def chart_spec(number: int, run: Run, kept: Run | None) -> dict[str, Any]:
    """Return one chart of a run, with the same of the kept run."""
    curve = run.curves[number]
    runs = [(run, THIS), *([(kept, KEPT)] if kept is not None and len(kept.curves) > number else [])]
    series = []
    for one, colour in runs:
        drawn = one.curves[number]
        for at, line in enumerate(drawn.lines):
            if line.quiet and one is not run:
                continue
            name = f"{line.name}, {one.name}" if len(runs) > 1 and not line.quiet else line.name
            series.append({
                "name": name, "x": plain(drawn.x), "y": plain(line.y), "dashed": line.quiet or one is not run,
                "colour": QUIET if line.quiet else MORE[(at - 1) % len(MORE)] if at and one is run else colour,
            })  # fmt: skip
    spec = {"label": curve.title, "series": series, "xlabel": curve.xlabel, "ylabel": curve.ylabel}
    return spec | {"times": plain(curve.x), "stride": run.stride} | ({"ylim": list(curve.ylim)} if curve.ylim else {})


def table(header: Sequence[str], columns: Sequence[Sequence[tuple[str, str]]]) -> str:
    """Write what runs say of themselves, a row a quantity, a column a run."""
    told_of = [dict(rows) for rows in columns]
    names = list(dict.fromkeys(name for rows in columns for name, _ in rows))
    return table_html(header, [(name, *(one.get(name, "") for one in told_of)) for name in names])


def plain(values: Any) -> list[float | None]:
    """Return numbers as a page takes them; None where there is none."""
    return [round(float(value), 6) if np.isfinite(value) else None for value in values]
