"""Draw what each way of looking before detecting finds, and costs: one target in white noise, straight or turning.

Run from the project's root, a few minutes on one core: ``python docs/figures/choose.py docs/_static/choose.png``;
the numbers are written beside it, ``choose.csv`` and ``choose-cost.csv``.
"""

import csv
import sys
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.filters.accumulate.image_evidence import WhiteEvidence
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.filters.accumulate.trajectories import BatchMaximum
from elusive.filters.accumulate.viterbi import Viterbi
from elusive.io.atomic import atomic_path
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.report import plots
from elusive.runner import run
from elusive.sensors import ImageSensor

SIDE, FRAMES = 64, 20
SPEEDS = (0.3, 1.0)  # px a frame
TURN_DEG = 9.0  # a frame, in the turning half: a half circle in all
SNRS_DB = tuple(range(-4, 11, 2))
TRIALS, TARGET_FREE = 200, 1000
FALSE_ALARM = 0.01  # of a run of 20 frames without a target
NEAR_PX = 2.0
SIDES = (20, 64, 128, 256)  # for the cost
SEED = 2026
MOTIONS = {"straight": 0.0, "turning": TURN_DEG}
BANK = {"max_velocity": 1.0, "velocity_step": 0.25, "border": "bounded"}
ALONG = {"recurrent": 0.0, "recurrent with switching": 0.1}


class Found(NamedTuple):
    """What a method makes of a run: how sure it is, and the place in the last frame."""

    statistic: float
    place: NDArray[np.float64]  # x, y


def evidence_of(frames: NDArray[np.float64], sensor: ImageSensor) -> list[NDArray[np.float64]]:
    """Evidence of each frame; in Gaussian noise the SNR sought scales it alone, and changes nothing."""
    return list(map(WhiteEvidence(sensor, 0.0).evidence, frames))


def bernoulli(frames: NDArray[np.float64], sensor: ImageSensor, snr_db: float, rng: np.random.Generator) -> Found:
    """Probability of existence after the last frame, as log odds."""
    flt = BernoulliFilter(
        motion=WithIntensity(motion=ConstantVelocity(q=0.01)),
        sensor=sensor,
        birth=MeasurementBirth(snr_db=snr_db, max_speed=1.0),
        particles=4500,
        newborns=1500,
    )
    *_, state = run(flt, frames, rng, start_s=-1.0)
    existence = np.clip(state.existence, 1e-300, 1 - 1e-16)
    return Found(float(np.log(existence / (1 - existence))), state.mean[[0, 2]])


def recurrent(
    frames: NDArray[np.float64], sensor: ImageSensor, _: float, rng: np.random.Generator, switching: float = 0.0
) -> Found:
    """Highest score after the last frame."""
    flt = RecurrentFilter(smoothing=0.9, switching=switching, **BANK)
    *_, state = run(flt, evidence_of(frames, sensor), rng, start_s=-1.0)
    return Found(float(state.score.max()), state.mean[[0, 2]])


def searched(search: BatchMaximum | Viterbi, frames: NDArray[np.float64], sensor: ImageSensor, *_: object) -> Found:
    """Largest sum of evidence along a trajectory or path."""
    found = search.search(np.stack(evidence_of(frames, sensor)))
    return Found(found.score, found.positions[-1])


METHODS: dict[str, Callable[..., Found]] = {
    "Bernoulli": bernoulli,
    **{name: partial(recurrent, switching=switching) for name, switching in ALONG.items()},
    "Viterbi": partial(searched, Viterbi(max_velocity=1)),
    "batch maximum": partial(searched, BatchMaximum(**BANK)),
}


