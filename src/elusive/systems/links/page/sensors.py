"""Window 3: where the sensors stand; placed by a click, by typed coordinates, in a ring or a grid; moved by dragging.

Mendieta (2017), section 5.4.
"""

from __future__ import annotations

from typing import Any

from nicegui import ui

from elusive.errors import DataError, ElusiveError
from elusive.geometry.places import NamedPlace, with_place
from elusive.io.csv_files import csv_text
from elusive.io.placed_files import read_nodes
from elusive.sensors.radio_network import COLUMNS as NODE_COLUMNS
from elusive.systems.links.networks import BorderNodes, GridNodes, PlacedNodes
from elusive.systems.links.page.floors import node_floor
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.scene import Coverage, LinkScene, coverage_of
from elusive.workbench.files import inside, read_upload
from elusive.workbench.form import Form
from elusive.workbench.jobs import Latest, away
from elusive.workbench.opener import uploader
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import window

COLUMNS = [
    {"name": "name", "label": "Sensor", "field": "name", "align": "left"},
    {"name": "x_m", "label": "x [m]", "field": "x_m"},
    {"name": "y_m", "label": "y [m]", "field": "y_m"},
    {"name": "kind", "label": "Type", "field": "kind", "align": "left"},
]
TABLES = (".csv", ".txt")
EXCESS = ("simulation", "weights", "excess_m")
# of the table's boxes
NAMED = {"header-selection": "'Select all of this page'", "body-selection": "'Select ' + props.row.name"}


