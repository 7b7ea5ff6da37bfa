"""Window 2: what is assumed of motion and noise, which estimators run side by side, Run and Cancel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

from nicegui import ui

from elusive.errors import DataError
from elusive.pipelines.bearings import FilterName
from elusive.workbench.bearings.panels import watch_spec
from elusive.workbench.bearings.run import Flown, fly
from elusive.workbench.bearings.scene import BearingScene
from elusive.workbench.bearings.state import BearingsState
from elusive.workbench.jobs import CancelledError, Job, away
from elusive.workbench.parts import Form, told
from elusive.workbench.shell import window

MAIN = tuple(
    ("tracking", name) for name in ("motion", "sigma_deg", "q", "q_jerk", "q_speed", "q_turn", "stay_s", "loss")
)
OUTSIDE = (("tracking", "filter"), ("tracking", "elevations"), ("tracking", "q_vertical"))
NAMES = {
    "map": "map: batch MAP", "rts": "rts: RTS smoother", "fixed-lag": "fixed-lag: smoother with a lag",
    "iekf": "iekf: iterated EKF",
    "ekf": "ekf: extended Kalman", "fg-eks": "fg-eks: Jiang's smoother", "fg-ekf": "fg-ekf: Jiang's filter",
}  # fmt: skip


async def run(state: BearingsState, job: Job) -> bool:
    """Run a tab's scene; False if it was called off or the scene changed meanwhile."""
    scene = state.scene

    def work() -> tuple[Flown, dict[str, Any]]:
        flown = fly(scene, job.advance)
        job.advance(len(scene.estimators))
        return flown, watch_spec(flown)

    try:
        flown, spec = await away(work)
    except CancelledError:
        return False
    if state.scene != scene:
        return False
    state.forget_run()
    state.flown, state.spec = flown, spec
    return True


class TrackWindow:
    """The window of one page."""

    def __init__(self, state: BearingsState, go_on: Callable[[], None]) -> None:
        self._state, self._go_on = state, go_on
        with window() as (side, stage):
            with side:
                ui.label("Estimators side by side").classes("ew-section")
                for name in get_args(FilterName):
                    ui.checkbox(
                        NAMES[name], value=name in state.scene.estimators,
                        on_change=lambda event, name=name: self._choose(name, event.value),
                    ).props(f'dense data-estimator="{name}"')  # fmt: skip
                with ui.element("div").classes("ew-row"):
                    self._run = ui.button("Run", on_click=self._start).props("unelevated no-caps")
                    self._cancel = ui.button("Cancel", on_click=self._call_off).props("outline no-caps")
                self._bar = ui.linear_progress(0.0, show_value=False).props('aria-label="Progress"')
                self._told = ui.label().classes("ew-note").props('role="status"')
            with stage, ui.element("div").classes("ew-wide w-full"):
                self._form = Form(state.scene, MAIN, self._take)
                with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                    self._more = Form(state.scene, (("tracking",),), self._take, without=(*self._form.paths, *OUTSIDE))
        ui.timer(0.1, self._watch)
        self._show()

    def _take(self, scene: BearingScene) -> BearingScene:
        kept = self._state.take(scene)
        self._form.model = self._more.model = kept
        return kept

    def _choose(self, name: str, chosen: bool) -> None:
        now = self._state.scene.estimators
        names = [one for one in get_args(FilterName) if (chosen if one == name else one in now)]
        self._take(self._state.scene.replace(estimators=tuple(names)))

    async def _start(self) -> None:
        state = self._state
        if not (self._form.is_right and self._more.is_right):
            ui.notify("Correct the marked fields first.", type="warning")
            return
        state.job = job = Job()
        self._show()
        done = False
        try:
            with told():
                if not state.scene.estimators:
                    raise DataError("estimators: none is chosen; choose one or more.")
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
        job, names = self._state.job, self._state.scene.estimators
        if job is not None and names:
            self._bar.set_value(job.done / len(names))
            self._told.text = f"{names[job.done]} ..." if job.done < len(names) else "drawing ..."

    def _show(self) -> None:
        busy = self._state.job is not None
        self._bar.visible = busy
        self._run.set_enabled(not busy)
        self._cancel.set_enabled(busy)
