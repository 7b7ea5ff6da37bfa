"""Window 1: who walks where; made by rule, or drawn by hand in any area.

Mendieta (2017), section 5.2.
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from nicegui import ui
from pydantic import Field, model_validator

from elusive.geometry.areas import Area
from elusive.geometry.places import along_path
from elusive.model import Model
from elusive.systems.links.page.floors import path_floor
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.scene import LinkScene
from elusive.workbench.form import Form
from elusive.workbench.jobs import away
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.shell import window

WALKS = ("simulation", "walks")
MAIN = tuple((*WALKS, name) for name in ("users", "total_positions", "mean_distance_steps", "step_distance_m"))
MORE = tuple(
    (*WALKS, name)
    for name in (
        "turn_deg", "standing_probability", "mean_standing_steps", "entrance_deg", "latest_entrance",
    )
)  # fmt: skip
MODES = {"view": "Look", "path": "Draw a path", "area": "Draw an area"}
HOW = {
    "view": "",
    "path": "Draw with the pointer held down; or move a cross with the arrow keys, Enter for each corner, C to end.",
    "area": "Click each corner, double-click to close; or arrow keys, Enter for each corner, C to close.",
}


class AreaLimits(Model):
    """A rectangle by its limits."""

    x0: float = Field(-12.0, description="Least x of the area [m]")
    x1: float = Field(12.0, description="Greatest x of the area [m]")
    y0: float = Field(-12.0, description="Least y of the area [m]")
    y1: float = Field(12.0, description="Greatest y of the area [m]")

    @model_validator(mode="after")
    def _some(self) -> Self:
        self.area()
        return self

    def area(self) -> Area:
        """Return the rectangle."""
        return Area.rectangle(self.x0, self.x1, self.y0, self.y1)


class Start(Model):
    """When somebody who is drawn comes in."""

    start: int = Field(0, ge=0, description="Step at which the next path begins, from 0")


class PathsWindow:
    """The window of one page."""

    def __init__(self, state: LinksState) -> None:
        self._state, self._mode = state, "view"
        with window() as (side, stage):
            with side:
                self._build_side()
            with stage:
                ui.toggle(MODES, value="view", on_change=self._choose).props("no-caps unelevated").classes("ew-modes")
                self._how = ui.label().classes("ew-note")
                self._floor = Drawing(path_floor(state, self._mode))
                self._floor.on("drawn", self._drawn)
                self._floor.on("outlined", self._outlined)
                self._told = ui.label().classes("ew-note").props('role="status"')
        self._show()

    def _build_side(self) -> None:
        scene = self._state.scene
        self._form = Form(scene, MAIN, self._take, grouped=False)
        ui.label("Area").classes("ew-section")
        x0, x1, y0, y1 = scene.area.bounds_m
        self._limits = Form(AreaLimits(x0=x0, x1=x1, y0=y0, y1=y1), ((),), self._limit, grouped=False)
        with ui.expansion("More of how people walk").props("dense").classes("w-full"):
            self._more = Form(scene, MORE, self._take, grouped=False)
            self._seed = Form(scene, (("simulation", "seed"),), self._take, grouped=False)
        with ui.element("div").classes("ew-row"):
            ui.button("Create paths", on_click=self._create).props("unelevated no-caps")
            ui.button("New paths", on_click=self._renew).props("outline no-caps").tooltip("With the next seed")
            self._undo = ui.button("Undo", on_click=self._take_back).props("outline no-caps")
        ui.label("By hand").classes("ew-section")
        self._start = Form(Start(), ((),), lambda model: None, grouped=False)
        ui.button("Clear all paths", on_click=self._clear).props("flat no-caps dense")

    def _take(self, scene: LinkScene) -> LinkScene:
        kept = self._state.take(scene)
        for form in (self._form, self._more, self._seed):
            form.model = kept
        self._show()
        return kept

    def _limit(self, limits: AreaLimits) -> None:
        with errors_shown():
            self._state.within(limits.area())
            self._refresh()

    def _refresh(self) -> None:
        for form in (self._form, self._more, self._seed):
            form.model = self._state.scene
        x0, x1, y0, y1 = self._state.scene.area.bounds_m
        limits = AreaLimits(x0=x0, x1=x1, y0=y0, y1=y1)
        if limits != self._limits.model:
            self._limits.show(limits)
        self._show()

    async def _create(self) -> None:
        state = self._state
        simulation = state.simulate(paths=()).simulation
        with errors_shown():
            state.truth = await away(simulation.truth)
        self._refresh()

    async def _renew(self) -> None:
        self._seed.show(self._state.simulate(seed=self._state.scene.simulation.seed + 1))
        await self._create()

    def _take_back(self) -> None:
        if self._state.undo():
            for form in (self._form, self._more, self._seed):
                form.show(self._state.scene)
            self._refresh()

    def _clear(self) -> None:
        self._state.simulate(paths=())
        self._state.truth = None
        self._refresh()

    def _choose(self, event: Any) -> None:
        self._mode = event.value
        self._how.text = HOW[self._mode]
        self._show()

    def _drawn(self, event: Any) -> None:
        with errors_shown():
            step_m = self._state.scene.simulation.walks.step_distance_m
            self._state.add_path(
                along_path(np.array(event.args["points"], np.float64), step_m), self._start.model.start
            )
            self._refresh()

    def _outlined(self, event: Any) -> None:
        with errors_shown():
            self._state.within(Area(corners_m=tuple(map(tuple, event.args["points"]))))
            self._refresh()

    def _show(self) -> None:
        truth, area = self._state.truth, self._state.scene.area
        self._floor.show(path_floor(self._state, self._mode))
        self._undo.set_enabled(bool(self._state.before))
        shape = "rectangle" if len(area.corners_m) == 4 else f"area of {len(area.corners_m)} corners"
        if truth is None:
            self._told.text = f"No paths yet in the {shape}."
            return
        there = np.isfinite(truth[..., 0]).sum(axis=1)
        self._told.text = f"{truth.shape[1]} people, {len(truth)} steps, at most {there.max()} at a time."
