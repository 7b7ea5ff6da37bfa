"""Window 6: how far off, how many missed, false and mismatched; two runs side by side; export.

Mendieta (2017), section 5.7.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from nicegui import ui

from elusive.errors import DataError
from elusive.model import read_yaml
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.scene import LinkScene
from elusive.systems.links.scene_results import (
    BIN_M,
    SHOWN,
    SceneOutcome,
    events_csv,
    histogram,
    score_rows,
    scores_png,
    summary,
    tracks_csv,
)
from elusive.systems.links.scene_run import ESTIMATORS
from elusive.systems.links.track import LinkTracking
from elusive.workbench.exports import table_html
from elusive.workbench.files import UPLOAD_MOST_BYTES, read_upload
from elusive.workbench.jobs import away
from elusive.workbench.parts import Drawing, refuse, told

SCENES = (".yaml", ".yml")
COLOURS = ("#e8590c", "#4c8dff", "#12b886")


class PerformanceWindow:
    """The window of one page."""

    def __init__(self, state: LinksState) -> None:
        self._state = state
        self._box = ui.element("section").classes("ew-box w-full")
        self._show()

    def _show(self) -> None:
        state = self._state
        self._box.clear()
        with self._box, ui.column().classes("w-full gap-3"):
            if state.outcome is None:
                ui.label("Nothing is tracked yet: press Apply under Algorithm.").classes("ew-note")
            elif not state.outcome.scores:
                ui.label("The truth of this recording is not known: there is nothing to score by.").classes("ew-note")
            else:
                self._scores(state.outcome, state.kept)
            with ui.element("div").classes("ew-row"):
                if state.outcome is not None:
                    self._exports(state.outcome)
                if state.log is not None:
                    ui.button("Configuration for track links", on_click=self._configuration).props("outline no-caps")
                ui.button("Scene as YAML", on_click=self._scene).props("outline no-caps")
                ui.upload(
                    label="Open a scene (YAML)", auto_upload=True, on_upload=self._sent, max_files=1,
                    max_file_size=UPLOAD_MOST_BYTES, on_rejected=lambda: refuse("The file is refused: send one .yaml."),
                ).props('accept=".yaml,.yml" flat bordered')  # fmt: skip
            ui.label("Run the scene again without a browser: elusive scene scene.yaml --out results").classes("ew-note")

    def _scores(self, outcome: SceneOutcome, kept: SceneOutcome | None) -> None:
        runs = [("This run", outcome)] + ([("Kept run", kept)] if kept is not None and kept.scores else [])
        with ui.element("div").classes("ew-row"):
            for title, one in runs:
                with ui.column().classes("gap-0 pr-8"):
                    ui.label(f"MOTA, {title.lower()}").classes("ew-section")
                    ui.label(f"{one.scores[0].mota:.4f}").classes("ew-score").props(f'data-mota="{title}"')
            ui.button("Keep this run to compare", on_click=self._keep).props("outline no-caps")
            if kept is not None:
                ui.button("Forget the kept run", on_click=self._forget).props("flat no-caps")
        heads = [f"{title}: {shown}" if len(runs) > 1 else shown for title, _ in runs for shown in SHOWN]
        rows = [
            (cells[0][0], *(text for row in cells for text in row[1:]))
            for cells in zip(*(score_rows(one) for _, one in runs), strict=True)
        ]
        with ui.element("div").classes("ew-scroll"):
            ui.html(table_html(["", *heads], rows), sanitize=False)
        with ui.element("div").classes("ew-charts"):
            for title, one in runs:
                edges, counts = histogram(one.scores[0])
                series = [
                    {"name": name, "x": edges, "y": count, "colour": colour}
                    for name, count, colour in zip(ESTIMATORS, counts, COLOURS, strict=True)
                ]
                with ui.element("div"):
                    ui.label(f"How far off? {title}").classes("ew-section")
                    Drawing("chart", {
                        "label": f"Histogram of deviations, {title}", "series": series, "bars": BIN_M,
                        "xlim": [0, 2], "xlabel": "deviation of a pair [m]", "ylabel": "pairs",
                    })  # fmt: skip

    def _exports(self, outcome: SceneOutcome) -> None:
        text = {
            "Tracks as CSV": (lambda: tracks_csv(outcome.run), "tracks.csv"),
            "Events as CSV": (lambda: events_csv(outcome.run), "events.csv"),
            "Scores as JSON": (lambda: json.dumps(summary(outcome), indent=1) + "\n", "scores.json"),
        }
        for label, (write, name) in text.items():

            def give(write: Any = write, name: str = name) -> None:
                ui.download.content(write(), name)

            ui.button(label, on_click=give).props("outline no-caps")
        if outcome.scores:
            ui.button("Figure as PNG", on_click=lambda: self._figure(outcome)).props("outline no-caps")

    async def _figure(self, outcome: SceneOutcome) -> None:
        def draw() -> bytes:
            with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
                path = Path(folder) / "scores.png"
                scores_png(outcome, path)
                return path.read_bytes()

        ui.download.content(await away(draw), "scores.png")

    def _scene(self) -> None:
        ui.download.content(self._state.scene.to_yaml(), "scene.yaml")

    async def _sent(self, event: Any) -> None:
        data = await event.file.read()
        with told():
            scene = read_upload(event.file.name, data, SCENES, _read_scene)
            self._state.take(scene)
            ui.notify("The scene is open: press Apply under Algorithm.", type="positive")
        self._show()

    def _configuration(self) -> None:
        state = self._state
        tracking = LinkTracking(
            method=state.scene.method.replace(
                voxel_m=state.scene.simulation.voxel_m, weights=state.scene.simulation.weights
            ),
            calibration_frames=state.calibration.calibration_frames,
            area=state.scene.area,
        )
        ui.download.content(tracking.to_yaml(), "track_links.yaml")

    def _keep(self) -> None:
        self._state.kept = self._state.outcome
        self._show()

    def _forget(self) -> None:
        self._state.kept = None
        self._show()


def _read_scene(path: Path) -> LinkScene:
    scene = LinkScene(**read_yaml(path))
    if scene.nodes is None and scene.simulation.network.kind == "file":
        raise DataError(f"{path}: names a file of nodes on a disk; list the nodes under 'nodes' instead.")
    return scene
