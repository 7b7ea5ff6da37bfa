"""Window 4: every estimator's scores side by side, as the command tells them, and against the bound; export."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from elusive.contracts import Array
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.page.track import archive
from elusive.systems.bearings.results import nees
from elusive.systems.bearings.scene import Flown
from elusive.workbench.exports import Export, export_buttons, table_html
from elusive.workbench.parts import Drawing

COMMAND = "elusive scene scene.yaml --out results"
WANTED_NEES = 2.0  # of two coordinates whose deviations are right


def measure_window(state: BearingsState) -> None:
    """Build the window."""
    with ui.element("section").classes("ew-box w-full"), ui.column().classes("w-full gap-3"):
        if state.run is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
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
    errors: list[dict[str, Any]] = []
    squares: list[dict[str, Any]] = []
    for name, outcome in flown.shown:
        assert outcome.tracked.error is not None
        error = np.where(outcome.tracked.told, outcome.tracked.error, math.nan)
        errors.append({"name": name, "x": times, "y": _listed(error)})
        squares.append({"name": name, "x": times, "y": _listed(nees(outcome.tracked))})
    known = np.concatenate([np.array(series["y"], np.float64) for series in errors] or [np.ones(1)])
    most = 1.1 * float(np.nanquantile(known, 0.98)) if np.isfinite(known).any() else 1.0
    if flown.bounds is not None:
        for kind, bound in (("filtered", flown.bounds.filter_m), ("smoothed", flown.bounds.smoother_m)):
            errors.append({"name": f"bound, {kind}", "x": times, "y": _listed(bound), "dashed": True})
    squares.append({"name": "2, if right", "x": [times[0], times[-1]], "y": [WANTED_NEES] * 2, "dashed": True})
    with ui.element("div").classes("ew-cards").style("grid-template-columns: repeat(auto-fit, minmax(360px, 1fr))"):
        for title, series, label, limit in (
            ("How far off?", errors, "error [m]", most),
            ("Are the deviations right? NEES", squares, "squared error [deviations²]", 15.0),
        ):
            with ui.element("div"):
                ui.label(title).classes("ew-section")
                Drawing("chart", {
                    "label": title, "series": series, "xlabel": "time [s]", "ylabel": label, "ylim": [0, limit],
                })  # fmt: skip


def _listed(values: Array) -> list[float | None]:
    return [None if not math.isfinite(value) else round(value, 4) for value in values.tolist()]


def _exports(flown: Flown) -> None:
    each = [
        Export(used.name, used.outcome.log.csv_text, used.parameters.to_yaml)
        for used in flown.each
        if used.outcome is not None
    ]
    export_buttons("bearings.zip", partial(archive, flown.scene), each, COMMAND)
