"""A run of the images: the pipeline's frame by frame, watched."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from functools import partial

from elusive.checks import grave
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import FrameSource, Truth
from elusive.results import scored
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.page.panels import Belief, belief_of, dots_each, images_page, stride_of
from elusive.systems.images.page.state import ImagesState
from elusive.systems.images.report import NEAR_PX, FrameKeeper, write_html
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.run import follow
from elusive.systems.images.scene import NAME, ImageScene, held_frames
from elusive.systems.images.simulate import draw_images
from elusive.systems.images.track import ImageTracking
from elusive.workbench.exports import written
from elusive.workbench.runs import File, LiveJob, Run

ERROR = "Error there"


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
    words = ["elusive", "track", "images", name, "--config", "config.yaml", "--out", "results"]
    words += ["--truth", truth_name] if truth is not None else []
    source = held_frames(name, recorded.frames, recorded.rate_hz)

    def work(job: LiveJob) -> Run:
        yaml = File("Run as YAML", "config.yaml", tracking.to_yaml().encode())
        return watched(name, source, recorded.frames, tracking, truth, yaml, shlex.join(words), job)

    return work


def run_scene(scene: ImageScene, job: LiveJob) -> Run:
    """Draw a scene and track it."""
    drawn, settled = draw_images(scene), scene.settled
    yaml = File("Run as YAML", "scene.yaml", settled.to_yaml().encode())
    again = "elusive scene scene.yaml --out results"
    kind = settled.tracking.filter.kind
    title = f"SNR {scene.snr_db:g} dB" + ("" if kind == "several" else f", {kind}")
    source = held_frames(NAME, drawn.frames)
    return watched(title, source, drawn.frames, settled.tracking, Truth.of_frames(drawn.truth), yaml, again, job)


def watched(
    title: str,
    source: FrameSource,
    frames: Array,
    tracking: ImageTracking,
    truth: Truth | None,
    yaml: File,
    again: str,
    job: LiveJob,
) -> Run:
    """Track frames and gather what is shown of it.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth is of other frames.
    CancelledError
        If it was called off.
    """
    known = None if truth is None else truth.aligned(list(source.times_s()))
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
    scores = None if known is None else scored(log.shown, known, NEAR_PX)
    tracked = tracked_of(title, log, source.shape, timed=source.timed, truth=known, scores=scores)
    said = dict(tracked.rows)
    headline = (ERROR, said[ERROR]) if ERROR in said else ("Confirmed tracks", said["Confirmed tracks"])
    findings = checks.findings(log.whitened)
    report = partial(
        write_html, tracked=tracked._replace(believed=not grave(findings)), frames=keeper, findings=findings
    )
    files = [
        yaml,
        File("Tracks as CSV", "tracks.csv", log.csv_text().encode()),
        File("Report (HTML)", "report.html", partial(written, report)),
    ]
    return Run(title, headline, images_page(frames, beliefs, tracked), tracked.rows, files, again, findings)
