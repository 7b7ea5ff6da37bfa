"""A run of the images: the pipeline's frame by frame, watched."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from elusive.checks import grave
from elusive.io import Truth
from elusive.results import scored
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.page.panels import Belief, belief_of, dots_each, images_page, stride_of
from elusive.systems.images.report import NEAR_PX, FrameKeeper, images_report
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.run import follow
from elusive.systems.images.scene import NAME, ImageScene, held_frames
from elusive.systems.images.simulate import draw_images
from elusive.workbench.exports import written
from elusive.workbench.runs import SCENE_AGAIN, File, LiveJob, Run

ERROR = "Error there"


def run_scene(scene: ImageScene, job: LiveJob) -> Run:
    """Draw a scene, track it and gather what is shown of it.

    Raises
    ------
    DataError
        If the scene cannot be run.
    CancelledError
        If it was called off.
    """
    drawn, settled = draw_images(scene), scene.settled
    tracking, frames = settled.tracking, drawn.frames
    source = held_frames(NAME, frames)
    kind = tracking.filter.kind
    title = f"SNR {scene.snr_db:g} dB" + ("" if kind == "several" else f", {kind}")
    known = Truth.of_frames(drawn.truth).aligned(list(source.times_s()))
    job.total, most = len(frames), dots_each(len(frames))
    stride, _ = stride_of(frames)
    beliefs: list[Belief] = []
    bound = tracking.bind(source.shape)
    log, keeper, checks = ImageLog(bound), FrameKeeper(), FrameChecks(bound)
    for step in follow(source, tracking):
        keeper.offer(len(beliefs), step.measurement)
        checks.take(step)
        beliefs.append(belief_of(step.state, most) if len(beliefs) % stride == 0 else Belief())
        log.append(step)
        job.tell(getattr(step.state, log.measure))
    scores = scored(log.shown, known, NEAR_PX)
    tracked = tracked_of(title, log, source.shape, timed=source.timed, truth=known, scores=scores)
    said = dict(tracked.rows)
    headline = (ERROR, said[ERROR]) if ERROR in said else ("Confirmed tracks", said["Confirmed tracks"])
    findings = checks.findings(log.whitened)

    def report(path: Path) -> None:
        images_report(tracked._replace(believed=not grave(findings)), keeper, findings).write_page(path)

    files = [
        File("Run as YAML", "scene.yaml", settled.to_yaml().encode()),
        File("Tracks as CSV", "tracks.csv", log.csv_text().encode()),
        File("Report (HTML)", "report.html", partial(written, report)),
    ]
    return Run(title, headline, images_page(frames, beliefs, tracked), tracked.rows, files, SCENE_AGAIN, findings)
