"""Window 6: how far off, how many missed, false and mismatched; two runs side by side; export.

Mendieta (2017), section 5.7.
"""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.model import read_yaml
from elusive.report import drawing as draw
from elusive.report.findings import findings_html
from elusive.report.plots import SERIES
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.page.sensors import nodes_csv
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.report import links_report
from elusive.systems.links.results import CUTOFF_M
from elusive.systems.links.scene import LinkScene, SceneRun
from elusive.workbench.exports import give_made, show_command, table_html, written
from elusive.workbench.files import SCENES, read_upload
from elusive.workbench.opener import uploader
from elusive.workbench.parts import Changed, Drawing, errors_shown

BIN_M = 0.1  # of the histograms
EDGES = [round(BIN_M * number, 6) for number in range(20)]


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
            back = partial(self._take, state.run_scene or state.scene)
            Changed(lambda: state.run_scene, lambda: state.scene, back)
            if state.run is None:
                ui.label("Nothing is tracked yet: press Apply under Algorithm.").classes("ew-note")
            elif state.run.outcome.scored is None:
                ui.label("The truth of this recording is not known: there is nothing to score by.").classes("ew-note")
            else:
                self._scores(state.run, state.kept)
            if state.run is not None:
                ui.html(findings_html(state.run.outcome.findings), sanitize=False)
            with ui.element("div").classes("ew-row"):
                if state.run is not None:
                    self._exports(state.run)
                if state.run_log is None:
                    ui.button("Scene as YAML", on_click=self._scene).props("outline no-caps")
                else:
                    nodes = nodes_csv(state.listed())
                    ui.button("Sensors as CSV", on_click=partial(ui.download.content, nodes, "sensors.csv")).props(
                        "outline no-caps"
                    )
                uploader("Open a scene (YAML)", self._sent, SCENES)
            again = "elusive scene scene.yaml --out results"
            if state.run_log is not None:
                name = shlex.quote(state.run_log.name)
                again = f"elusive track links {name} --nodes sensors.csv --config config.yaml --out results"
            show_command("The same without a browser:", again)

    def _scores(self, run: SceneRun, kept: SceneRun | None) -> None:
        both = (("This run", run), ("Kept run", kept))
        runs = [(title, one, one.outcome.scored) for title, one in both if one is not None and one.outcome.scored]
        with ui.element("div").classes("ew-row"):
            for title, _, scores in runs:
                with ui.column().classes("gap-0 pr-8"):
                    ui.label(f"MOTA, {title.lower()}").classes("ew-section")
                    ui.label(f"{scores.confirmed.mota:.3f}").classes("ew-score").props(f'data-mota="{title}"')
            ui.button("Keep this run to compare", on_click=self._keep).props("outline no-caps")
            if kept is not None:
                ui.button("Forget the kept run", on_click=self._forget).props("flat no-caps")
        tables = [dict(scores.lines()) for *_, scores in runs]
        rows = [(name, *(table.get(name, "") for table in tables)) for name in tables[0]]
        with ui.element("div").classes("ew-scroll"):
            ui.html(table_html(["", *(title for title, *_ in runs)], rows), sanitize=False)
        panels = []
        for title, one, _ in runs:
            found = {name: (apart.mean(), _histogram(apart)) for name, apart in estimates(one).items()}
            bars = [
                draw.bars(EDGES, counts, BIN_M, SERIES[k], beside=(k, len(found)), name=f"{name}: {mean:.3f} m mean")
                for k, (name, (mean, counts)) in enumerate(found.items())
            ]
            top = 1.05 * max([1, *(max(counts) for _, counts in found.values())])
            panels.append(draw.graph(f"How far off? {title}", (0, 2, 0, top), bars, "deviation of a pair [m]", "pairs"))
        Drawing(draw.drawing("Histogram of deviations", [0.0], panels))

    def _exports(self, run: SceneRun) -> None:
        tracks, events = run.tables
        texts = {
            "Tracks as CSV": (tracks, "tracks.csv"),
            "Events as CSV": (events, "events.csv"),
            "Scores as JSON": ("{}\n" if run.outcome.scored is None else run.outcome.scored.text, "scores.json"),
            "Configuration for track links": (run.tracking.to_yaml(), "config.yaml"),
        }
        for label, (text, name) in texts.items():
            ui.button(label, on_click=partial(ui.download.content, text, name)).props("outline no-caps")

        def page(path: Path) -> None:
            links_report(run.outcome.tracked, run.outcome.findings).write_page(path)

        def figure(path: Path) -> None:
            links_report(run.outcome.tracked).write_figure(path)

        give = partial(give_made, partial(written, page), "report.html")
        ui.button("Report (HTML)", on_click=give).props("outline no-caps")
        if run.outcome.scored:
            give = partial(give_made, partial(written, figure, "report.png"), "report.png")
            ui.button("Figure as PNG", on_click=give).props("outline no-caps")

    def _scene(self) -> None:
        """Give the scene of the run that is shown."""
        ui.download.content((self._state.run_scene or self._state.scene).to_yaml(), "scene.yaml")

    def _take(self, scene: LinkScene) -> None:
        self._state.take(scene)

    async def _sent(self, event: Any) -> None:
        data = await event.file.read()
        with errors_shown():
            scene = read_upload(event.file.name, data, SCENES, read_scene)
            self._state.take(scene)
            ui.notify("The scene is open: press Apply under Algorithm.", type="positive")
        self._show()

    def _keep(self) -> None:
        self._state.kept = self._state.run
        self._show()

    def _forget(self) -> None:
        self._state.kept = None
        self._show()


def read_scene(path: Path) -> LinkScene:
    """Read a scene that names no file of its own.

    Raises
    ------
    DataError, ParameterError
        If it cannot be read, or names one.
    """
    scene = LinkScene(**read_yaml(path))
    if scene.simulation.network.kind == "file":
        raise DataError(f"{path}: names a file of nodes on a disk; list them as a network of kind 'placed' instead.")
    return scene


def estimates(run: SceneRun) -> dict[str, Array]:
    """Return how far pairs of a person and a track within the gate are apart by each estimator, ``(M,)`` [m].

    Head, smoothing and particle filter of tracks by heads (tables 3.8 and 3.9); else the track alone.
    """
    found: dict[str, list[float]] = {}
    if run.truth is None:
        return {}
    true = run.truth.at([step.time_s for step in run.steps])
    for number, step in enumerate(run.steps):
        there = true[number][np.isfinite(true[number, :, 0])]
        for one in step.tracks:
            apart = np.hypot(*(there - one.mean[[X, Y]]).T)
            if one.status == "deleted" or not (apart <= CUTOFF_M).any():
                continue
            place, places = there[apart.argmin()], {"track": one.mean[[X, Y]]}
            if isinstance(step.state, ImageState):
                head = np.array(step.state.people.living[one.track].position)
                smoothed, particles = places["track"], run.particles[number][one.track].mean[[X, Y]]
                places = {"head": head, "smoothing": smoothed, "particle filter": particles}
            for name, estimate in places.items():
                found.setdefault(name, []).append(float(np.hypot(*(estimate - place))))
    return {name: np.array(values) for name, values in found.items()}


def _histogram(apart: Array) -> list[int]:
    """Count what is in each bin; the last holds all beyond."""
    counts: list[int] = np.bincount(np.minimum((apart / BIN_M).astype(np.int64), len(EDGES) - 1), minlength=20).tolist()
    return counts
