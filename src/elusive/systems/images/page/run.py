"""A run of the images: the pipeline's frame by frame, watched."""

from __future__ import annotations

import shlex
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import FrameSource, TrackRow, write_tracks_csv
from elusive.systems.images.page.panels import Belief, belief_of, dots_each, player_of, stride_of
from elusive.systems.images.page.state import ImagesState
from elusive.systems.images.report import Tracked
from elusive.systems.images.results import FrameTrack, rows_of, tracked_of
from elusive.systems.images.scene import NAME, ImageScene, draw_images, held_frames
from elusive.systems.images.track import ImageTracking, track_images
from elusive.workbench.runs import Curve, File, Line, LiveJob, Run

ERROR = "Error where tracked, RMS"


def work_of(state: ImagesState) -> Callable[[LiveJob], Run]:
    """Return the work that the state asks for.

    Raises
    ------
    DataError
        If frames shall be opened and none are.
    """
    if not state.records:
        scene = state.scene
        return lambda job: run_scene(scene, job)
    recorded, tracking, name = state.recorded, state.tracking, state.name
    if recorded is None:
        raise DataError("frames: none are opened; open some, or make a scenario.")
    truth, truth_name = state.truth, state.truth_name
    words = ["elusive", "track", "images", name, "--config", "tracking.yaml", "--out", "results"]
    words += ["--truth", truth_name] if truth is not None else []
    source = held_frames(name, recorded.frames, recorded.rate_hz)

    def work(job: LiveJob) -> Run:
        yaml = File("Run as YAML", "tracking.yaml", tracking.to_yaml().encode())
        return watched(name, source, recorded.frames, tracking, truth, yaml, shlex.join(words), job)

    return work


def run_scene(scene: ImageScene, job: LiveJob) -> Run:
    """Draw a scene and track it."""
    drawn, settled = draw_images(scene), scene.settled
    yaml = File("Run as YAML", "scene.yaml", settled.to_yaml().encode())
    again = "elusive scene scene.yaml --out results"
    kind = settled.tracking.filter.kind
    title = f"SNR {scene.snr_db:g} dB" + ("" if kind == "bernoulli" else f", {kind}")
    source = held_frames(NAME, drawn.frames)
    return watched(title, source, drawn.frames, settled.tracking, drawn.truth, yaml, again, job)


def watched(
    title: str,
    source: FrameSource,
    frames: Array,
    tracking: ImageTracking,
    truth: Array | None,
    yaml: File,
    again: str,
    job: LiveJob,
) -> Run:
    """Track frames and gather what is shown of it.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth has fewer rows than there are frames.
    CancelledError
        If it was called off.
    """
    if truth is not None and len(truth) < len(frames):
        raise DataError(
            f"truth: has {len(truth)} rows for {len(frames)} frames; give one row a frame of the file, nan nan if "
            "absent."
        )
    known = None if truth is None else truth[: len(frames)]
    job.total, most = len(frames), dots_each(len(frames))
    stride, _ = stride_of(frames)
    fitted = tracking.fitted_to(source.shape)
    beliefs: list[Belief] = []
    results: list[FrameTrack] = []
    rows: list[list[TrackRow]] = []

    def note(state: object) -> None:
        beliefs.append(belief_of(state, most) if len(beliefs) % stride == 0 else Belief())

    for result in track_images(source, fitted, on_state=note):
        rows.append(rows_of(result, source.time_s(len(rows)), source.rate_hz))
        results.append(result)
        job.tell(result.existence)
    tracked = tracked_of(title, results, rows, source.shape, source.rate_hz, known)
    said = dict(tracked.rows)
    headline = (ERROR, said[ERROR]) if ERROR in said else ("Confirmed tracks", said["Confirmed tracks"])
    files = [yaml, File("Tracks as CSV", "tracks.csv", _csv(rows))]
    player = player_of(frames, beliefs, rows, known)
    return Run(title, headline, player, curves_of(tracked), tracked.rows, files, again, stride)


def curves_of(tracked: Tracked) -> list[Curve]:
    """Return existence and error over time."""
    label = "probability" if tracked.tracks is None else "1 - P(by chance)"
    there = [] if tracked.truth is None else [Line("target there", _present(tracked.truth), quiet=True)]
    unit = "frame" if tracked.time_unit == "frame" else "time [s]"
    curves = [
        Curve("Is it there?", label, tracked.times, unit, [Line("existence", tracked.existence), *there], (0.0, 1.05))
    ]
    if tracked.error is not None:
        curves.append(Curve("How far off?", "error [px]", tracked.times, unit, [Line("error", tracked.error)]))
    return curves


def _present(truth: Array) -> Array:
    return np.isfinite(truth[:, 0]).astype(np.float64)


def _csv(rows: list[list[TrackRow]]) -> bytes:
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / "tracks.csv"
        write_tracks_csv(path, [row for of_frame in rows for row in of_frame])
        return path.read_bytes()
