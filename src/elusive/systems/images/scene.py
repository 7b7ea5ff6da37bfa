"""A scene of one weak target in image frames, complete in one file: motion, SNR, when it is there, how it is tracked.

Amrouche, Khenchaf and Berkani (2018), section 5: the defaults are theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.io import FrameSource, atomic_folder
from elusive.io._stack import Stack
from elusive.model import Model
from elusive.motion import WithIntensity
from elusive.sensors import ImageSensor
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.track import ImageTracking, Outcome, track_recording

VALUES_AT_MOST = 24_000_000  # pixels of all frames: they are kept
NAME = "scene"


class ImageScene(Model):
    """Everything that a run of the workbench's images can be told; frames and pixels count from 0."""

    system: Literal["images"] = Field("images", description="What kind of scene this is")
    snr_db: float = Field(6.71, ge=-40, le=80, description="Peak SNR of the target when it appears [dB]")
    appears: int = Field(5, ge=0, description="First frame with the target, from 0")
    leaves: int = Field(23, ge=0, description="Last frame with the target, from 0")
    frames: int = Field(30, ge=2, le=5000, description="Frames in all")
    motion: WithIntensity = Field(WithIntensity(), description="How the target moves")
    start_x: float = Field(4.2, allow_inf_nan=False, description="Column in which it appears [px]")
    start_y: float = Field(7.2, allow_inf_nan=False, description="Row in which it appears [px]")
    velocity_x: float = Field(0.45, allow_inf_nan=False, description="Velocity along the columns [px/frame]")
    velocity_y: float = Field(0.25, allow_inf_nan=False, description="Velocity along the rows [px/frame]")
    rows: int = Field(20, ge=8, le=512, description="Rows of a frame")
    columns: int = Field(20, ge=8, le=512, description="Columns of a frame")
    sensor: ImageSensor = Field(ImageSensor(), description="What a frame is made of")
    seed: int = Field(1, ge=0, description="Root of the path's and the frames' random numbers")
    filter_knows_target: bool = Field(
        True, description="The filter knows the target's motion and its mean SNR, as in the paper"
    )
    tracking: ImageTracking = Field(
        ImageTracking(filter=BernoulliFilter(sensor=ImageSensor(), birth=MeasurementBirth()), seed=1),
        description="How it is tracked",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if not self.appears <= self.leaves < self.frames:
            raise ParameterError(
                f"ImageScene.leaves: must be from the first frame with the target, {self.appears}, to the last of all, "
                f"{self.frames - 1} (got {self.leaves})."
            )
        if not (0 <= self.start_x <= self.columns - 1 and 0 <= self.start_y <= self.rows - 1):
            raise ParameterError(
                f"ImageScene.start_x: the target appears at {self.start_x:g}, {self.start_y:g}, outside of frames of "
                f"{self.columns} x {self.rows} pixels; choose a place inside."
            )
        if (self.sensor.dx, self.sensor.dy) != (1.0, 1.0):
            raise ParameterError(
                f"ImageSensor.dx: must be 1, and dy too, in a scene, which counts in pixels "
                f"(got {self.sensor.dx:g} and {self.sensor.dy:g})."
            )
        if self.frames * self.rows * self.columns > VALUES_AT_MOST:
            raise ParameterError(
                f"ImageScene.frames: {self.frames} frames of {self.columns} x {self.rows} pixels are more than a scene "
                f"keeps, {VALUES_AT_MOST} pixels; give fewer or smaller ones."
            )
        return self

    @property
    def settled(self) -> ImageScene:
        """The same, with a filter that takes these frames and, where it knows them, this motion and this SNR."""
        flt = self.tracking.filter
        seen: dict[str, Any] = {"sensor": self.sensor.replace(rows=self.rows, columns=self.columns)}
        if self.filter_knows_target and isinstance(flt, RecurrentImages):
            seen |= {"target_snr_db": self.snr_db}
        elif self.filter_knows_target and not isinstance(flt, RecurrentImages):
            birth: Any = flt.birth
            seen |= {"motion": self.motion, "birth": birth.replace(snr_db=self.snr_db)}
        tracking = self.tracking.replace(filter=flt.replace(**seen))
        return self.replace(sensor=seen["sensor"], tracking=tracking)


class DrawnImages(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (T, rows, columns)
    truth: Array  # (T, 2) x, y [px], NaN where the target is absent or outside


def draw_images(scene: ImageScene) -> DrawnImages:
    """Draw the target's path and the frames; a target that leaves the frame stays away."""
    rng = np.random.default_rng(np.random.SeedSequence(scene.seed, spawn_key=(0,)))
    sensor = scene.settled.sensor
    known = {
        "x": scene.start_x, "y": scene.start_y, "vx": scene.velocity_x, "vy": scene.velocity_y,
        "intensity": sensor.intensity_of(scene.snr_db),
    }  # fmt: skip
    state = np.array([[known.get(name, 0.0) for name in scene.motion.state_names]])
    path = np.full((scene.frames, state.shape[1]), np.nan)
    for k in range(scene.appears, scene.leaves + 1):
        x, y = state[0, [X, Y]]
        if not (-0.5 <= x <= scene.columns - 0.5 and -0.5 <= y <= scene.rows - 0.5):
            break
        path[k] = state[0]
        state = scene.motion.propagate(state, 1.0, rng)
    frames = [sensor.simulate(row[None] if np.isfinite(row[X]) else path[:0], rng) for row in path]
    return DrawnImages(np.stack(frames), path[:, [X, Y]])


def held_frames(name: str, frames: Array, rate_hz: float | None = None) -> FrameSource:
    """Return frames ``(T, rows, columns)`` that are in memory as a source like a file's."""
    shape = (frames.shape[1], frames.shape[2])

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        for number, frame in enumerate(frames[start:stop], start):
            yield f"{name}, frame {number}", frame

    return FrameSource(name, shape, len(frames), rate_hz, 0, Stack(name, shape, len(frames), rate_hz, read), None)


def track_image_scene(scene: ImageScene, out: Path, *, on_frame: Callable[[int], None] | None = None) -> Outcome:
    """Run a scene and write what :func:`track_recording` writes, and ``frames.npy``, ``truth.txt``, ``scene.yaml``.

    Parameters
    ----------
    scene
        What to run.
    out
        Folder for the results.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If the scene cannot be run, or a file cannot be written; then nothing is.
    """
    drawn, settled = draw_images(scene), scene.settled
    with atomic_folder(out) as folder:
        np.save(folder / "frames.npy", drawn.frames)
        np.savetxt(folder / "truth.txt", drawn.truth, header="x y [px], a line a frame; nan nan: absent")
        (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        source = held_frames(NAME, drawn.frames)
        return track_recording(source, settled.tracking, folder, truth=drawn.truth, on_frame=on_frame)
