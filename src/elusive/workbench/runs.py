"""What a run of one system came to, as its page shows it; its curves and numbers beside those of the run kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from elusive.checks import Finding
from elusive.model import Model
from elusive.report.drawing import Drawing, Layer
from elusive.workbench.exports import table_html
from elusive.workbench.jobs import Job

Scene = TypeVar("Scene", bound=Model)
SCENE_AGAIN = "elusive scene scene.yaml --out results"  # the command that repeats a run of a scene


class File(NamedTuple):
    """What can be taken home."""

    label: str
    name: str
    data: bytes | Callable[[], bytes]  # or what makes it


class Run(NamedTuple):
    """What a run came to, as it is shown."""

    name: str  # tells it from another run
    headline: tuple[str, str]  # what is measured, and the number
    drawn: Drawing
    rows: Sequence[tuple[str, str]]
    files: Sequence[File]
    again: str  # the command that repeats it
    findings: Sequence[Finding] = ()


class LiveJob(Job):
    """A job that also tells a number a frame while it runs."""

    def __init__(self) -> None:
        super().__init__()
        self.values: list[float] = []

    def tell(self, value: float) -> None:
        """Note one more frame and its number; ends the work if it was called off."""
        self.values.append(value)
        self.advance(len(self.values))


class BenchState(Generic[Scene]):
    """What one tab holds of a system."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.run: Run | None = None
        self.kept: Run | None = None
        self.job: LiveJob | None = None
        self.refused = ""
        self.ran: Scene | None = None  # scene that the run is of

    def take(self, scene: Scene) -> None:
        """Take another scene; a run stays."""
        self.scene = scene


def beside(run: Run, kept: Run | None) -> Drawing:
    """Return a run's drawing with the lines of the kept run's charts of the same name."""
    if kept is None:
        return run.drawn
    lines = {panel["title"]: _lines(panel["layers"], kept.name) for panel in kept.drawn["panels"] if _is_chart(panel)}
    panels = [
        panel | {"layers": [*panel["layers"], *lines.get(panel["title"], ())]} if _is_chart(panel) else panel
        for panel in run.drawn["panels"]
    ]
    return run.drawn | {"panels": panels}


def _is_chart(panel: dict[str, Any]) -> bool:
    return bool(panel["x"].get("time")) and not any(layer["type"] == "image" for layer in panel["layers"])


def _lines(layers: Sequence[Layer], name: str) -> list[Layer]:
    return [
        layer | {"name": f"{layer.get('name', 'curve')}, {name}", "colour": "--mark", "dash": [5, 4]}
        for layer in layers
        if layer["type"] == "line" and "dash" not in layer
    ]


def table(header: Sequence[str], columns: Sequence[Sequence[tuple[str, str]]]) -> str:
    """Write what runs say of themselves, a row a quantity, a column a run."""
    said = [dict(rows) for rows in columns]
    names = list(dict.fromkeys(name for rows in columns for name, _ in rows))
    return table_html(header, [(name, *(one.get(name, "") for one in said)) for name in names])
