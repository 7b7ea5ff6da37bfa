"""What one tab holds of the images: a scene, or a recording and how it is tracked."""

from __future__ import annotations

from elusive.io import Truth
from elusive.model import Model
from elusive.systems.images.page.recording import Recorded
from elusive.systems.images.scene import ImageScene
from elusive.systems.images.track import ImageTracking
from elusive.workbench.runs import BenchState


class ImagesState(BenchState[ImageScene]):
    """The recording is used where one is chosen and opened."""

    def __init__(self) -> None:
        super().__init__(ImageScene().settled)
        self.tracking = ImageTracking()
        self.records = False  # whether frames are opened, not made
        self.recorded: Recorded | None = None
        self.name = ""
        self.truth: Truth | None = None
        self.truth_name = ""

    @property
    def settings(self) -> Model:
        """What the next run is of."""
        return self.tracking if self.records else self.scene
