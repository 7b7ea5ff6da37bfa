"""Window 4: every estimator's scores side by side, as the command tells them, and against the bound; export."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
from nicegui import ui

from elusive.report import drawing as draw
from elusive.report.plots import SERIES
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.page.track import archive
from elusive.systems.bearings.report.page import bearings_report
from elusive.systems.bearings.results import nees
from elusive.systems.bearings.scene import Estimated, Flown
from elusive.workbench.exports import Export, export_buttons, table_html
from elusive.workbench.parts import Drawing
from elusive.workbench.side_by_side import changed

COMMAND = "elusive scene scene.yaml --out results"
WANTED_NEES = 2.0  # of two coordinates whose deviations are right


def measure_window(state: BearingsState) -> None:
    """Build the window."""
    with ui.element("section").classes("ew-box w-full"), ui.column().classes("w-full gap-3"):
        if state.run is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
        changed(state)
        _tables(state.run)
        _charts(state.run)
        _exports(state.run)


def _tables(flown: Flown) -> None:
    with ui.element("div").classes("ew-row"):
        for used in flown.each:
            if used.outcome is not None:
                with ui.column().classes("gap-0 pr-8"):
                    ui.label(f"RMSE, {used.name}").classes("ew-section")
                    ui.label(f"{used.rmse:.2f} m").classes("ew-score").props(f'data-rmse="{used.name}"')
    for used in flown.each:
        if used.refusal:
            ui.label(used.refusal).classes("ew-fault")
    with ui.element("div").classes("ew-scroll"):
        ui.html(table_html(*flown.table), sanitize=False)
    if flown.bounds is not None:
        ui.label(
            "The bound is of whoever knows the motion, its noise, and which bearings are strays (Tichavsky et al., "
            "1998); on a single path, which a motion's noise would hardly have drawn, an estimator can fall below it."
        ).classes("ew-note")


def _charts(flown: Flown) -> None:
    times = [heard.time_s for heard in flown.sets]
    errors, squares = [], []
    for number, (name, outcome) in enumerate(flown.shown):
        colour = SERIES[number % len(SERIES)]
        assert outcome.tracked.error is not None
        error = np.where(outcome.tracked.known, outcome.tracked.error, math.nan)
        errors.append(draw.line(times, error, colour, 4, name=name))
        squares.append(draw.line(times, nees(outcome.tracked), colour, 4, name=name))
    known = np.array([value for layer in errors for value in layer["y"] if value is not None] or [1.0])
    most = 1.1 * float(np.quantile(known, 0.98))
    if flown.bounds is not None:
        for kind, bound in (("filtered", flown.bounds.filter_m), ("smoothed", flown.bounds.smoother_m)):
            errors.append(draw.line(times, bound, "--soft", 4, dash=[5, 4], name=f"bound, {kind}"))
    squares.append(draw.line([times[0], times[-1]], [WANTED_NEES] * 2, "--soft", dash=[5, 4], name="2, if right"))
    far = draw.chart("How far off?", times, errors, axis="error", unit="m", reach=(0.0, most))
    unit, title = "deviations²", "Are the deviations right? NEES"
    right = draw.chart(title, times, squares, axis="squared error", unit=unit, reach=(0.0, 15.0))
    Drawing(draw.drawing("Errors and their squares in deviations, by estimator", times, [far, right]))


def _write_page(used: Estimated, path: Path) -> None:
    assert used.outcome is not None
    bearings_report(used.outcome.tracked, used.outcome.findings).write_page(path)


def _exports(flown: Flown) -> None:
    each = [
        Export(
            used.name,
            used.outcome.log.csv_text,
            used.parameters.to_yaml,
            partial(_write_page, used),
        )
        for used in flown.each
        if used.outcome is not None
    ]
    export_buttons("bearings.zip", partial(archive, flown.scene), each, COMMAND)
