"""A run of the noise objects: the pipeline's frame by frame, watched."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from elusive.io import Truth
from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.page.panels import Maps
from elusive.systems.signals.report import SignalTracked, signal_report
from elusive.systems.signals.results import SignalLog, tracked_of
from elusive.systems.signals.run import bound_to, follow
from elusive.systems.signals.scene import NAME, SignalScene, draw_signal, held_signal
from elusive.workbench.exports import written
from elusive.workbench.runs import SCENE_AGAIN, File, LiveJob, Run

ERROR = "Error there"
TRACKS_TOLD = 12


def run_scene(scene: SignalScene, job: LiveJob) -> Run:
    """Draw a scene, track it and gather what is shown of it.

    Raises
    ------
    DataError
        If the scene cannot be run.
    CancelledError
        If it was called off.
    """
    drawn, settled = draw_signal(scene), scene.settled
    source, tracking = held_signal(NAME, drawn.frames), settled.tracking
    title = f"deviation {scene.sensor.object_deviation:g} on {scene.sensor.background_deviation:g}"
    truth = Truth.of_frames(drawn.truth) if drawn.truth.size else None
    bound = bound_to(source, tracking)
    job.total = source.length
    log, maps, facts = SignalLog(source, bound), Maps(), SignalFacts()
    for step in follow(source, bound):
        log.take(step)
        facts.add(step)
        maps.offer(step.state)
        job.tell(float(log.steps["highest"][-1]))
    tracked, _ = tracked_of(log, truth)
    said = [("In words", tracked.verdict), *tracked.rows, *_tracks(tracked)]
    found = dict(tracked.rows)
    headline = (ERROR, found[ERROR]) if ERROR in found else ("Tracks", str(len(tracked.paths)))
    findings = findings_of(bound, facts)

    def report(path: Path) -> None:
        signal_report(tracked, log.signal, log.score, findings).write_page(path)

    files = [
        File("Run as YAML", "scene.yaml", settled.to_yaml().encode()),
        File("Tracks as CSV", "tracks.csv", log.csv_text().encode()),
        File("Report (HTML)", "report.html", partial(written, report)),
    ]
    panels = maps.drawing(tracked, log.period, tracking.object_size)
    return Run(title, headline, panels, said, files, SCENE_AGAIN, findings)


def _tracks(tracked: SignalTracked) -> list[tuple[str, str]]:
    heads = [head.partition(" [")[0].lower() for head in tracked.header[1:]]
    return [
        (f"Track {line[0]}", ", ".join(f"{head} {cell}" for head, cell in zip(heads, line[1:], strict=True)))
        for line in tracked.tracks[:TRACKS_TOLD]
    ]