def path(turn_deg: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Places ``(T, 2)`` of a target that stays within the frame."""
    while True:
        heading = rng.uniform(0, 2 * np.pi) + np.deg2rad(turn_deg) * rng.choice([-1, 1]) * np.arange(FRAMES)
        steps = rng.uniform(*SPEEDS) * np.column_stack([np.cos(heading), np.sin(heading)])
        places = rng.uniform(4, SIDE - 5, 2) + np.vstack([np.zeros(2), np.cumsum(steps[1:], axis=0)])
        if places.min() > 3 and places.max() < SIDE - 4:
            return places


def frames_of(
    places: NDArray[np.float64] | None, sensor: ImageSensor, snr_db: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Frames with a target on a path, or without one."""
    intensity = sensor.intensity_of(snr_db)
    states = [np.empty((0, 5))] * FRAMES if places is None else [np.array([[x, 0, y, 0, intensity]]) for x, y in places]
    return np.stack([sensor.simulate(state, rng) for state in states])


def thresholds(sensor: ImageSensor, snr_db: float, names: Iterable[str]) -> dict[str, float]:
    """Statistic that methods exceed in one target-free run of a hundred."""
    kept: dict[str, list[float]] = {name: [] for name in names}
    for number in range(TARGET_FREE):
        rng = np.random.default_rng([SEED, 0, number])
        frames = frames_of(None, sensor, snr_db, rng)
        for name, values in kept.items():
            values.append(METHODS[name](frames, sensor, snr_db, rng).statistic)
    return {name: float(np.quantile(values, 1 - FALSE_ALARM)) for name, values in kept.items()}


def detection() -> list[dict[str, object]]:
    """Share of the runs in which each method finds the target, at equal false alarms."""
    sensor = ImageSensor(rows=SIDE, columns=SIDE)
    rows: list[dict[str, object]] = []
    limits = thresholds(sensor, 0.0, [name for name in METHODS if name != "Bernoulli"])
    for snr_db in SNRS_DB:
        limits |= thresholds(sensor, snr_db, ["Bernoulli"])
        for motion, turn_deg in MOTIONS.items():
            hits: dict[str, list[bool]] = {name: [] for name in METHODS}
            for number in range(TRIALS):
                rng = np.random.default_rng([SEED, 1, number])
                places = path(turn_deg, rng)
                frames = frames_of(places, sensor, snr_db, rng)
                for name, method in METHODS.items():
                    found = method(frames, sensor, snr_db, rng)
                    near = np.hypot(*(found.place - places[-1])) < NEAR_PX
                    hits[name].append(bool(near and found.statistic > limits[name]))
            for name, hit in hits.items():
                share = float(np.mean(hit))
                error = float(np.sqrt(share * (1 - share) / TRIALS))
                rows.append(
                    {"motion": motion, "method": name, "snr_db": snr_db, "detected": share, "standard_error": error}
                )
                print(*rows[-1].values(), flush=True)
    return rows


def cost() -> list[dict[str, object]]:
    """Time a frame on this machine, the least of three runs."""
    rows: list[dict[str, object]] = []
    for side in SIDES:
        sensor = ImageSensor(rows=side, columns=side)
        rng = np.random.default_rng([SEED, 2, side])
        frames = frames_of(None, sensor, 6.0, rng)
        for name, method in METHODS.items():
            taken = []
            for _ in range(3):
                begin = time.perf_counter()
                method(frames, sensor, 6.0, rng)
                taken.append(time.perf_counter() - begin)
            rows.append({"side_px": side, "method": name, "ms_per_frame": round(1e3 * min(taken) / FRAMES, 3)})
    return rows


def write(path: Path, rows: list[dict[str, object]]) -> None:
    """Write a table as CSV."""
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main(path: Path) -> None:
    """Write the figure and its numbers."""
    found, costs = detection(), cost()
    write(path.with_suffix(".csv"), found)
    write(path.with_name(f"{path.stem}-cost.csv"), costs)
    draw(path, found, costs)


def draw(path: Path, found: list[dict[str, object]], costs: list[dict[str, object]]) -> None:
    """Draw both tables."""
    markers = dict(zip(METHODS, "osD^v", strict=True))
    colours = (*plots.SERIES[:4], plots.SERIES[5])
    with plots.figure(path, 10.5, 3.9, 1, 3) as (drawn, grid):
        for axes, (motion, turn_deg) in zip(grid[0], MOTIONS.items(), strict=False):
            for (name, marker), colour in zip(markers.items(), colours, strict=True):
                rows = [row for row in found if row["motion"] == motion and row["method"] == name]
                snr, share, error = (
                    np.array([row[key] for row in rows], dtype=float)
                    for key in ("snr_db", "detected", "standard_error")
                )
                axes.errorbar(snr, share, 2 * error, color=colour, marker=marker, markersize=4, capsize=2, label=name)
            turns = "at constant velocity" if turn_deg == 0 else f"turning by {turn_deg:g}° a frame"
            axes.set(
                xlabel="peak SNR [dB]",
                ylabel="runs in which it is found",
                ylim=(-0.02, 1.02),
                xticks=SNRS_DB,
                title=f"Target {turns}",
            )
        axes = grid[0, 2]
        for (name, marker), colour in zip(markers.items(), colours, strict=True):
            rows = [row for row in costs if row["method"] == name]
            sides, times = ([row[key] for row in rows] for key in ("side_px", "ms_per_frame"))
            axes.loglog(sides, times, color=colour, marker=marker, markersize=4)
        axes.set(xlabel="side of the frame [px]", ylabel="ms a frame", title="Cost")
        axes.set_xticks(SIDES, [str(side) for side in SIDES])
        axes.minorticks_off()
        drawn.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=len(METHODS))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
