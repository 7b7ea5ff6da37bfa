"""Window 5: an emitter that stands still, placed by a click and located by the bearings of all sensors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from nicegui import ui

from elusive.metrics.consistency import squared_deviations
from elusive.systems.bearings.page.panels import still_floor
from elusive.systems.bearings.page.place import HEARD
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.page.track import archive
from elusive.systems.bearings.scene import BearingScene, locate_still
from elusive.workbench.exports import show_command, table_html
from elusive.workbench.form import Form, are_right
from elusive.workbench.jobs import away
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.shell import window

COMMAND = "elusive locate bearings.csv --sensors sensors.csv --config config.yaml --out results"


class StillWindow:
    """The window of one page."""

    def __init__(self, state: BearingsState) -> None:
        self._state = state
        with window() as (side, stage):
            with side:
                ui.label("Emitter and estimator").classes("ew-section")
                self._form = Form(state.scene, (("still",),), self._take, grouped=False)
                ui.label("What is heard").classes("ew-section")
                self._heard = Form(state.scene, (*HEARD, ("simulation", "seed")), self._take, grouped=False)
                self._button = ui.button("Locate", on_click=self._locate).props("unelevated no-caps")
                ui.button("Bearings and settings (ZIP)", on_click=self._pack).props("outline no-caps")
                show_command("The same without a browser, from the ZIP:", COMMAND)
            with stage:
                ui.label("Click where the emitter stands, or drag it. Cross and ellipse: where it is located.").classes(
                    "ew-note"
                )
                self._floor = Drawing(still_floor(state.scene, state.found))
                self._floor.on("placed", self._placed)
                self._floor.on("moved", self._moved)
                self._told = ui.label().classes("ew-note").props('role="status"')
                self._box = ui.element("div").classes("ew-scroll")
        self._show()

    def _take(self, scene: BearingScene) -> BearingScene:
        kept = self._state.take(scene)
        self._form.model = self._heard.model = kept
        self._show()
        return kept

    def _placed(self, event: Any) -> None:
        still = self._state.scene.still.replace(x_m=event.args["x"], y_m=event.args["y"])
        self._form.show(self._take(self._state.scene.replace(still=still)))

    def _moved(self, event: Any) -> None:
        if event.args["name"] == "emitter":
            self._placed(event)
        else:
            ui.notify("Sensors are moved under Scene.", type="warning")
            self._show()

    async def _locate(self) -> None:
        state, scene = self._state, self._state.scene
        if not are_right((self._form, self._heard)):
            return
        self._button.disable()
        try:
            with errors_shown():
                found = await away(lambda: locate_still(scene))
                if state.scene == scene:
                    state.found = found
        finally:
            self._button.enable()
        self._show()

    def _pack(self) -> None:
        with errors_shown():
            ui.download.content(archive(self._state.scene, still=True), "emitter.zip")

    def _show(self) -> None:
        scene, heard = self._state.scene, self._state.found
        self._floor.show(still_floor(scene, heard))
        self._box.clear()
        if heard is None:
            self._told.text = "Press Locate."
            return
        found = heard.located
        off = found.fix.position_m - [scene.still.x_m, scene.still.y_m]
        inside = ""
        if math.isfinite(found.ellipse.semi_major_m):
            (squared,) = squared_deviations(off[None], found.fix.covariance[None])
            held = squared <= -2 * math.log1p(-found.ellipse.confidence)
            inside = f", {'inside' if held else 'outside'} the ellipse"
        self._told.text = " ".join([f"{float(np.hypot(*off)):.2f} m from the truth{inside}.", *found.remarks])
        with self._box:
            ui.html(table_html(["", "located"], [*found.table]), sanitize=False)
