"""Window 3: what the tracker assumes, which uses of the chart run side by side, Run and Cancel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from elusive.errors import DataError
from elusive.workbench.charts.panels import watch_spec
from elusive.workbench.charts.run import Sailed, sail
from elusive.workbench.charts.scene import USES, ChartScene, sailing
from elusive.workbench.charts.state import ChartsState
from elusive.workbench.jobs import CancelledError, Job, away
from elusive.workbench.parts import Form, told
from elusive.workbench.shell import window

TRACKING = ("tracking",)
MAIN = (
    *((*TRACKING, name) for name in ("particles", "max_acceleration_mps2", "motion", "estimate", "seed", "coast")),
    *((*TRACKING, "radar", name) for name in ("detection_probability", "false_alarms")),
    *((*TRACKING, "radar", name) for name in ("range_sd_m", "bearing_sd_mrad")),
)  # fmt: skip
OUTSIDE = ((*TRACKING, "knowledge"), (*TRACKING, "scene"))
NAMES = {
    "none": "none: no chart", "hard": "hard: charted land is never sailed", "nearest": "nearest: the nearest coast",
    "grid": "grid: the thesis's, convolved on cells", "exact": "exact: convolved without cells",
    "field": "field: exact, kept as a spline",
}  # fmt: skip


async def run(state: ChartsState, job: Job) -> bool:
    """Run a tab's scene; False if it was called off or the scene changed meanwhile."""
    scene = state.scene
    if state.chart is None:
        raise DataError("chart: none is open; open one under Chart.")
    chart = state.chart.file

    def work() -> tuple[Sailed, dict[str, Any]]:
        sailed = sail(scene, chart, job.advance)
        job.advance(job.done)
        return sailed, watch_spec(sailed)

    try:
        sailed, spec = await away(work)
    except CancelledError:
        return False
    if state.chart.file is not chart or state.scene != scene:
        return False
    state.forget_run()
    state.sailed, state.spec = sailed, spec
    return True


class TrackWindow:
    """The window of one page."""

    def __init__(self, state: ChartsState, go_on: Callable[[], None]) -> None:
        self._state, self._go_on, self._scans = state, go_on, 1
        with window() as (side, stage):
            with side:
                ui.label("Uses of the chart side by side").classes("ew-section")
                for name in USES:
                    ui.checkbox(
                        NAMES[name], value=name in state.scene.methods,
                        on_change=lambda event, name=name: self._choose(name, event.value),
                    ).props(f'dense data-method="{name}"')  # fmt: skip
                with ui.element("div").classes("ew-row"):
                    self._run = ui.button("Run", on_click=self._start).props("unelevated no-caps")
                    self._cancel = ui.button("Cancel", on_click=self._call_off).props("outline no-caps")
                self._bar = ui.linear_progress(0.0, show_value=False).props('aria-label="Progress"')
                self._told = ui.label().classes("ew-note").props('role="status"')
            with stage, ui.element("div").classes("ew-wide w-full"):
                self._form = Form(state.scene, MAIN, self._take)
                with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                    self._more = Form(state.scene, (TRACKING,), self._take, without=(*self._form.paths, *OUTSIDE))
        ui.timer(0.1, self._watch)
        self._show()

    def _take(self, scene: ChartScene) -> ChartScene:
        kept = self._state.take(scene)
        self._form.model = self._more.model = kept
        return kept

    def _choose(self, name: str, chosen: bool) -> None:
        now = self._state.scene.methods
        methods = tuple(one for one in USES if (chosen if one == name else one in now))
        self._take(self._state.scene.replace(methods=methods))

    async def _start(self) -> None:
        state = self._state
        if not (self._form.is_right and self._more.is_right):
            ui.notify("Correct the marked fields first.", type="warning")
            return
        done = False
        state.job = job = Job()
        self._show()
        try:
            with told():
                if not state.scene.methods:
                    raise DataError("methods: none is chosen; choose one or more.")
                if len(state.scene.route_deg) > 1:
                    self._scans = len(sailing(state.scene).times_s)
                done = await run(state, job)
                self._told.text = "" if done else "Cancelled."
        finally:
            state.job = None
            self._show()
        if done:
            self._go_on()

    def _call_off(self) -> None:
        if self._state.job is not None:
            self._state.job.cancel()

    def _watch(self) -> None:
        job, methods = self._state.job, self._state.scene.methods
        if job is not None and methods:
            self._bar.set_value(job.done / (self._scans * len(methods)))
            number = min(job.done // self._scans, len(methods) - 1)
            self._told.text = f"{methods[number]}: scan {job.done - number * self._scans} of {self._scans}"

    def _show(self) -> None:
        busy = self._state.job is not None
        self._bar.visible = busy
        self._run.set_enabled(not busy)
        self._cancel.set_enabled(busy)
