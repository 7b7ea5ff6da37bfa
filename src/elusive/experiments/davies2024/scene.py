"""The two scenes of Davies and Garcia-Fernandez (2024), section VI, as published: measurements, truth and births.

IEEE Trans. Signal Process. 72, 607-620. Scene 1 has one vague component of birth, scene 2 five precise ones.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.motion import ConstantVelocity
from elusive.sensors.field import FieldSensors
from elusive.tracking.birth_density import GaussianBirths
from elusive.tracking.superposed import SuperposedTracker

SCENES = (1, 2)
BIRTH_PROBABILITY = 1e-4  # of a component in a step of 1 s
DEATH_PROBABILITY = 0.01
SIGMA_U_MPS2 = 0.5  # constant over a step there; white here, of the same growth of velocity
SHAPES = {  # K steps, S sensors, B targets
    "measurements": 3, "sensors_m": 2, "truth": 3, "first_step": 1, "last_step": 1, "birth_means": 2,
    "birth_covariance": 2, "published_gospa2": 2,
}  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """A scene, and what the authors' filter made of it."""

    number: int
    measurements: Array  # (run, S, K)
    sensors_m: Array  # (S, 2)
    truth: Array  # (B, 4, K) x, vx, y, vy
    birth_means: Array  # (components, 4)
    birth_covariance: Array  # (4, 4)
    published_gospa2: Array  # (run, K) squared
    first_step: NDArray[np.int64]  # (B,)
    last_step: NDArray[np.int64]  # (B,)

    @property
    def sensor(self) -> FieldSensors:
        """The field's sensors."""
        return FieldSensors(positions_m=tuple(map(tuple, self.sensors_m.tolist())))

    def tracker(self, particles: int) -> SuperposedTracker:
        """Return the tracker, told what the published filter is told."""
        return SuperposedTracker(
            motion=ConstantVelocity(q=SIGMA_U_MPS2**2),
            sensor=self.sensor,
            birth=GaussianBirths(
                means=tuple(map(tuple, self.birth_means.tolist())),
                covariance=tuple(map(tuple, self.birth_covariance.tolist())),
                birth_probability=BIRTH_PROBABILITY,
            ),
            death_probability=DEATH_PROBABILITY,
            particles=particles,
        )

    def present(self, step: int) -> NDArray[np.intp]:
        """Return the targets that are there in a step."""
        return np.flatnonzero((self.first_step <= step) & (step <= self.last_step))

    def places(self, step: int) -> Array:
        """Return where the targets are in a step, ``(n, 2)`` [m]."""
        return self.truth[self.present(step)][:, [X, Y], step]

    def drawn_anew(self, rng: Generator) -> Array:
        """Draw measurements of the same targets with other noise, ``(S, K)``."""
        steps = range(self.truth.shape[2])
        return np.stack([self.sensor.simulate(self.truth[self.present(k)][:, :, k], rng) for k in steps], axis=1)


def read_scene(folder: Path, number: int) -> Scene:
    """Read ``sceneN.npz`` of a folder.

    Raises
    ------
    DataError
        If the file cannot be read or is no such scene.
    """
    path = folder / f"scene{number}.npz"
    try:
        with np.load(path, allow_pickle=False) as held:
            arrays = {name: np.asarray(held[name]) for name in SHAPES}
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise DataError(
            f"{path}: cannot be read as a scene ({error}); name the folder of scene1.npz and scene2.npz."
        ) from None
    wrong = [name for name, axes in SHAPES.items() if arrays[name].ndim != axes]
    sizes = {arrays["measurements"].shape[2], arrays["truth"].shape[2], arrays["published_gospa2"].shape[1]}
    if wrong or len(sizes) > 1 or len(arrays["sensors_m"]) != arrays["measurements"].shape[1]:
        raise DataError(f"{path}: {', '.join(wrong) or 'its arrays'} do not fit one another; take the published file.")
    held = {name: array.astype(np.float64) for name, array in arrays.items()}
    first, last = (held.pop(name).astype(np.int64) for name in ("first_step", "last_step"))
    return Scene(number, first_step=first, last_step=last, **held)
