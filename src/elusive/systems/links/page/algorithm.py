"""Window 4: the fourteen parameters, Apply with progress and Cancel, and the log of what befell each track.

Mendieta (2017), section 5.5.
"""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from elusive.errors import ElusiveError
from elusive.systems.links.page.panels import radiation_spec, tracking_spec
from elusive.systems.links.page.state import LinksState, Recorded
from elusive.systems.links.presets import presets
from elusive.systems.links.scene import LinkScene, Radiated, radiate
from elusive.systems.links.scene_log import run_link_log
from elusive.systems.links.scene_results import SceneOutcome, outcome_of
from elusive.systems.links.scene_run import run_link_scene
from elusive.workbench.jobs import CancelledError, Job, away
from elusive.workbench.parts import Form, are_right
from elusive.workbench.run_bar import RunBar
from elusive.workbench.shell import window

FOURTEEN = (
    *(("method", "image", "prior", name) for name in ("noise_sd_db", "voxel_sd_db", "correlation_m")),
    ("method", "threshold", "alpha"),
    ("method", "threshold", "beta"),
    ("method", "clusters", "cluster_width_m"),
    ("simulation", "quantiser", "bits"),
    ("simulation", "quantiser", "bit_error_rate"),
    ("method", "tracker", "entrance", "width_m"),
    *(
        ("method", "tracker", name)
        for name in ("radius_m", "memory_frames", "confirm_frames", "confirm_window", "delete_frames")
    ),
)
MORE = (("method",), ("simulation", "quantiser"), ("particle",))
CHOICES = (("method", "image", "prior", "kind"), ("method", "tracker", "kind"))
OUTSIDE = (("method", "smoothing", "kind"), ("method", "voxel_m"), ("method", "weights"), ("method", "smoothing"))
WORDS = {"appeared": "CANDIDATE", "confirmed": "CONFIRMED", "left": "DELETED, has left", "lost": "DELETED, is lost"}


async def apply(state: LinksState, job: Job) -> bool:
    """Run a tab's scene, from its paths on; False if it was called off or the scene changed meanwhile."""
    scene, truth, radiated, log = state.scene, state.truth, state.radiated, state.log
    if log is not None:
        return await _apply_log(state, job, log)

    def work() -> tuple[Radiated, SceneOutcome, dict[str, object], dict[str, object]]:
        field = radiate(scene, truth) if radiated is None else radiated
        outcome = outcome_of(run_link_scene(scene, field, on_frame=job.advance))
        return field, outcome, radiation_spec(scene, field), tracking_spec(outcome.run)

    try:
        field, outcome, seen, tracked = await away(work)
    except CancelledError:
        return False
    if state.scene != scene:
        return False
    state.radiated, state.truth, state.outcome = field, field.truth, outcome
    state.radiation_spec, state.tracking_spec = seen, tracked
    return True


async def _apply_log(state: LinksState, job: Job, log: Recorded) -> bool:
    """Run a recorded log through a tab's scene."""
    scene, calibration = state.scene, state.calibration

    def work() -> tuple[SceneOutcome, dict[str, object]]:
        run = run_link_log(scene, log.frames(scene), calibration, truth=log.truth, on_frame=job.advance)
        outcome = outcome_of(run)
        return outcome, tracking_spec(outcome.run)

    try:
        outcome, tracked = await away(work)
    except CancelledError:
        return False
    if state.log is not log or state.scene != scene:
        return False
    state.outcome, state.tracking_spec = outcome, tracked
    return True


def log_of(outcome: SceneOutcome) -> str:
    """Return the event log, a line an event."""
    interval_s = outcome.run.scene.simulation.interval_s
    lines = [
        f"{event.frame * interval_s:5.0f} s  track {event.track}  {WORDS.get(event.what, event.what)}"
        for frame in outcome.run.frames
        for event in frame.events
    ]
    return "\n".join(lines) or "Nothing befell anybody."


class AlgorithmWindow:
    """The window of one page."""

    def __init__(self, state: LinksState, go_on: Callable[[], None]) -> None:
        self._state, self._go_on = state, go_on
        with window() as (side, stage):
            with side:
                self._preset = ui.select(
                    list(presets()), label="Preset", on_change=lambda event: self._set(event.value)
                )
                self._preset.props("dense outlined").classes("w-full")
                self._bar = RunBar(state, self._run, "Apply")
                ui.label("Event log").classes("ew-section")
                self._log = ui.label().classes("ew-log").props('tabindex=0 aria-label="Event log"')
            with stage, ui.element("div").classes("ew-wide w-full"):
                self._fields = ui.column().classes("w-full")
                self._build()
        self._busy = False
        ui.timer(0.1, self._watch)
        self._show()

    def _build(self) -> None:
        scene = self._state.scene
        self._fields.clear()
        with self._fields:
            self._form = Form(scene, (*FOURTEEN, ("method", "tracker")), self._take)
            with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                self._more = Form(scene, MORE, self._take, without=(*self._form.paths, *OUTSIDE))

    def _set(self, title: str | None) -> None:
        if title is None:
            return
        preset = presets()[title]
        scene = self._state.scene
        # paths and area that were drawn stay, all else is the table's
        simulation = preset.simulation.replace(walks=scene.simulation.walks, seed=scene.simulation.seed)
        nodes = None if title.startswith("Table 4.7") else scene.nodes
        self._state.take(scene.replace(simulation=simulation, method=preset.method, nodes=nodes).with_entrance)
        self._build()
        self._show()

    def _take(self, scene: LinkScene) -> LinkScene:
        before = self._state.scene
        kept = self._state.take(scene)
        self._form.model = self._more.model = kept
        if kept.method.tracker.kind != before.method.tracker.kind:
            self._build()
        self._show()
        return kept

    async def _run(self) -> None:
        state = self._state
        if not are_right((self._form, self._more)):
            return
        state.job = job = Job()
        self._show()
        try:
            state.message = "Tracked." if await apply(state, job) else "Cancelled."
        except ElusiveError as error:
            state.message = str(error)
        finally:
            # the window may have been left meanwhile: whichever is open now sees it in the state
            state.job = None

    def _watch(self) -> None:
        job = self._state.job
        if job is not None:
            share = job.done / self._state.scene.simulation.walks.total_positions
            self._bar.tell(f"{job.done} steps done" if job.done else "preparing", share)
        elif self._busy:
            self._show()

    def _show(self) -> None:
        outcome = self._state.outcome
        self._busy = self._state.job is not None
        self._bar.show()
        self._bar.tell(self._state.message)
        self._log.text = "Press Apply." if outcome is None else log_of(outcome)
