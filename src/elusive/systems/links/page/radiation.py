"""Window 2: what people do to the radio field, step by step, from above or as a surface that can be turned.

Mendieta (2017), section 5.3.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from nicegui import ui

from elusive.errors import DataError
from elusive.io.truth import read_truth
from elusive.systems.links.page.panels import radiation_spec
from elusive.systems.links.page.state import LOGS, LinksState, Recorded
from elusive.systems.links.scene import LinkScene, radiate
from elusive.workbench.files import read_upload
from elusive.workbench.form import Form, are_right
from elusive.workbench.jobs import away
from elusive.workbench.opener import uploader
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.shell import window

SIMULATION = ("simulation",)
RADIATION = ("simulation", "radiation")
MAIN = (
    (*RADIATION, "amplitude_db"),
    (*SIMULATION, "calibration_steps"),
    (*SIMULATION, "weights", "voxel_m"),
    *((*RADIATION, name) for name in ("width_x_m", "width_y_m", "rotation_rad", "voxel_noise_db")),
)
MORE = tuple(
    (*RADIATION, name) for name in ("attenuation", "exponent", "link_noise_db", "fading", "channels")
)  # fmt: skip


class RadiationWindow:
    """The window of one page."""

    def __init__(self, state: LinksState) -> None:
        self._state = state
        with window() as (side, stage):
            with side:
                self._form = Form(state.scene, MAIN, self._take, grouped=False)
                with ui.expansion("More of the model").props("dense").classes("w-full"):
                    self._more = Form(state.scene, MORE, self._take, grouped=False)
                self._button = ui.button("Create radiation", on_click=self._create).props("unelevated no-caps")
                self._wait = ui.linear_progress(show_value=False).props("indeterminate")
                self._wait.visible = False
                self._build_log()
            self._stage = stage
        self._show()

    def _build_log(self) -> None:
        ui.label("Or a recorded log").classes("ew-section")
        ui.label("In place of paths and radiation; the sensors must be those of the log.").classes("ew-note")
        self._calibration = Form(self._state.scene, (("tracking", "calibration_frames"),), self._take, grouped=False)
        for label, take in (("Open a log (CSV)", self._sent_log), ("Open its truth (CSV)", self._sent_truth)):
            uploader(label, take, (".csv", ".txt"))
        ui.button("Back to the simulation", on_click=lambda: self._record(None)).props("flat no-caps dense")

    def _record(self, log: Recorded | None) -> None:
        self._state.record(log)
        self._show()

    async def _sent_log(self, event: Any) -> None:
        log, scene = Recorded(event.file.name, await event.file.read()), self._state.scene
        event.sender.reset()
        with errors_shown():
            frames = await away(lambda: log.frames(scene))
            self._record(log)
            ui.notify(f"{len(frames)} frames: press Apply under Algorithm.", type="positive")

    async def _sent_truth(self, event: Any) -> None:
        data = await event.file.read()
        event.sender.reset()
        with errors_shown():
            truth = read_upload(event.file.name, data, LOGS, partial(read_truth, unit="m"))
            if self._state.log is None:
                raise DataError(f"{event.file.name}: is the truth of no log; open the log first.")
            self._record(self._state.log._replace(truth=truth))

    def _take(self, scene: LinkScene) -> LinkScene:
        kept = self._state.take(scene)
        self._form.model = self._more.model = self._calibration.model = kept
        self._show()
        return kept

    async def _create(self) -> None:
        state = self._state
        if not are_right((self._form, self._more)):
            return
        scene, truth = state.scene, state.truth
        self._wait.visible = True
        self._button.disable()
        try:
            with errors_shown():
                radiated = await away(lambda: radiate(scene, truth))
                spec = await away(lambda: radiation_spec(scene, radiated))
                if state.scene == scene:
                    state.radiated, state.radiation_spec, state.truth = radiated, spec, radiated.truth
        finally:
            self._wait.visible = False
            self._button.enable()
        if not self._stage.is_deleted:  # the window may have been left meanwhile
            self._show()

    def _show(self) -> None:
        self._stage.clear()
        with self._stage:
            log = self._state.log
            if log is not None:
                known = "with its truth" if log.truth is not None else "without a truth"
                ui.label(f"The recorded log {log.name}, {known}, is used in place of paths and radiation.")
            elif self._state.radiation_spec is None:
                ui.label("No radiation yet: press Create radiation.").classes("ew-note")
            else:
                Drawing(self._state.radiation_spec)
                ui.label("In 3-D the surface is turned by dragging it.").classes("ew-note")
