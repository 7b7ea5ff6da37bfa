"""Track the scenes of Davies and Garcia-Fernandez (2024) and compare with the published filter on the same readings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.errors import ParameterError
from elusive.experiments.davies2024.scene import SCENES, Scene, read_scene
from elusive.io import atomic_folder
from elusive.io.csv_files import write_results
from elusive.metrics.set_distances import gospa
from elusive.metrics.target_table import Sightings, sightings
from elusive.report import plots
from elusive.tracking.superposed import SuperposedTracker

CUTOFF_M = 5.0
SHOWN_FROM = 0.5  # existence from which a target counts as there
PUBLISHED = "IEMB-IPLF, published"


class Row(NamedTuple):
    """One filter on one scene."""

    scene: int
    filter: str
    runs: int
    rms_gospa: float  # [m]
    localisation: float  # mean of a step, squared [m^2]
    missed: float  # targets a step
    false: float  # targets a step
    seconds_per_step: float  # of processor time


class Scores(NamedTuple):
    """A run, step by step."""

    gospa2: Array  # (K,) squared [m^2]
    localisation: Array  # (K,) [m^2]
    missed: Array  # (K,) targets
    false: Array  # (K,) targets
    seconds: float  # of processor time, all steps together


def score_run(scene: Scene, tracker: SuperposedTracker, readings: Array, seed: int) -> Scores:
    """Track a run's readings ``(S, K)`` and score the targets that are more likely there than not."""
    steps = readings.shape[1]
    rng, found = np.random.default_rng(seed), list[Array]()
    started = time.process_time()
    state = tracker.init(rng)
    for step in range(steps):
        state = tracker.step(state, float(step), readings[:, step], rng)
        found.append(np.array([t.mean[[X, Y]] for t in state.targets if t.existence > SHOWN_FROM]).reshape(-1, 2))
    seconds = time.process_time() - started
    parts = gospa(_table([scene.places(k) for k in range(steps)]), _table(found), CUTOFF_M, frames=steps)
    half = CUTOFF_M**2 / 2
    return Scores(parts.distance**2, parts.localisation, parts.missed / half, parts.false / half, seconds)


def reproduce(
    out: Path,
    data: Path,
    scenes: Sequence[int] = (),
    *,
    particles: int = 1000,
    anew: int = 0,
    seed: int = 2024,
    on_run: Callable[[int], None] | None = None,
) -> list[Row]:
    """Write ``summary.csv``, ``gospa.csv`` and ``gospa.png``.

    Parameters
    ----------
    out
        Folder for the results.
    data
        Folder of ``scene1.npz`` and ``scene2.npz``.
    scenes
        1, 2 or both; none means both.
    particles
        Particles of a target.
    anew
        Runs with noise drawn anew, beside the published ones.
    seed
        Root of all random numbers.
    on_run
        Called with the number of runs done.

    Raises
    ------
    ParameterError
        If there is no such scene.
    DataError
        If a scene cannot be read.
    """
    unknown = [number for number in scenes if number not in SCENES]
    if unknown:
        raise ParameterError(f"{unknown[0]}: davies2024 has no such scene; known are {', '.join(map(str, SCENES))}.")
    rows, curves, done = list[Row](), dict[str, Array](), 0
    for number in scenes or SCENES:
        scene = read_scene(data, number)
        drawn = [scene.drawn_anew(np.random.default_rng([seed, number, run])) for run in range(anew)]
        curves[f"scene {number}, {PUBLISHED}"] = np.sqrt(scene.published_gospa2.mean(axis=0))
        mean = math.sqrt(float(scene.published_gospa2.mean()))
        rows.append(Row(number, PUBLISHED, len(scene.published_gospa2), mean, *[math.nan] * 4))
        for name, readings in (("superposed", scene.measurements), ("superposed, noise drawn anew", drawn)):
            scores = list[Scores]()
            for run, run_readings in enumerate(readings):
                scores.append(score_run(scene, scene.tracker(particles), run_readings, seed + run))
                done += 1
                if on_run is not None:
                    on_run(done)
            if scores:
                rows.append(_row(number, name, scores))
                curves[f"scene {number}, {name}"] = np.sqrt(np.mean([score.gospa2 for score in scores], axis=0))
    with atomic_folder(out) as folder:
        write_results(folder / "summary.csv", Row._fields, rows)
        columns = zip(*curves.values(), strict=True)
        write_results(folder / "gospa.csv", ("step", *curves), ((k, *values) for k, values in enumerate(columns)))
        _draw(folder / "gospa.png", curves, list(scenes or SCENES))
    return rows


def _row(scene: int, name: str, scores: list[Scores]) -> Row:
    gospa2, localisation, missed, false = (np.mean([score[part] for score in scores]) for part in range(4))
    seconds = np.mean([score.seconds / len(score.gospa2) for score in scores])
    return Row(scene, name, len(scores), math.sqrt(gospa2), *map(float, (localisation, missed, false, seconds)))


def _table(places: list[Array]) -> Sightings:
    steps = np.repeat(np.arange(len(places)), [len(part) for part in places])
    numbers = np.concatenate([np.arange(len(part)) for part in places])
    return sightings(steps, numbers, np.concatenate(places))


def _draw(path: Path, curves: dict[str, Array], scenes: list[int]) -> None:
    with plots.figure(path, 5.0 * len(scenes), 3.6, 1, len(scenes)) as (_, (panels,)):
        for axes, number in zip(panels, scenes, strict=True):
            mine: dict[str, Any] = {name: curve for name, curve in curves.items() if name.startswith(f"scene {number}")}
            for (name, curve), colour in zip(mine.items(), (plots.MUTED, *plots.SERIES), strict=False):
                axes.plot(curve, color=colour, lw=1.4, label=name.partition(", ")[2])
            axes.set(title=f"Scene {number}", xlabel="step", ylabel="root mean square GOSPA [m]", ylim=(0, None))
            axes.legend(frameon=False, fontsize=8)
