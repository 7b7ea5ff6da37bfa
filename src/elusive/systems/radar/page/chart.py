"""Window 1: the chart; a ready one, one from the folder or one that is sent; land, quality zones, P(water)."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from nicegui import ui

from elusive.errors import ElusiveError
from elusive.systems.radar.chart import describe_charts
from elusive.systems.radar.page.maps import chart_floor, water_raster, whole_chart
from elusive.systems.radar.page.state import KINDS, ChartsState, OpenedChart, example, opened
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene
from elusive.workbench.exports import table_html
from elusive.workbench.form import Form
from elusive.workbench.jobs import Latest, away
from elusive.workbench.opener import opener
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.placing import placing
from elusive.workbench.shell import window

TAKEN = ("tracking", "charted")
MAIN = (
    (*TAKEN, "imprecision", "coast_sigma_m"),
    *((*TAKEN, name) for name in ("draught_m", "water_level_m", "bias_east_m", "bias_north_m")),
)
EMPTY = placing("Sea chart", (0.0, 1.0, 0.0, 1.0))


class ChartWindow:
    """The window of one page."""

    def __init__(self, state: ChartsState) -> None:
        self._state, state.view = state, None
        self._maps = Latest()
        with window() as (side, stage):
            with side:
                ui.label("Chart").classes("ew-section")
                self._name = ui.label().classes("ew-note")
                ui.button("The ready example", on_click=self._ready).props("outline no-caps")
                opener("a chart", KINDS, opened, self._open)
                ui.label("What it is taken to say").classes("ew-section")
                self._form = Form(state.scene, MAIN, self._take, grouped=False)
                with ui.expansion("More of quality and shoals").props("dense").classes("w-full"):
                    self._more = Form(state.scene, (TAKEN,), self._take, without=MAIN)
            with stage:
                with ui.element("div").classes("ew-row"):
                    self._water = ui.button(on_click=self._toggle).props("outline no-caps dense")
                self._floor = Drawing(EMPTY)
                self._floor.on("viewed", self._viewed)
                self._told = ui.label().classes("ew-note").props('role="status"')
                self._box = ui.element("div").classes("ew-scroll")
        ui.timer(0.01, self._show, once=True)

    async def _ready(self) -> None:
        with errors_shown():
            chart = await away(example)
            self._state.open(EXAMPLE_NAME, chart, RadarScene.example())
            self._form.show(self._state.scene)
            self._more.show(self._state.scene)
            await self._show()

    def _open(self, name: str, chart: OpenedChart) -> None:
        self._state.open(name, chart)
        self._form.show(self._state.scene)
        self._more.show(self._state.scene)
        ui.timer(0.01, self._show, once=True)

    def _take(self, scene: RadarScene) -> RadarScene:
        kept = self._state.take(scene)
        self._form.model = self._more.model = kept
        ui.timer(0.01, self._show, once=True)
        return kept

    async def _toggle(self) -> None:
        self._state.shows_water ^= True
        await self._show()

    async def _viewed(self, event: Any) -> None:
        seen = event.args
        self._state.view = None if seen.get("whole", True) else tuple(seen["extent"])
        await self._show()

    async def _show(self) -> None:
        state = self._state
        self._water.text = "Show land and quality zones" if state.shows_water else "Show probability of water"
        if state.chart is None:
            self._name.text = "None is open."
            return
        self._name.text = state.chart.file.name
        self._told.text, whole = "", whole_chart(state)
        seen, is_latest = state.view or whole, self._maps.ask()
        try:
            raster = await away(lambda: water_raster(state, seen)) if state.shows_water else None
            spec = await away(lambda: chart_floor(state, whole, "view", raster))
            tables, sentences = await away(lambda: _description(state))
        except ElusiveError as error:
            if is_latest():
                self._told.text = str(error)
            return
        if not is_latest():
            return
        self._floor.show(spec)
        self._box.clear()
        with self._box:
            for name, rows in tables:
                ui.html(table_html(["", name], rows), sanitize=False)
            for sentence in sentences:
                ui.label(sentence).classes("ew-note")


def _description(state: ChartsState) -> tuple[list[tuple[str, list[tuple[str, ...]]]], list[str]]:
    """Return the tables and the sentences of the tab's chart; none where there is no chart.

    Raises
    ------
    DataError
        If the chart cannot be used.
    """
    if state.chart is None:
        return [], []
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / state.chart.file.name
        path.write_bytes(state.chart.file.data)
        found = describe_charts([path], state.scene.tracking.charted)
        sentences = [*(one.sentence for one in found.disagreements), *found.remarks]
        tables = [(one.name, [tuple(row) for row in one.rows]) for one in found.summaries]
        return tables, [sentence.replace(f"{folder}/", "") for sentence in sentences]
