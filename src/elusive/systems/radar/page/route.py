"""Window 2: the route, drawn with the pointer, the radar, placed by a click, and the plots it makes."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from elusive.geometry.local_frame import LocalFrame
from elusive.geometry.places import along_path
from elusive.report.extents import Extent
from elusive.systems.radar.page.chart import EMPTY
from elusive.systems.radar.page.maps import about_route, ashore_m, chart_floor
from elusive.systems.radar.page.state import ChartsState
from elusive.systems.radar.scene import RadarScene
from elusive.systems.radar.scene_run import record
from elusive.workbench.exports import table_html
from elusive.workbench.form import Form, are_right
from elusive.workbench.jobs import Latest, away
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.shell import window

MODES = {
    "path": "Draw the route",
    "another": "Draw another ship's",
    "node": "Place the radar",
    "view": "Look",
}
HOW = {
    "path": "Draw with the pointer held down; or move a cross with the arrow keys, Enter for each waypoint, C to end.",
    "another": "Draw the route of one more ship in the same ways.",
    "node": "Click where the radar stands, or drag it.",
    "view": "",
}
VOYAGE = (("simulation", "speed_mps"), ("simulation", "interval_s"), ("simulation", "seed"))
PLACE = (("radar", "lon_deg"), ("radar", "lat_deg"))
RADAR = tuple(
    ("simulation", "radar", name)
    for name in (
        "range_sd_m", "bearing_sd_mrad", "doppler_sd_mps", "detection_probability", "false_alarms", "max_range_m",
    )
)  # fmt: skip
WAYPOINTS = 60  # at most, of a route that is drawn


class RouteWindow:
    """The window of one page."""

    def __init__(self, state: ChartsState) -> None:
        self._state, self._mode = state, "path"
        self._whole: Extent | None = None
        self._maps = Latest()
        state.view = None
        with window() as (side, stage):
            with side:
                ui.label("Voyage").classes("ew-section")
                self._voyage = Form(state.scene, VOYAGE, self._take, grouped=False)
                ui.label("Radar").classes("ew-section")
                self._place = Form(state.scene, PLACE, self._take, grouped=False)
                self._radar = Form(state.scene, RADAR, self._take, grouped=False)
                with ui.expansion("More of the radar").props("dense").classes("w-full"):
                    self._more = Form(state.scene, (("simulation", "radar"),), self._take, grouped=False, without=RADAR)
                self._button = ui.button("Create plots", on_click=self._create).props("unelevated no-caps")
                ui.button("Clear the route", on_click=self._clear).props("flat no-caps")
            with stage:
                with ui.element("div").classes("ew-row"):
                    ui.toggle(MODES, value=self._mode, on_change=self._choose).props("no-caps unelevated").classes(
                        "ew-modes"
                    )
                self._how = ui.label(HOW[self._mode]).classes("ew-note")
                self._floor = Drawing(EMPTY)
                for name in ("drawn", "placed", "moved", "viewed"):
                    self._floor.on(name, getattr(self, f"_{name}"))
                self._told = ui.label().classes("ew-note").props('role="status"')
                self._box = ui.element("div").classes("ew-scroll")
        ui.timer(0.01, self._show, once=True)

    def _forms(self) -> tuple[Form, ...]:
        return self._voyage, self._place, self._radar, self._more

    def _take(self, scene: RadarScene) -> RadarScene:
        kept = self._state.take(scene)
        for form in self._forms():
            form.model = kept
        ui.timer(0.01, self._show, once=True)
        return kept

    def _choose(self, event: Any) -> Any:
        self._mode = event.value
        return self._show()

    async def _drawn(self, event: Any) -> None:
        with errors_shown():
            points = np.array(event.args["points"], np.float64).reshape(-1, 2)
            length = float(np.hypot(*np.diff(points, axis=0).T).sum())
            corners = np.concatenate([along_path(points, max(length / WAYPOINTS, 1.0)), points[-1:]])
            degrees = np.round(self._state.frame.to_lonlat(corners), 7)
            scene = self._state.scene
            others = scene.routes_deg if self._mode == "another" else scene.routes_deg[:-1]
            self._take(scene.replace(routes_deg=(*others, tuple(map(tuple, degrees.tolist())))))

    async def _placed(self, event: Any) -> None:
        x, y = event.args["x"], event.args["y"]
        with errors_shown():
            lon, lat = np.round(self._state.frame.to_lonlat([[x, y]])[0], 7).tolist()
            radar = self._state.scene.radar.replace(lon_deg=lon, lat_deg=lat)
            self._place.show(self._take(self._state.scene.replace(radar=radar)))

    async def _moved(self, event: Any) -> None:
        await self._placed(event)

    async def _viewed(self, event: Any) -> None:
        seen = event.args
        self._state.view = None if seen.get("whole", True) else tuple(seen["extent"])
        await self._show()

    def _clear(self) -> None:
        self._take(self._state.scene.replace(routes_deg=()))

    async def _create(self) -> None:
        state, scene = self._state, self._state.scene
        if not are_right(self._forms()):
            return
        if state.chart is None:
            ui.notify("Open a chart first, under Chart.", type="warning")
            return
        chart = state.chart.file
        self._button.disable()
        try:
            with errors_shown():
                recorded = await away(lambda: record(scene, chart))
                if state.scene == scene:
                    state.recorded = recorded
        finally:
            self._button.enable()
        await self._show()

    async def _show(self) -> None:
        state = self._state
        if state.chart is None:
            self._told.text = "Open a chart first, under Chart."
            return
        mode = "path" if self._mode == "another" else self._mode
        if self._whole is None:
            self._whole = about_route(state)
        whole = self._whole
        is_latest = self._maps.ask()
        drawn = await away(lambda: chart_floor(state, whole, mode, way=True))
        ashore = await away(lambda: ashore_m(state))
        if not is_latest():
            return
        self._floor.show(drawn)
        self._how.text = HOW[self._mode]  # once the map does it
        routes = [f"A route of {len(route)} waypoints, {_length(route)}" for route in state.scene.routes_deg]
        notes = (f", {part:.0f} m of it on charted land." if part >= 1 else "." for part in ashore)
        self._told.text = " ".join(map("".join, zip(routes, notes, strict=False))) or "No route yet."
        self._box.clear()
        if state.recorded is not None:
            with self._box:
                ui.html(table_html(["", "simulated"], [tuple(row) for row in state.recorded.rows]), sanitize=False)


def _length(route: tuple[tuple[float, float], ...]) -> str:
    places = LocalFrame.at(*route[0]).to_local(np.array(route))
    return f"{np.hypot(*np.diff(places, axis=0).T).sum():.0f} m"
