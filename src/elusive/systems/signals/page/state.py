"""What one tab holds of the noise objects: a scene, or a recording and how it is tracked."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from elusive.io import Truth
from elusive.model import Model, Positive
from elusive.systems.signals.page.recording import Recorded, read_recorded
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.scene import SignalScene
from elusive.workbench.runs import BenchState


class Cutting(Model):
    """How a recording is read; the options of `elusive track signal` of the same names."""

    frame_samples: int | None = Field(None, ge=2, description="Samples of a frame, of a long recording; else 1200")
    channel: int | None = Field(None, ge=0, description="Channel of a .wav file of several, from 0")
    rate_hz: Positive | None = Field(None, description="Frames a second; else from the file [Hz]")

    def read(self, path: Path) -> Recorded:
        """Read a recording so."""
        return read_recorded(path, self.frame_samples, self.channel, self.rate_hz)

    @property
    def options(self) -> list[str]:
        """The command's options."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return [
            word for name, value in given.items() if value is not None
            for word in (f"--{name.replace('_', '-')}", f"{value:g}")
        ]  # fmt: skip


class SignalsState(BenchState[SignalScene]):
    """The recording is used where one is chosen and opened."""

    def __init__(self) -> None:
        super().__init__(SignalScene().settled)
        self.tracking = SignalTracking()
        self.cutting = Cutting()
        self.records = False  # whether a signal is opened, not made
        self.recorded: Recorded | None = None
        self.recorded_by: list[str] = []  # options it was read with
        self.name = ""
        self.truth: Truth | None = None
        self.truth_name = ""

    @property
    def settings(self) -> Model:
        """What the next run is of."""
        return self.tracking if self.records else self.scene
