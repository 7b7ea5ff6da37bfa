"""Window 4: the fourteen parameters, Apply with progress and Cancel, and the log of what befell each track.

Mendieta (2017), section 5.5.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from elusive.errors import ElusiveError
from elusive.systems.links.page.panels import radiation_spec, tracking_spec
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.presets import presets
from elusive.systems.links.scene import LinkScene, Radiated, SceneRun, radiate, run_log, run_scene
from elusive.workbench.form import Form, FormTools, are_right
from elusive.workbench.forms import in_plain_words
from elusive.workbench.jobs import CancelledError, Job, away
from elusive.workbench.parts import Changed
from elusive.workbench.run_bar import RunBar
from elusive.workbench.shell import window

METHOD, TRACKER = ("tracking", "method"), ("tracking", "method", "tracker")
CHOICES = ((*METHOD, "kind"), (*TRACKER, "kind"))
FOURTEEN = (
    CHOICES[0],
    *((*METHOD, "image", "prior", name) for name in ("noise_sd_db", "voxel_sd_db", "correlation_m")),
    (*METHOD, "threshold", "alpha"),
    (*METHOD, "threshold", "beta"),
    (*METHOD, "clusters", "cluster_width_m"),
    ("simulation", "quantiser", "bits"),
    ("simulation", "quantiser", "bit_error_rate"),
    (*TRACKER, "entrance", "width_m"),
    (*TRACKER, "radius_m"),
    (*TRACKER, "memory_frames"),
    *((*TRACKER, "life", name) for name in ("confirm_frames", "confirm_window", "delete_frames")),
)
MORE = (METHOD, ("tracking", "change"), ("tracking", "seed"), ("simulation", "quantiser"), ("particle",))
OUTSIDE = ((*METHOD, "weights"), (*METHOD, "effect", "weights"))  # set with the radiation and the sensors
WORDS = {"appeared": "CANDIDATE", "confirmed": "CONFIRMED", "left": "DELETED, has left", "lost": "DELETED, is lost"}


async def apply(state: LinksState, job: Job) -> bool:
    """Run a tab's scene, or its log, from its paths on; False if it was called off."""
    scene, truth, radiated, log = state.scene, state.truth, state.radiated, state.log

    def work() -> tuple[Radiated | None, SceneRun, dict[str, Any] | None, dict[str, Any]]:
        if log is not None:
            run = run_log(scene, log.frames(scene), scene.tracking, log.truth, name=log.name, on_frame=job.advance)
            return None, run, None, tracking_spec(run)
        field = radiate(scene, truth) if radiated is None else radiated
        run = run_scene(scene, field, on_frame=job.advance)
        return field, run, radiation_spec(scene, field), tracking_spec(run)

    try:
        field, run, seen, tracked = await away(work, job)
    except CancelledError:
        return False
    state.run, state.run_log, state.tracking_spec = run, log, tracked
    if field is not None and state.scene == scene:
        state.radiated, state.truth, state.radiation_spec = field, field.truth, seen
    return True


def log_of(run: SceneRun) -> str:
    """Return the event log, a line an event."""
    lines = [
        f"{event.time_s:5.0f} s  track {event.track}  {WORDS.get(event.what, event.what)}"
        for step in run.steps
        for event in step.state.events
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
                Changed(lambda: state.run_scene, lambda: state.scene, self._back)
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
            FormTools(lambda: (self._form, self._more))
            self._form = Form(scene, (*FOURTEEN, TRACKER), self._take)
            with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                self._more = Form(scene, MORE, self._take, without=(*self._form.paths, *OUTSIDE))

    def _set(self, title: str | None) -> None:
        if title is None:
            return
        preset, drawn = presets()[title], self._state.scene.simulation
        # paths and area that were drawn stay, all else is the table's
        kept: dict[str, Any] = {"walks": drawn.walks, "paths": drawn.paths, "seed": drawn.seed}
        if not title.startswith("Table 4.7"):
            kept["network"] = drawn.network
        frames = self._state.scene.tracking.calibration_frames
        tracking = preset.tracking.replace(calibration_frames=frames)
        self._state.take(preset.replace(simulation=preset.simulation.replace(**kept), tracking=tracking))
        self._build()
        self._show()

    def _take(self, scene: LinkScene) -> LinkScene:
        before = self._state.scene
        kept = self._state.take(scene)
        self._form.model = self._more.model = kept
        if _kinds(kept) != _kinds(before):
            self._build()
        self._show()
        return kept

    def _back(self) -> None:
        run = self._state.run
        if run is not None:
            self._state.take(run.scene)
            self._build()

    async def _run(self) -> None:
        state = self._state
        if not are_right((self._form, self._more)):
            return
        state.job, state.message, state.refused = (job := Job()), "", ""
        self._show()
        try:
            done = await apply(state, job)
            state.message = "Tracked." if done else "Cancelled."
            if done and not self._fields.is_deleted:
                self._go_on()
        except ElusiveError as error:
            state.refused = in_plain_words(str(error))
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
        run = self._state.run
        self._busy = self._state.job is not None
        self._bar.show()
        self._bar.tell(self._state.message)
        self._log.text = "Press Apply." if run is None else log_of(run)


def _kinds(scene: LinkScene) -> tuple[str, ...]:
    """Return what is chosen of several, on which the fields depend."""
    method: Any = scene.tracking.method
    return method.kind, *(getattr(getattr(method, name, None), "kind", "") for name in ("tracker", "effect"))
