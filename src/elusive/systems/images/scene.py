"""Weak targets in image frames: simulated frames with their truth, and a scene of them, complete in one file.

Amrouche, Khenchaf and Berkani (2018), section 5: the defaults are theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.io import FrameSource, Truth, atomic_folder, write_truth
from elusive.io._stack import Stack
from elusive.model import Model
from elusive.motion import WithIntensity
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.run import Outcome, track_recording

VALUES_AT_MOST = 24_000_000  # pixels of all frames: they are kept
NAME = "scene"


class ImageSimulation(Model):
    """Frames with targets in them; frames and pixels count from 0, and frames are 1 s apart."""

    main_options: ClassVar[tuple[str, ...]] = (
        "snr_db", "frames", "rows", "columns", "appears", "leaves", "more_targets", "motion", "noise_sigma", "seed",
    )  # fmt: skip

    snr_db: float = Field(6.71, ge=-40, le=80, description="Peak SNR of a target when it appears [dB]")
    appears: int = Field(5, ge=0, description="First frame with the target, from 0")
    leaves: int = Field(23, ge=0, description="Last frame with the target, from 0")
    frames: int = Field(30, ge=2, le=5000, description="Frames in all")
    motion: WithIntensity = Field(WithIntensity(), description="How a target moves")
    start_x: float = Field(4.2, allow_inf_nan=False, description="Column in which it appears [px]")
    start_y: float = Field(7.2, allow_inf_nan=False, description="Row in which it appears [px]")
    velocity_x: float = Field(0.45, allow_inf_nan=False, description="Velocity along the columns [px / s]")
    velocity_y: float = Field(0.25, allow_inf_nan=False, description="Velocity along the rows [px / s]")
    more_targets: int = Field(
        0, ge=0, le=50, description="Further targets, as bright and as fast, at places and headings drawn at random"
    )
    rows: int = Field(20, ge=8, le=512, description="Rows of a frame")
    columns: int = Field(20, ge=8, le=512, description="Columns of a frame")
    sensor: ImageSensor = Field(ImageSensor(), description="What a frame is made of")
    seed: int = Field(1, ge=0, description="Root of the paths' and the frames' random numbers")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        name = type(self).__name__
        if not self.appears <= self.leaves < self.frames:
            raise ParameterError(
                f"{name}.leaves: must be from the first frame with the target, {self.appears}, to the last of all, "
                f"{self.frames - 1} (got {self.leaves})."
            )
        if not (0 <= self.start_x <= self.columns - 1 and 0 <= self.start_y <= self.rows - 1):
            raise ParameterError(
                f"{name}.start_x: the target appears at {self.start_x:g}, {self.start_y:g}, outside of frames of "
                f"{self.columns} x {self.rows} pixels; choose a place inside."
            )
        if (self.sensor.dx, self.sensor.dy) != (1.0, 1.0):
            raise ParameterError(
                f"ImageSensor.dx: must be 1, and dy too, in a scene, which counts in pixels "
                f"(got {self.sensor.dx:g} and {self.sensor.dy:g})."
            )
        if self.frames * self.rows * self.columns > VALUES_AT_MOST:
            raise ParameterError(
                f"{name}.frames: {self.frames} frames of {self.columns} x {self.rows} pixels are more than a scene "
                f"keeps, {VALUES_AT_MOST} pixels; give fewer or smaller ones."
            )
        return self

    @property
    def fitted_sensor(self) -> ImageSensor:
        """The sensor with the frames' size."""
        return self.sensor.replace(rows=self.rows, columns=self.columns)


class ImageScene(ImageSimulation):
    """Everything that a run of the workbench's images can be told: what is simulated, and how it is tracked."""

    system: Literal["images"] = Field("images", description="What kind of scene this is")
    filter_knows_target: bool = Field(
        True, description="The filter knows the target's motion and its mean SNR, as in the paper"
    )
    tracking: ImageTracking = Field(
        ImageTracking(filter=BernoulliFilter(sensor=ImageSensor(), birth=MeasurementBirth()), seed=1),
        description="How it is tracked",
    )

    @property
    def settled(self) -> ImageScene:
        """The same, with a filter that takes these frames and, where it knows them, this motion and this SNR."""
        flt = self.tracking.filter
        seen: dict[str, Any] = {"sensor": self.fitted_sensor}
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
    truth: Array  # (T, targets, 2) x, y [px], NaN where a target is absent or outside


