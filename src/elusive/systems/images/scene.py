"""A scene of weak targets in image frames, complete in one file: what is simulated, and how it is tracked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from elusive.contracts import Array
from elusive.io import FrameSource, Truth, atomic_folder
from elusive.io._stack import Stack
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.peaks import PeakImages
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.run import Outcome, track_recording
from elusive.systems.images.several import SeveralImages
from elusive.systems.images.simulate import ImageSimulation, draw_images, write_frames
from elusive.tracking.frame_births import FrameBirths

NAME = "scene"


class ImageScene(ImageSimulation):
    """Everything that a run of the workbench's images can be told: what is simulated, and how it is tracked."""

    system: Literal["images"] = Field("images", description="What kind of scene this is")
    filter_knows_target: bool = Field(
        True, description="The filter knows how targets move and their mean SNR, as in the paper"
    )
    tracking: ImageTracking = Field(
        ImageTracking(filter=SeveralImages(sensor=ImageSensor()), seed=1),
        description="How it is tracked",
    )

    @property
    def settled(self) -> ImageScene:
        """The same, with a filter that takes these frames and, where it knows them, this motion and this SNR."""
        flt = self.tracking.filter
        if isinstance(flt, PeakImages):
            return self.replace(sensor=self.fitted_sensor)
        seen: dict[str, Any] = {"sensor": self.fitted_sensor}
        if self.filter_knows_target and isinstance(flt, RecurrentImages):
            seen |= {"target_snr_db": self.snr_db}
        elif self.filter_knows_target and not isinstance(flt, RecurrentImages):
            birth: Any = flt.birth
            known: dict[str, Any] = {"snr_db": self.snr_db}
            if self.strongest_snr_db is not None and isinstance(birth, FrameBirths):
                known = {"snr_db": None, "snr_db_range": self.snr_db_range}
            seen |= {"motion": self.motion, "birth": birth.replace(**known)}
        tracking = self.tracking.replace(filter=flt.replace(**seen))
        return self.replace(sensor=seen["sensor"], tracking=tracking)


def held_frames(name: str, frames: Array, rate_hz: float | None = None, times_s: Array | None = None) -> FrameSource:
    """Return frames ``(T, rows, columns)`` that are in memory as a source like a file's."""
    shape = (frames.shape[1], frames.shape[2])

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        for number, frame in enumerate(frames[start:stop], start):
            yield f"{name}, frame {number}", frame

    stack = Stack(name, shape, len(frames), rate_hz, read, times_s)
    return FrameSource(name, shape, len(frames), rate_hz, 0, stack, None)


def track_image_scene(scene: ImageScene, out: Path, *, on_frame: Callable[[int], None] | None = None) -> Outcome:
    """Run a scene and write what :func:`track_recording` writes, and ``frames.npy``, ``truth.csv``, ``scene.yaml``.

    ``on_frame`` is called with the number of frames done.

    Raises
    ------
    DataError
        If the scene cannot be run, or a file cannot be written; then nothing is.
    """
    drawn, settled = draw_images(scene), scene.settled
    with atomic_folder(out) as folder:
        write_frames(folder, drawn)
        (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        source = held_frames(NAME, drawn.frames)
        return track_recording(source, settled.tracking, folder, truth=Truth.of_frames(drawn.truth), on_frame=on_frame)
