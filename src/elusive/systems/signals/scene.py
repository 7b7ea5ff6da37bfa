"""Noise objects along a signal: simulated frames with their truth, and a scene of them, complete in one file.

Mazurek (2013), section 4: objects that differ from the background in their deviation alone, on straight paths.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array, X
from elusive.errors import ParameterError
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.io import SignalSource, Truth, atomic_folder, write_truth
from elusive.io._signal_readings import Piece
from elusive.model import Model
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.run import SignalOutcome, track_signal_recording

VALUES_AT_MOST = 24_000_000  # samples of all frames: they are kept
OBJECTS_AT_MOST = 20
NAME = "scene"
FOLLOWS = (("statistic", "window"), ("statistic", "border"))  # size or border


class SignalSimulation(Model):
    """A signal with noise objects in it; frames and samples count from 0, and frames are 1 s apart."""

    main_options: ClassVar[tuple[str, ...]] = (
        "object_deviation", "background_deviation", "object_size", "mode", "frames", "samples", "more_objects", "seed",
    )  # fmt: skip

    objects: tuple[NoiseObjectPath, ...] = Field(
        (NoiseObjectPath(start=(150.0,), velocity=(2.0,), appears=10, leaves=69),),
        max_length=OBJECTS_AT_MOST,
        description="Path of each object",
    )
    more_objects: int = Field(
        0, ge=0, le=OBJECTS_AT_MOST, description="Further objects on straight paths drawn at random, as fast at most"
    )
    frames: int = Field(80, ge=2, le=100_000, description="Frames in all")
    samples: int = Field(600, ge=20, le=1_000_000, description="Samples of a frame")
    sensor: NoiseObject = Field(
        NoiseObject(background_deviation=0.6), description="What objects and background are made of"
    )
    seed: int = Field(1, ge=0, description="Root of the frames' random numbers")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        for number, path in enumerate(self.objects, 1):
            if len(path.start) != 1 or len(path.velocity) != 1:
                raise ParameterError(
                    f"NoiseObjectPath.start: object {number} needs one number for its start and one for its velocity."
                )
            if not 0 <= path.start[0] <= self.samples - 1:
                raise ParameterError(
                    f"NoiseObjectPath.start: object {number} begins at sample {path.start[0]:g}, outside of the "
                    f"{self.samples} samples; choose a place inside."
                )
            last = self.frames - 1 if path.leaves is None else path.leaves
            if not path.appears <= last:
                raise ParameterError(
                    f"NoiseObjectPath.leaves: object {number} leaves in frame {last} and appears in {path.appears}; "
                    "choose a later frame."
                )
        if self.frames * self.samples > VALUES_AT_MOST:
            raise ParameterError(
                f"{type(self).__name__}.frames: {self.frames} frames of {self.samples} samples are more than a scene "
                f"keeps, {VALUES_AT_MOST} samples; give fewer or shorter ones."
            )
        return self

    @property
    def fitted_sensor(self) -> NoiseObject:
        """The sensor with the frames' length."""
        return self.sensor.replace(shape=(self.samples,))

    @property
    def paths(self) -> list[NoiseObjectPath]:
        """Paths of all objects, those drawn at random too."""
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(1,)))
        fastest = max((abs(path.velocity[0]) for path in self.objects), default=2.0)
        drawn = [
            NoiseObjectPath(
                start=(float(rng.uniform(0, self.samples - 1)),), velocity=(float(rng.uniform(-fastest, fastest)),),
                appears=int(rng.integers(self.frames // 2)),
            )
            for _ in range(self.more_objects)
        ]  # fmt: skip
        return [*self.objects, *drawn]


class SignalScene(SignalSimulation):
    """Everything that a run of the workbench's noise objects can be told: what is simulated, how it is tracked."""

    system: Literal["signals"] = Field("signals", description="What kind of scene this is")
    tracking: SignalTracking = Field(
        SignalTracking(filter=RecurrentFilter(smoothing=0.9, max_velocity=4.0)),
        description="How they are tracked",
    )

    @property
    def settled(self) -> SignalScene:
        """The same, with a sensor of these frames' length and a filter of the objects' size and border."""
        sensor = self.fitted_sensor
        return self.replace(sensor=sensor, tracking=fitted(self.tracking, sensor.object_size, sensor.border))


def fitted(tracking: SignalTracking, object_size: int, border: str) -> SignalTracking:
    """Return the tracking of objects of a size; what follows from size and border is taken anew where they change."""
    if tracking.object_size == object_size and tracking.filter.border == border:
        return tracking
    given = tracking.model_dump()
    for part, name in FOLLOWS:
        del given[part][name]
    given["object_size"], given["filter"]["border"] = object_size, border
    return SignalTracking(**given)


class DrawnSignal(NamedTuple):
    """Frames with the truth behind them."""

    frames: Array  # (T, samples)
    truth: Array  # (T, objects, 1) [samples], NaN where an object is absent or outside


def draw_signal(scene: SignalSimulation) -> DrawnSignal:
    """Draw the frames."""
    rng = np.random.default_rng(scene.seed)
    drawn = scene.fitted_sensor.simulate_sequence(scene.frames, scene.paths, rng)
    truth = drawn.truth[:, :, [X]]
    inside = (truth >= -0.5) & (truth <= scene.samples - 0.5)
    return DrawnSignal(drawn.frames, np.where(inside | (scene.sensor.border == "circular"), truth, np.nan))


def held_signal(name: str, frames: Array) -> SignalSource:
    """Return frames ``(T, samples)`` that are in memory as a source like a file's."""

    def read(start: int, stop: int | None) -> Iterator[Piece]:
        for frame in frames[start:stop]:
            yield Piece(None, frame)

    return SignalSource(name, frames.shape[1], len(frames), None, False, 0, read, None)


def simulate_signal(simulation: SignalSimulation, out: Path) -> DrawnSignal:
    """Draw a signal and write ``signal.npy``, ``truth.csv`` (which ``--truth`` takes) and ``simulation.yaml``.

    Raises
    ------
    DataError
        If a file cannot be written; then none is.
    """
    drawn = draw_signal(simulation)
    with atomic_folder(out) as folder:
        _write(folder, drawn)
        (folder / "simulation.yaml").write_text(simulation.to_yaml(), encoding="utf-8")
    return drawn


def track_signal_scene(
    scene: SignalScene, out: Path, *, on_frame: Callable[[int], None] | None = None
) -> SignalOutcome:
    """Run a scene and write what :func:`track_signal_recording` writes, and ``signal.npy``, ``truth.csv`` and itself.

    ``on_frame`` is called with the number of frames done.

    Raises
    ------
    DataError
        If the scene cannot be run, or a file cannot be written; then nothing is.
    """
    drawn, settled = draw_signal(scene), scene.settled
    with atomic_folder(out) as folder:
        _write(folder, drawn)
        (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        truth = Truth.of_frames(drawn.truth) if drawn.truth.size else None
        source = held_signal(NAME, drawn.frames)
        return track_signal_recording(source, settled.tracking, folder, truth=truth, on_frame=on_frame)


def _write(folder: Path, drawn: DrawnSignal) -> None:
    np.save(folder / "signal.npy", drawn.frames)
    if drawn.truth.size:
        write_truth(folder / "truth.csv", Truth.of_frames(drawn.truth), "samples")