def draw_images(scene: ImageSimulation) -> DrawnImages:
    """Draw the targets' paths and the frames; a target that leaves the frame stays away."""
    rng = np.random.default_rng(np.random.SeedSequence(scene.seed, spawn_key=(0,)))
    start = (scene.start_x, scene.start_y, scene.velocity_x, scene.velocity_y)
    paths = [_path(scene, start, scene.appears, scene.leaves, rng)]
    others = np.random.default_rng(np.random.SeedSequence(scene.seed, spawn_key=(1,)))
    speed = float(np.hypot(scene.velocity_x, scene.velocity_y))
    for _ in range(scene.more_targets):
        appears = int(others.integers(max(1, scene.frames - scene.leaves + scene.appears)))
        x, y = others.uniform(0, (scene.columns - 1, scene.rows - 1))
        # towards the middle, so that it stays for a while
        heading = np.arctan2(scene.rows / 2 - y, scene.columns / 2 - x) + others.uniform(-0.5, 0.5)
        moving = (x, y, speed * np.cos(heading), speed * np.sin(heading))
        paths.append(_path(scene, moving, appears, appears + scene.leaves - scene.appears, others))
    states = np.stack(paths, axis=1)
    sensor = scene.fitted_sensor
    frames = [sensor.simulate(row[np.isfinite(row[:, X])], rng) for row in states]
    return DrawnImages(np.stack(frames), states[:, :, [X, Y]])


def _path(scene: ImageSimulation, start: Any, appears: int, leaves: int, rng: Generator) -> Array:
    """Draw a target's states, ``(T, d)``, NaN where it is not there."""
    x, y, vx, vy = start
    known = {"x": x, "y": y, "vx": vx, "vy": vy, "intensity": scene.fitted_sensor.intensity_of(scene.snr_db)}
    state = np.array([[known.get(name, 0.0) for name in scene.motion.state_names]])
    path = np.full((scene.frames, state.shape[1]), np.nan)
    for k in range(appears, leaves + 1):
        x, y = state[0, [X, Y]]
        if not (-0.5 <= x <= scene.columns - 0.5 and -0.5 <= y <= scene.rows - 0.5):
            break
        path[k] = state[0]
        state = scene.motion.propagate(state, 1.0, rng)
    return path


def held_frames(name: str, frames: Array, rate_hz: float | None = None, times_s: Array | None = None) -> FrameSource:
    """Return frames ``(T, rows, columns)`` that are in memory as a source like a file's."""
    shape = (frames.shape[1], frames.shape[2])

    def read(start: int, stop: int | None) -> Iterator[tuple[str, Any]]:
        for number, frame in enumerate(frames[start:stop], start):
            yield f"{name}, frame {number}", frame

    stack = Stack(name, shape, len(frames), rate_hz, read, times_s)
    return FrameSource(name, shape, len(frames), rate_hz, 0, stack, None)


def simulate_images(simulation: ImageSimulation, out: Path) -> DrawnImages:
    """Draw frames and write ``frames.npy``, ``truth.csv`` (which ``--truth`` takes) and ``simulation.yaml``.

    Raises
    ------
    DataError
        If a file cannot be written; then none is.
    """
    drawn = draw_images(simulation)
    with atomic_folder(out) as folder:
        _write(folder, drawn)
        (folder / "simulation.yaml").write_text(simulation.to_yaml(), encoding="utf-8")
    return drawn


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
        _write(folder, drawn)
        (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        source = held_frames(NAME, drawn.frames)
        return track_recording(source, settled.tracking, folder, truth=Truth.of_frames(drawn.truth), on_frame=on_frame)


def _write(folder: Path, drawn: DrawnImages) -> None:
    np.save(folder / "frames.npy", drawn.frames)
    write_truth(folder / "truth.csv", Truth.of_frames(drawn.truth), "px")
