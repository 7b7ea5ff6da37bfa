"""The window of one system: inputs, Run and Cancel on the left; what was found, scores and files on the right.

Two runs are compared by keeping one: its curves and its scores stay beside those of the next.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from elusive.report import drawing as draw
from elusive.report.findings import findings_html
from elusive.workbench.exports import give_made
from elusive.workbench.form import Form, FormTools, are_right
from elusive.workbench.parts import Changed, Drawing
from elusive.workbench.run_bar import RunBar
from elusive.workbench.runs import BenchState, File, LiveJob, Run, beside, table
from elusive.workbench.shell import OWN, window


class Bench:
    """The window of one page.

    Parameters
    ----------
    state
        What the tab holds.
    inputs
        Builds what is set; gives the forms in it, which must be right before a run.
    work
        Runs a scene; it is done off the event loop.
    live
        Title and label of the curve shown while it runs.
    """

    def __init__(
        self,
        state: BenchState[Any],
        inputs: Callable[[], Callable[[], Sequence[Form]]],
        work: Callable[[Any, LiveJob], Run],
        live: tuple[str, str],
    ) -> None:
        self._state, self._work, self._title = state, work, live
        self._shown: Run | None = None
        with window() as (side, stage):
            with side:
                self._bar = RunBar(state, self.run)
                FormTools(lambda: self._forms())
                self._forms = inputs()
                ui.link("Track a recording of your own", OWN[0]).classes("ew-note")
            with stage:
                self._live = ui.column().classes("w-full gap-1")
                self._result = ui.column().classes("w-full gap-3")
        with self._live:
            self._chart = Drawing(self._so_far()).classes("ew-live")
        self._timer = ui.timer(0.15, self._watch)
        self._show()

    async def run(self) -> bool:
        """Run what is set; False if it was refused or called off."""
        if self._state.job is not None or not are_right(self._forms()):
            return False
        scene = self._state.scene
        found = await self._bar.run(LiveJob(), lambda: partial(self._work, scene))
        if found is not None:
            self._state.run, self._state.ran = found, scene
        self._show()
        return found is not None

    def keep(self) -> None:
        """Keep this run beside the next."""
        self._state.kept = self._state.run
        self._show()

    def _watch(self) -> None:
        job = self._state.job
        if job is not None:
            self._busy()
            of = f" of {job.total}" if job.total else ""
            words = f"{job.done}{of} frames done" if job.done else "preparing"
            self._bar.tell(words, job.done / job.total if job.total else 0.0)
            self._chart.show(self._so_far())
        elif self._shown is not self._state.run:  # started before this page was loaded anew
            self._bar.tell("")
            self._show()

    def _busy(self) -> None:
        self._bar.show()
        self._live.visible = self._state.job is not None

    def _so_far(self) -> draw.Drawing:
        job, (title, label) = self._state.job, self._title
        values = np.array([] if job is None else job.values, np.float64)
        most = max(2, (job.total if job is not None and job.total else len(values)) - 1)
        top = 1.05 * max([1.0, *values[np.isfinite(values)].tolist()])
        line = draw.line(np.arange(len(values)), values, "--accent")
        panel = draw.graph(title, (0, most, 0, top), [line], "frame", label, span=12)
        return draw.drawing(f"{title}, as it is computed", [0.0], [panel], unit="frame")

    def _show(self) -> None:
        state = self._state
        self._busy()
        self._shown = state.run
        self._result.clear()
        with self._result:
            if state.run is None:
                ui.label("Nothing has run yet: press Run.").classes("ew-note")
                return
            Changed(lambda: state.ran, lambda: state.scene)
            Drawing(beside(state.run, state.kept))
            self._scores(state.run, state.kept)
            ui.html(findings_html(state.run.findings), sanitize=False)
            with ui.element("div").classes("ew-row"):
                for file in state.run.files:
                    ui.button(file.label, on_click=partial(_give, file)).props("outline no-caps")
            with ui.element("p").classes("ew-note"):
                ui.label("The same without a browser:")
                ui.html(f"<code>{html.escape(state.run.again)}</code>", sanitize=False)

    def _scores(self, run: Run, kept: Run | None) -> None:
        runs = [("This run", run), *([("Kept run", kept)] if kept is not None else [])]
        with ui.element("div").classes("ew-row"):
            for title, one in runs:
                with ui.column().classes("gap-0 pr-8"):
                    ui.label(f"{one.headline[0]}, {title.lower()}").classes("ew-section")
                    ui.label(one.headline[1]).classes("ew-score").props(f'data-score="{title}"')
        with ui.element("div").classes("ew-row"):
            ui.button("Keep this run to compare", on_click=self.keep).props("outline no-caps")
            if kept is not None:
                ui.button("Forget the kept run", on_click=self._forget).props("flat no-caps")
        with ui.element("div").classes("ew-scroll"):
            ui.html(table(["", *(f"{title}: {one.name}" for title, one in runs)], [one.rows for _, one in runs]),
                    sanitize=False)  # fmt: skip

    def _forget(self) -> None:
        self._state.kept = None
        self._show()


async def _give(file: File) -> None:
    if isinstance(file.data, bytes):
        ui.download.content(file.data, file.name)
    else:
        await give_made(file.data, file.name)
