"""Weak targets in image frames that appear, meet and leave, and what a camera sees of them.

Amrouche, Khenchaf and Berkani (2018), section 5: the defaults are theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.io import Truth, atomic_folder, write_truth
from elusive.model import Model, Positive
from elusive.motion import WithIntensity
from elusive.sensors import ImageSensor

VALUES_AT_MOST = 24_000_000  # pixels of all frames: they are kept
Layout = Literal["apart", "crossing", "head-on", "parallel"]


class ImageSimulation(Model):
    """Frames with targets in them; frames and pixels count from 0, and frames are 1 s apart."""

    main_options: ClassVar[tuple[str, ...]] = (
        "snr_db", "targets", "layout", "spacing_px", "frames", "rows", "columns", "appears", "leaves", "seed",
    )  # fmt: skip

    snr_db: float = Field(6.71, ge=-40, le=80, description="Peak SNR of a target when it appears [dB]")
    appears: int = Field(5, ge=0, description="First frame with the target, from 0")
    leaves: int = Field(23, ge=0, description="Last frame with the target, from 0; it stays to the end of fewer frames")
    frames: int = Field(30, ge=2, le=5000, description="Frames in all")
    motion: WithIntensity = Field(WithIntensity(), description="How a target moves")
    start_x: float = Field(4.2, allow_inf_nan=False, description="Column in which it appears [px]")
    start_y: float = Field(7.2, allow_inf_nan=False, description="Row in which it appears [px]")
    velocity_x: float = Field(0.45, allow_inf_nan=False, description="Velocity along the columns [px / s]")
    velocity_y: float = Field(0.25, allow_inf_nan=False, description="Velocity along the rows [px / s]")
    targets: int = Field(1, ge=1, le=50, description="Targets in all, each as fast as the first")
    layout: Layout = Field(
        "apart",
        description="How they meet: at places and headings drawn at random, all through the middle at once, head to "
        "head along a line, or side by side",
    )
    spacing_px: Positive = Field(4.0, description="Distance between neighbours that are side by side [px]")
    stagger: int = Field(
        3, ge=0, description="Frames by which a target appears and leaves after the one before, unless drawn at random"
    )
    strongest_snr_db: float | None = Field(
        None, ge=-40, le=80, description="Peak SNR of each target is drawn from snr_db to this one, if it is given [dB]"
    )
    rows: int = Field(20, ge=8, le=512, description="Rows of a frame")
    columns: int = Field(20, ge=8, le=512, description="Columns of a frame")
    sensor: ImageSensor = Field(ImageSensor(), description="What a frame is made of")
    seed: int = Field(0, ge=0, description="Root of the paths' and the frames' random numbers")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        name = type(self).__name__
        if self.appears >= self.frames:
            raise ParameterError(
                f"{name}.appears: must be at most the last of all frames, {self.frames - 1} (got {self.appears})."
            )
        if self.leaves < self.appears:
            raise ParameterError(
                f"{name}.leaves: must be at least the first frame with the target, {self.appears} (got {self.leaves})."
            )
        if self.layout != "apart" and self.last - self.appears <= 2 * self.stagger * (self.targets - 1):
            raise ParameterError(
                f"{name}.stagger: {self.targets} targets that appear {self.stagger} frames one after the other do not "
                f"meet from frame {self.appears} to {self.last}; give a smaller stagger, or a later leaves."
            )
        if self.strongest_snr_db is not None and self.strongest_snr_db < self.snr_db:
            raise ParameterError(
                f"{name}.strongest_snr_db: is {self.strongest_snr_db:g} dB, less than snr_db, {self.snr_db:g} dB."
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
    def last(self) -> int:
        """Last frame with the first target."""
        return min(self.leaves, self.frames - 1)

    @property
    def snr_db_range(self) -> tuple[float, float]:
        """Least and greatest peak SNR of a target when it appears [dB]."""
        return self.snr_db, self.snr_db if self.strongest_snr_db is None else self.strongest_snr_db

    @property
    def fitted_sensor(self) -> ImageSensor:
        """The sensor with the frames' size."""
        return self.sensor.replace(rows=self.rows, columns=self.columns)


