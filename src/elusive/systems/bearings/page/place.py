"""Window 1: the sensors, placed and moved on the map or typed, and the path, drawn with the pointer."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from elusive.geometry.places import NamedPlace, along_path, with_place
from elusive.systems.bearings.page.panels import scene_floor
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.scene import BearingScene
from elusive.systems.bearings.simulate import length_m
from elusive.workbench.form import Form
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.shell import window

MODES = {"node": "Place sensors", "path": "Draw the path", "view": "Look"}
HOW = {
    "node": "Click to place a sensor, drag to move it, click it to select it; or arrow keys, Enter, Delete.",
    "path": "Draw with the pointer held down; or move a cross with the arrow keys, Enter for each corner, C to end.",
    "view": "",
}
FLIGHT = tuple(("simulation", name) for name in ("speed_mps", "interval_s", "seed"))
HEARD = tuple(("simulation", "sensors", name) for name in ("sigma_deg", "outlier_probability"))
MORE = tuple(("simulation", "sensors", name) for name in ("detection_probability", "bias_sd_deg", "samples"))
CORNER_M = 2.0  # between corners kept of a path that is drawn


class PlaceWindow:
    """The window of one page."""

    def __init__(self, state: BearingsState) -> None:
        self._state, self._mode = state, "node"
        with window() as (side, stage):
            with side:
                ui.label("Path").classes("ew-section")
                self._flight = Form(state.scene, FLIGHT, self._take, grouped=False)
                ui.label("What is heard").classes("ew-section")
                self._heard = Form(state.scene, HEARD, self._take, grouped=False)
                with ui.expansion("More of the sensors").props("dense").classes("w-full"):
                    self._more = Form(state.scene, MORE, self._take, grouped=False)
                ui.label("One sensor").classes("ew-section")
                self._one = Form(NamedPlace(name="4", x_m=0.0, y_m=0.0), ((),), lambda model: None, grouped=False)
                ui.button("Add sensor", on_click=self._add).props("outline no-caps")
                with ui.element("div").classes("ew-row"):
                    ui.button("Delete selected", on_click=self._removed).props("outline no-caps")
                    ui.button("Delete all sensors", on_click=lambda: self._sites(())).props("flat no-caps")
            with stage:
                ui.toggle(MODES, value=self._mode, on_change=self._choose).props("no-caps unelevated").classes(
                    "ew-modes"
                )
                self._how = ui.label(HOW[self._mode]).classes("ew-note")
                self._floor = Drawing(scene_floor(state.scene, self._mode, state.selected))
                for name in ("placed", "moved", "chosen", "removed", "drawn"):
                    self._floor.on(name, getattr(self, f"_{name}"))
                self._told = ui.label().classes("ew-note").props('role="status"')
        self._show()

    def _take(self, scene: BearingScene) -> BearingScene:
        kept = self._state.take(scene)
        for form in (self._flight, self._heard, self._more):
            form.model = kept
        self._show()
        return kept

    def _sites(self, sites: tuple[NamedPlace, ...]) -> None:
        self._state.selected &= {one.name for one in sites}
        self._change(sites=sites)

    def _change(self, **changes: Any) -> None:
        scene = self._state.scene
        self._take(scene.replace(simulation=scene.simulation.replace(**changes)))

    def _add(self) -> None:
        if self._one.is_right:
            one = self._one.model
            with errors_shown():
                self._sites(with_place(self._state.scene.simulation.sites, one.x_m, one.y_m, one.name))

    def _placed(self, event: Any) -> None:
        with errors_shown():
            self._sites(with_place(self._state.scene.simulation.sites, event.args["x"], event.args["y"]))

    def _moved(self, event: Any) -> None:
        at = {"x_m": event.args["x"], "y_m": event.args["y"]}
        with errors_shown():
            sites = self._state.scene.simulation.sites
            self._sites(tuple(one.replace(**at) if one.name == event.args["name"] else one for one in sites))

    def _chosen(self, event: Any) -> None:
        self._state.selected ^= {event.args["name"]}
        self._show()

    def _removed(self) -> None:
        if not self._state.selected:
            ui.notify("Select sensors on the map first.", type="warning")
            return
        self._sites(tuple(one for one in self._state.scene.simulation.sites if one.name not in self._state.selected))

    def _drawn(self, event: Any) -> None:
        with errors_shown():
            points = np.array(event.args["points"], np.float64).reshape(-1, 2)
            corners = np.concatenate([along_path(points, CORNER_M), points[-1:]])
            self._change(ways_m=(tuple(map(tuple, np.round(corners, 3).tolist())),))

    def _choose(self, event: Any) -> None:
        self._mode = event.value
        self._how.text = HOW[self._mode]
        self._show()

    def _show(self) -> None:
        scene = self._state.scene
        self._floor.show(scene_floor(scene, self._mode, self._state.selected))
        flight = scene.simulation
        length = length_m(flight.ways_m[0])
        self._told.text = (
            f"{len(flight.sites)} sensors; a path of {length:.0f} m, {length / flight.speed_mps:.0f} s long, "
            f"{int(flight.steps) + 1} times."
        )