class SensorsWindow:
    """The window of one page."""

    def __init__(self, state: LinksState) -> None:
        self._state = state
        self._maps = Latest()
        self._one = NamedPlace(name="1", x_m=0.0, y_m=0.0)
        with window() as (side, stage):
            with side:
                self._build_side()
            with stage, ui.element("div").classes("ew-row"):
                self._ellipses = ui.button(on_click=self._toggle_ellipses).props("outline no-caps dense")
                self._heat = ui.button(on_click=self._toggle_coverage).props("outline no-caps dense")
                self._told = ui.label().classes("ew-note").props('role="status"')
            with stage:
                ui.label(
                    "Click to place a sensor, drag to move it, click it to select it; or arrow keys, Enter, Delete."
                ).classes("ew-note")
                self._floor = Drawing(node_floor(state, state.listed(), None))
                for name in ("placed", "moved", "chosen", "removed"):
                    self._floor.on(name, getattr(self, f"_{name}"))
                self._table = ui.table(
                    columns=COLUMNS, rows=[], row_key="name", selection="multiple", pagination=10,
                    on_select=self._selected,
                ).props("dense flat").classes("w-full")  # fmt: skip
                for slot, words in NAMED.items():
                    self._table.add_slot(slot, f'<q-checkbox dense v-model="props.selected" :aria-label="{words}" />')
                with ui.element("div").classes("ew-row"):
                    ui.button("Delete selected", on_click=self._removed).props("outline no-caps")
                    ui.button("Delete all", on_click=lambda: self._take(())).props("flat no-caps")
        ui.timer(0.01, self._show, once=True)

    def _build_side(self) -> None:
        ui.label("One sensor").classes("ew-section")
        self._typed = Form(self._one, ((),), self._note, grouped=False)
        ui.button("Add sensor", on_click=self._add).props("unelevated no-caps")
        ui.label("Many").classes("ew-section")
        self._ring = Form(BorderNodes(), ((),), lambda model: None, grouped=False)
        ui.button("Place in a ring", on_click=lambda: self._by_rule(self._ring)).props("outline no-caps")
        self._grid = Form(GridNodes(), ((),), lambda model: None, grouped=False)
        ui.button("Place in a grid", on_click=lambda: self._by_rule(self._grid)).props("outline no-caps")
        ui.label("Links").classes("ew-section")
        self._excess = Form(self._state.scene, (EXCESS,), self._weigh, grouped=False)
        ui.label("Files").classes("ew-section")
        self._name = ui.input("File name", value="sensors.csv").props("dense outlined").classes("w-full")
        with ui.element("div").classes("ew-row"):
            ui.button("Load", on_click=self._load).props("outline no-caps")
            ui.button("Save", on_click=lambda: self._save(over=True)).props("outline no-caps")
            ui.button("Save as", on_click=lambda: self._save(over=False)).props("outline no-caps")
            ui.button("Download", on_click=self._download).props("flat no-caps")
        uploader("Open a CSV from this computer", self._sent, (".csv", ".txt"))

    async def _take(self, nodes: tuple[NamedPlace, ...]) -> None:
        with errors_shown():
            self._state.simulate(network=PlacedNodes(places=nodes))
        self._state.selected &= {one.name for one in nodes}
        await self._show()

    def _note(self, one: NamedPlace) -> None:
        self._one = one

    def _weigh(self, scene: LinkScene) -> LinkScene:
        kept = self._state.take(scene)
        ui.timer(0.01, self._show, once=True)
        return kept

    async def _add(self) -> None:
        if self._typed.is_right:
            with errors_shown():
                await self._take(with_place(self._state.listed(), self._one.x_m, self._one.y_m, self._one.name))

    async def _placed(self, event: Any) -> None:
        with errors_shown():
            await self._take(with_place(self._state.listed(), event.args["x"], event.args["y"]))

    async def _moved(self, event: Any) -> None:
        at = {"x_m": event.args["x"], "y_m": event.args["y"]}
        await self._take(
            tuple(one.replace(**at) if one.name == event.args["name"] else one for one in self._state.listed())
        )

    async def _chosen(self, event: Any) -> None:
        self._state.selected ^= {event.args["name"]}
        await self._show()

    async def _selected(self, event: Any) -> None:
        self._state.selected = {row["name"] for row in event.selection}
        await self._show()

    async def _removed(self) -> None:
        if not self._state.selected:
            ui.notify("Select sensors in the table or on the map first.", type="warning")
            return
        await self._take(tuple(one for one in self._state.listed() if one.name not in self._state.selected))

    async def _by_rule(self, form: Form) -> None:
        if not form.is_right:
            return
        network: Any = form.model
        with errors_shown():
            nodes = network.bind(self._state.scene.area)
            rows = zip(nodes.names, nodes.positions_m.tolist(), strict=True)
            await self._take(tuple(NamedPlace(name=name, x_m=x, y_m=y) for name, (x, y) in rows))

    def _toggle_ellipses(self) -> Any:
        self._state.shows_ellipses ^= True
        return self._show()

    def _toggle_coverage(self) -> Any:
        self._state.shows_coverage ^= True
        return self._show()

    async def _load(self) -> None:
        with errors_shown():
            nodes = read_nodes(inside(SETTINGS.folder, self._name.value or "", TABLES))
            await self._take(tuple(_listed(nodes)))

    def _save(self, *, over: bool) -> None:
        with errors_shown():
            path = inside(SETTINGS.folder, self._name.value or "", TABLES)
            if path.exists() and not over:
                raise DataError(f"{path.name}: is there already; press Save to replace it, or choose another name.")
            path.write_text(nodes_csv(self._state.listed()), encoding="utf-8")
            ui.notify(f"Saved as {path.name}.", type="positive")

    def _download(self) -> None:
        ui.download.content(nodes_csv(self._state.listed()), "sensors.csv")

    async def _sent(self, event: Any) -> None:
        event.sender.reset()
        data = await event.file.read()
        with errors_shown():
            await self._take(tuple(_listed(read_upload(event.file.name, data, TABLES, read_nodes))))

    async def _show(self) -> None:
        state, nodes = self._state, self._state.listed()
        self._excess.model = state.scene
        self._ellipses.text = "Hide ellipses" if state.shows_ellipses else "Show ellipses"
        self._heat.text = "Hide coverage" if state.shows_coverage else "Show coverage"
        links = len(nodes) * (len(nodes) - 1) // 2
        words = f"{len(nodes)} sensors, {links} links"
        x0, x1, y0, y1 = state.scene.area.bounds_m
        reach = max(x1 - x0, y1 - y0)
        far = [
            one.name
            for one in nodes
            if not (x0 - reach <= one.x_m <= x1 + reach and y0 - reach <= one.y_m <= y1 + reach)
        ]
        if far:
            words += f"; far from the area of {x1 - x0:g} by {y1 - y0:g} m: {', '.join(far[:5])}; is that in metres?"
        coverage: Coverage | None = None
        is_latest = self._maps.ask()
        if state.shows_coverage:
            scene = state.scene
            try:
                coverage = await away(lambda: coverage_of(scene))
                words += f", {coverage.blind} of {coverage.voxels} voxels blind"
            except ElusiveError as error:
                words = str(error)
        if not is_latest():
            return
        self._told.text = words
        self._floor.show(node_floor(state, nodes, coverage))
        rows = [{"name": one.name, "x_m": f"{one.x_m:.2f}", "y_m": f"{one.y_m:.2f}", "kind": "RF"} for one in nodes]
        self._table.rows = rows
        self._table.selected = [row for row in rows if row["name"] in state.selected]
        self._table.update()


def nodes_csv(nodes: tuple[NamedPlace, ...]) -> str:
    """Return the sensors as `elusive track links --nodes` reads them."""
    return csv_text(NODE_COLUMNS, ((node.name, node.x_m, node.y_m) for node in nodes))


def _listed(nodes: Any) -> list[NamedPlace]:
    return [
        NamedPlace(name=name, x_m=x, y_m=y)
        for name, (x, y) in zip(nodes.names, nodes.positions_m.tolist(), strict=True)
    ]
