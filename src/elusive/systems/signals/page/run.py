"""A run of the noise objects: the pipeline's frame by frame, watched."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from functools import partial

from elusive.errors import DataError
from elusive.io import SignalSource, Truth
from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.page.panels import Maps
from elusive.systems.signals.page.state import SignalsState
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.report import SignalTracked, write_signal_html
from elusive.systems.signals.results import SignalLog, tracked_of
from elusive.systems.signals.run import bound_to, follow
from elusive.systems.signals.scene import NAME, SignalScene, draw_signal, held_signal
from elusive.workbench.exports import written
from elusive.workbench.runs import File, LiveJob, Run

ERROR = "Error there"
TRACKS_TOLD = 12


def work_of(state: SignalsState) -> Callable[[LiveJob], Run]:
    """Return the work that the state asks for.

    Raises
    ------
    DataError
        If a signal shall be opened and none is.
    """
    if not state.records:
        scene = state.scene
        return lambda job: run_scene(scene, job)
    recorded, tracking, name, truth = state.recorded, state.tracking, state.name, state.truth
    if recorded is None:
        raise DataError("signal: none is opened; open one, or make a scene.")
    words = ["elusive", "track", "signal", name, *state.recorded_by, "--config", "config.yaml", "--out", "results"]
    words += ["--truth", state.truth_name] if truth is not None else []
    times = recorded.times if recorded.timed and recorded.rate_hz is None else None
    source = held_signal(name, recorded.frames, recorded.rate_hz, times)
    yaml = File("Run as YAML", "config.yaml", tracking.to_yaml().encode())
    return lambda job: watched(name, source, tracking, truth, yaml, shlex.join(words), job)


def run_scene(scene: SignalScene, job: LiveJob) -> Run:
    """Draw a scene and track it."""
    drawn, settled = draw_signal(scene), scene.settled
    yaml = File("Run as YAML", "scene.yaml", settled.to_yaml().encode())
    again = "elusive scene scene.yaml --out results"
    title = f"deviation {scene.sensor.object_deviation:g} on {scene.sensor.background_deviation:g}"
    truth = Truth.of_frames(drawn.truth) if drawn.truth.size else None
    return watched(title, held_signal(NAME, drawn.frames), settled.tracking, truth, yaml, again, job)


def watched(
    title: str, source: SignalSource, tracking: SignalTracking, truth: Truth | None, yaml: File, again: str,
    job: LiveJob,
) -> Run:  # fmt: skip
    """Track a signal and gather what is shown of it.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth is of other frames.
    CancelledError
        If it was called off.
    """
    bound = bound_to(source, tracking)
    job.total = source.length
    log, maps, facts = SignalLog(source, bound), Maps(), SignalFacts()
    for step in follow(source, bound):
        log.take(step)
        facts.add(step.state)
        maps.offer(step.state)
        job.tell(float(log.steps["highest"][-1]))
    tracked, _ = tracked_of(log, truth)
    said = [("In words", tracked.verdict), *tracked.rows, *_tracks(tracked)]
    found = dict(tracked.rows)
    headline = (ERROR, found[ERROR]) if ERROR in found else ("Tracks", str(len(tracked.paths)))
    findings = findings_of(bound, facts)
    report = partial(write_signal_html, tracked=tracked, signal=log.signal, score=log.score, findings=findings)
    files = [
        yaml,
        File("Tracks as CSV", "tracks.csv", log.csv_text().encode()),
        File("Report (HTML)", "report.html", partial(written, report)),
    ]
    drawn = maps.drawing(tracked, log.period, tracking.object_size)
    return Run(title, headline, drawn, said, files, again, findings)


def _tracks(tracked: SignalTracked) -> list[tuple[str, str]]:
    heads = [head.partition(" [")[0].lower() for head in tracked.header[1:]]
    return [
        (f"Track {line[0]}", ", ".join(f"{head} {cell}" for head, cell in zip(heads, line[1:], strict=True)))
        for line in tracked.tracks[:TRACKS_TOLD]
    ]