class DrawnImages(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (T, rows, columns)
    truth: Array  # (T, targets, 2) x, y [px], NaN where a target is absent or outside


class _Target(NamedTuple):
    """Where and when a target begins."""

    appears: int
    leaves: int
    start: tuple[float, float, float, float]  # x, y, vx, vy
    snr_db: float
    rng: Generator


def draw_images(scene: ImageSimulation, *, on_frame: Callable[[int], None] | None = None) -> DrawnImages:
    """Draw the targets' paths and the frames; a target that leaves the frame stays away.

    ``on_frame`` is called with the number of frames done.
    """
    rng, others = (np.random.default_rng(np.random.SeedSequence(scene.seed, spawn_key=(key,))) for key in (0, 1))
    targets = _apart(scene, rng, others) if scene.layout == "apart" else _meeting(scene, others)
    if scene.strongest_snr_db is not None:
        drawn = others.uniform(*scene.snr_db_range, len(targets)).tolist()
        targets = [target._replace(snr_db=snr_db) for target, snr_db in zip(targets, drawn, strict=True)]
    states = np.stack([_path(scene, target) for target in targets], axis=1)
    sensor = scene.fitted_sensor
    frames = []
    for number, row in enumerate(states, 1):
        frames.append(sensor.simulate(row[np.isfinite(row[:, X])], rng))
        if on_frame is not None:
            on_frame(number)
    return DrawnImages(np.stack(frames), states[:, :, [X, Y]])


def _apart(scene: ImageSimulation, rng: Generator, others: Generator) -> list[_Target]:
    """Return the first target where it is told to begin, the others at random."""
    start = (scene.start_x, scene.start_y, scene.velocity_x, scene.velocity_y)
    targets = [_Target(scene.appears, scene.last, start, scene.snr_db, rng)]
    speed = float(np.hypot(scene.velocity_x, scene.velocity_y))
    for _ in range(scene.targets - 1):
        appears = int(others.integers(max(1, scene.frames - scene.last + scene.appears)))
        x, y = others.uniform(0, (scene.columns - 1, scene.rows - 1))
        # towards the middle, so that it stays for a while
        heading = np.arctan2(scene.rows / 2 - y, scene.columns / 2 - x) + others.uniform(-0.5, 0.5)
        moving = (x, y, speed * np.cos(heading), speed * np.sin(heading))
        targets.append(_Target(appears, appears + scene.last - scene.appears, moving, scene.snr_db, others))
    return targets


def _meeting(scene: ImageSimulation, rng: Generator) -> list[_Target]:
    """Return targets that are nearest to each other halfway, in the middle of the frame."""
    middle, halfway = 0.5 * np.array([scene.columns - 1, scene.rows - 1]), 0.5 * (scene.appears + scene.last)
    heading, speed = np.arctan2(scene.velocity_y, scene.velocity_x), np.hypot(scene.velocity_x, scene.velocity_y)
    aside = np.array([-np.sin(heading), np.cos(heading)])
    count, targets = scene.targets, []
    for k in range(count):
        turned, lane, lanes = heading, k, count
        if scene.layout == "crossing":
            turned, lane, lanes = heading + k * np.pi / count, 0, 1
        elif scene.layout == "head-on":
            turned, lane, lanes = heading + (k % 2) * np.pi, k // 2, (count + 1) // 2
        velocity = speed * np.array([np.cos(turned), np.sin(turned)])
        appears = scene.appears + k * scene.stagger
        start = middle + (lane - (lanes - 1) / 2) * scene.spacing_px * aside + (appears - halfway) * velocity
        leaves = scene.last - (count - 1 - k) * scene.stagger
        targets.append(_Target(appears, leaves, (*start, *velocity), scene.snr_db, rng))
    return targets


def _path(scene: ImageSimulation, target: _Target) -> Array:
    """Draw a target's states, ``(T, d)``, NaN where it is not there."""
    x, y, vx, vy = target.start
    known = {"x": x, "y": y, "vx": vx, "vy": vy, "intensity": scene.fitted_sensor.intensity_of(target.snr_db)}
    state = np.array([[known.get(name, 0.0) for name in scene.motion.state_names]])
    path = np.full((scene.frames, state.shape[1]), np.nan)
    for k in range(target.appears, min(target.leaves + 1, scene.frames)):
        x, y = state[0, [X, Y]]
        if not (-0.5 <= x <= scene.columns - 0.5 and -0.5 <= y <= scene.rows - 0.5):
            break
        path[k] = state[0]
        state = scene.motion.propagate(state, 1.0, target.rng)
    return path


def simulate_images(
    simulation: ImageSimulation, out: Path, *, on_frame: Callable[[int], None] | None = None
) -> DrawnImages:
    """Draw frames and write ``frames.npy``, ``truth.csv`` (which ``--truth`` takes) and ``simulation.yaml``.

    ``on_frame`` is called with the number of frames done.

    Raises
    ------
    DataError
        If a file cannot be written; then none is.
    """
    drawn = draw_images(simulation, on_frame=on_frame)
    with atomic_folder(out) as folder:
        write_frames(folder, drawn)
        (folder / "simulation.yaml").write_text(simulation.to_yaml(), encoding="utf-8")
    return drawn


def write_frames(folder: Path, drawn: DrawnImages) -> None:
    """Write ``frames.npy`` and ``truth.csv`` into a folder."""
    np.save(folder / "frames.npy", drawn.frames)
    write_truth(folder / "truth.csv", Truth.of_frames(drawn.truth), "px")
