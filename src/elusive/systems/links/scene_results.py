"""What a tracked scene came to, in files: tracks and events as CSV, scores as JSON and PNG, the scene as YAML."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.io.atomic import atomic_folder
from elusive.io.csv_files import csv_text
from elusive.systems.links.scene import LinkScene
from elusive.systems.links.scene_run import ESTIMATORS, SceneRun, SceneScores, run_link_scene, score_scene

SHOWN = ("all tracks", "confirmed tracks")
BIN_M = 0.1  # of the histograms
TRACK_COLUMNS = ("step", "track", "status", *(f"{name}_{axis}_m" for name in ESTIMATORS for axis in "xy"))
EVENT_COLUMNS = ("step", "track", "event", "x_m", "y_m")


class SceneOutcome(NamedTuple):
    """A run and its scores, of all tracks and of the confirmed ones."""

    run: SceneRun
    scores: tuple[SceneScores, ...]  # of all tracks and of the confirmed; none where the truth is not known


def outcome_of(run: SceneRun) -> SceneOutcome:
    """Score a run; one of a recording whose truth is not known has no scores.

    Raises
    ------
    DataError
        If nobody walks in the scene.
    """
    if not run.radiated.truth.shape[1]:
        return SceneOutcome(run, ())
    return SceneOutcome(run, (score_scene(run), score_scene(run, confirmed_only=True)))


def summary(outcome: SceneOutcome) -> dict[str, Any]:
    """Return the scores under names, plain numbers all; None where there is no number."""
    return {
        shown: {
            "targets": one.targets,
            "misses": one.misses,
            "false_positives": one.false_positives,
            "mismatches": one.mismatches,
            "mota": _plain(one.mota),
            "mean_deviation_m": dict(zip(ESTIMATORS, map(_plain, one.mean_deviation_m), strict=True)),
            "max_deviation_m": dict(zip(ESTIMATORS, map(_plain, one.max_deviation_m), strict=True)),
        }
        for shown, one in zip(SHOWN, outcome.scores, strict=False)
    }


def score_rows(outcome: SceneOutcome) -> list[tuple[str, ...]]:
    """Return the table of the scores: a name, then all tracks, then the confirmed ones."""
    rows = [("MOTA", *(f"{one.mota:.4f}" for one in outcome.scores))]
    for name, words in (("misses", "Misses"), ("false_positives", "False positives"), ("mismatches", "Mismatches")):
        counts = [(getattr(one, name), one.targets) for one in outcome.scores]
        rows.append((words, *(f"{count} of {total} ({100 * count / total:.1f} %)" for count, total in counts)))
    for number, estimator in enumerate(ESTIMATORS):
        rows.append(
            (
                f"Deviation, {estimator}",
                *(
                    f"{one.mean_deviation_m[number]:.3f} m mean, {one.max_deviation_m[number]:.3f} m greatest"
                    for one in outcome.scores
                ),
            )
        )
    return rows


def histogram(scores: SceneScores, most_m: float = 2.0) -> tuple[list[float], list[list[int]]]:
    """Return the left edges of bins [m], and the pairs in each by each estimator; the last bin holds all beyond."""
    edges = np.arange(0.0, most_m, BIN_M)
    counts = []
    for column in scores.deviations.T:
        at = np.minimum((column / BIN_M).astype(np.int64), len(edges) - 1)
        counts.append(np.bincount(at, minlength=len(edges)).tolist())
    return [round(float(edge), 6) for edge in edges], counts


def tracks_csv(run: SceneRun) -> str:
    """Return every track in every step as CSV."""
    rows: list[Sequence[object]] = [
        (
            step, one.track, "confirmed" if one.confirmed else "candidate",
            *(f"{value:.4f}" for value in one.places.ravel()),
        )
        for step, frame in enumerate(run.frames)
        for one in frame.tracks
    ]  # fmt: skip
    return csv_text(TRACK_COLUMNS, rows)


def events_csv(run: SceneRun) -> str:
    """Return what befell tracks as CSV."""
    return csv_text(
        EVENT_COLUMNS,
        [
            (event.frame, event.track, event.what, *(f"{part:.4f}" for part in event.position))
            for frame in run.frames
            for event in frame.events
        ],
    )


def scores_png(outcome: SceneOutcome, path: Path) -> None:
    """Draw the paths with what was found, and the histograms of the deviations."""
    from elusive.report import plots

    run = outcome.run
    with plots.figure(path, 10.0, 4.6, 1, 2) as (drawn, grid):
        floor, bars = grid[0]
        corners = np.array([*run.scene.area.corners_m, run.scene.area.corners_m[0]])
        floor.plot(*corners.T, color=plots.MUTED, linewidth=1.0)
        for person in range(run.radiated.truth.shape[1]):
            label = "truth" if person == 0 else None
            floor.plot(*run.radiated.truth[:, person].T, color=plots.TRUTH, linewidth=4.0, alpha=0.4, label=label)
        for track in sorted({one.track for frame in run.frames for one in frame.tracks if one.confirmed}):
            places = np.full((len(run.frames), 2), np.nan)
            for step, frame in enumerate(run.frames):
                for one in frame.tracks:
                    if one.track == track:
                        places[step] = one.places[1]
            floor.plot(*places.T, color=plots.track_colour(track), linewidth=1.3)
        floor.set(title="Where? Truth and confirmed tracks", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        floor.legend(loc="upper right")
        edges, counts = histogram(outcome.scores[0])
        for number, (name, count) in enumerate(zip(ESTIMATORS, counts, strict=True)):
            at = np.array(edges) + number * BIN_M / len(ESTIMATORS)
            bars.bar(at, count, BIN_M / len(ESTIMATORS), align="edge", color=plots.SERIES[number], label=name)
        bars.set(title="How far off?", xlabel="deviation of a pair [m]", ylabel="pairs")
        bars.legend()
        drawn.suptitle(f"MOTA {outcome.scores[0].mota:.3f}", x=0.01, ha="left", weight="bold")


class SceneTracked(NamedTuple):
    """What :func:`track_scene` tells."""

    header: tuple[str, ...]
    rows: list[tuple[str, ...]]


def track_scene(scene: LinkScene, out: Path, *, on_frame: Callable[[int], None] | None = None) -> SceneTracked:
    """Run a scene and write ``tracks.csv``, ``events.csv``, ``scores.json``, ``scores.png`` and ``scene.yaml``.

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
        If the scene cannot be run or scored, or a file cannot be written; then nothing is.
    """
    outcome = outcome_of(run_link_scene(scene, on_frame=on_frame))
    with atomic_folder(out) as folder:
        (folder / "tracks.csv").write_text(tracks_csv(outcome.run), encoding="utf-8")
        (folder / "events.csv").write_text(events_csv(outcome.run), encoding="utf-8")
        (folder / "scores.json").write_text(json.dumps(summary(outcome), indent=1) + "\n", encoding="utf-8")
        (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
        scores_png(outcome, folder / "scores.png")
    return SceneTracked(("", *SHOWN), score_rows(outcome))


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
