"""The demonstration: a target below the noise, lost to a threshold and found by track-before-detect.

The threshold looks at the best detector there is for one frame, the matched filter's peak; it is set so that it
raises as many false alarms a frame as the filter's existence does at one half.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.experiments.amrouche2018.scenario import Recording, WeakTarget
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.io import atomic_folder
from elusive.results import write_result
from elusive.systems.images.report import FrameKeeper, images_report
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.track import ImageTracking, track_images
from elusive.tracking import Lifecycle, Step

TRIALS = 60  # recordings with a target, and as many without, behind the table
NEAR = 2.0  # cells between estimate and truth that count as found
LEVEL = 0.5  # existence that counts as a detection


class Demo(NamedTuple):
    """What the demonstration found."""

    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


def run_demo(out: Path, *, seed: int = 1, on_frame: Callable[[int], None] | None = None) -> Demo:
    """Draw a recording, track it, write the results, and compare with a threshold over many more recordings.

    Parameters
    ----------
    out
        Folder for ``tracks.csv``, ``result.nc``, ``report.html`` and ``report.png``.
    seed
        Root of all random numbers: the same seed, the same files.
    on_frame
        Called with the number of frames done.
    """
    scenario = WeakTarget()
    parameters = ImageTracking(
        filter=BernoulliFilter(
            motion=scenario.target_motion, sensor=scenario.sensor, birth=MeasurementBirth(snr_db=scenario.snr_db)
        ),
        tracks=Lifecycle(),
        seed=seed,
    )
    recording = scenario.simulate(np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(0,))))
    results: list[Step] = []
    for result in track_images(recording.frames, parameters):
        results.append(result)
        if on_frame is not None:
            on_frame(len(results))
    comparison = compare(scenario, parameters, seed, lambda done: on_frame(len(results) + done) if on_frame else None)
    rows = _rows(recording, results, comparison, scenario)
    _write(out, recording, results, parameters, rows)
    return Demo(("", "track-before-detect", "threshold"), rows)


class Comparison(NamedTuple):
    """Filter and threshold over many recordings, at one rate of false alarms."""

    false_alarms: float  # share of the frames without target that raise one
    threshold: float  # matched-filter peak that raises as many
    filter_found: float  # share of the frames with target found within NEAR cells
    threshold_found: float


def compare(scenario: WeakTarget, parameters: ImageTracking, seed: int, on_frame: Callable[[int], None]) -> Comparison:
    """Run filter and threshold on recordings with and without a target."""
    sensor = scenario.sensor
    existence, peaks, found_by_filter, peak_near = [], [], [], []
    for trial in range(1, TRIALS + 1):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(trial,)))
        recording = scenario.simulate(rng)
        empty = np.stack([sensor.simulate(np.empty((0, 5)), rng) for _ in recording.frames])
        quiet = [step.state.existence for step in track_images(empty, parameters.replace(seed=trial))]
        existence.append(quiet)
        peaks.append([matched_peak(frame, scenario)[0] for frame in empty])
        for step, truth in zip(
            track_images(recording.frames, parameters.replace(seed=trial)), recording.truth, strict=True
        ):
            if np.isfinite(truth[0]):
                place = truth[[X, Y]]
                state = step.state
                found_by_filter.append(state.existence > LEVEL and np.hypot(*(state.mean[[X, Y]] - place)) < NEAR)
                height, where = matched_peak(step.measurement, scenario)
                peak_near.append(height if np.hypot(*(where - place)) < NEAR else -np.inf)
        on_frame(trial)
    false_alarms = float(np.mean(np.array(existence) > LEVEL))
    threshold = float(np.quantile(np.array(peaks), 1 - false_alarms))
    return Comparison(
        false_alarms, threshold, float(np.mean(found_by_filter)), float(np.mean(np.array(peak_near) > threshold))
    )


def matched_peak(frame: Array, scenario: WeakTarget) -> tuple[float, Array]:
    """Largest log likelihood ratio of a target of mean intensity in a frame, and its cell ``(x, y)``."""
    sensor = scenario.sensor
    ratio = sensor.birth_map(frame, sensor.intensity_of(scenario.snr_db))
    row, column = np.unravel_index(int(ratio.argmax()), ratio.shape)
    return float(ratio[row, column]), np.array([column * sensor.dx, row * sensor.dy])


def _rows(
    recording: Recording, results: list[Step], comparison: Comparison, scenario: WeakTarget
) -> list[tuple[str, ...]]:
    present = recording.present > 0
    error = np.hypot(*(np.array([step.state.mean[[X, Y]] for step in results]) - recording.truth[:, [X, Y]]).T)
    here = sum(step.state.existence > LEVEL and e < NEAR for step, e in zip(results, error, strict=True))
    crossed = 0
    for frame, truth in zip(recording.frames[present], recording.truth[present], strict=True):
        height, where = matched_peak(frame, scenario)
        crossed += int(height > comparison.threshold and np.hypot(*(where - truth[[X, Y]])) < NEAR)
    total = int(present.sum())
    rate = f"{100 * comparison.false_alarms:.1f} %"
    return [
        ("Frames without target that raise an alarm", rate, rate),
        ("This recording: frames with target found", f"{here} of {total}", f"{crossed} of {total}"),
        (
            f"{TRIALS} recordings: frames with target found",
            f"{100 * comparison.filter_found:.0f} %",
            f"{100 * comparison.threshold_found:.0f} %",
        ),
    ]


def _write(
    out: Path,
    recording: Recording,
    results: list[Step],
    parameters: ImageTracking,
    table: list[tuple[str, ...]],
) -> None:
    keeper = FrameKeeper()
    for number, frame in enumerate(recording.frames):
        keeper.offer(number, frame)
    title = "A target of 6.7 dB, below what the eye can see"
    truth = {"long_name": "x, vx, y, vy, intensity of the target"}
    more = {
        "truth": (("step", "component"), recording.truth, truth),
        "frames": (("step", "row", "column"), recording.frames, {"long_name": "frames"}),
    }
    with atomic_folder(out) as folder:
        with ImageLog(parameters, folder / "tracks.csv") as log:
            for step in results:
                log.append(step)
        shape = recording.frames.shape[1:]
        tracked = tracked_of(title, log, shape, timed=False, truth=recording.truth[:, None, [X, Y]])
        said = [(name, f"{ours}; threshold {theirs}") for name, ours, theirs in table]
        tracked = tracked._replace(rows=[*tracked.rows, *said])
        write_result(folder / "result.nc", log, title="elusive demo", config=parameters.to_yaml(), more=more)
        images_report(tracked, keeper).write(folder)
