"""Window 4: every estimator's scores side by side, as the command tells them, and against the bound; export."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from elusive.contracts import Array
from elusive.io.csv_files import csv_text
from elusive.io.tracks import cells_of, columns
from elusive.systems.bearings.page.run import SMOOTHERS, Estimated, Flown, archive, nees
from elusive.systems.bearings.page.state import BearingsState
from elusive.workbench.exports import Export, export_buttons, table_html
from elusive.workbench.parts import Drawing

COMMAND = (
    "elusive track bearings bearings.csv --sensors sensors.csv --truth truth.csv --config config-{}.yaml --out results"
)
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
    shown = [one for one in flown.each if one.outcome is not None]
    with ui.element("div").classes("ew-row"):
        for one in shown:
            with ui.column().classes("gap-0 pr-8"):
                ui.label(f"RMSE, {one.name}").classes("ew-section")
                ui.label(f"{rmse(one):.2f} m").classes("ew-score").props(f'data-rmse="{one.name}"')
    for one in flown.each:
        if one.refusal:
            ui.label(one.refusal).classes("ew-fault")
    names: list[str] = []
    tables = {one.name: dict(one.outcome.table) for one in shown if one.outcome is not None}
    for table in tables.values():
        names += [name for name in table if name not in names]
    rows = [(name, *(table.get(name, "") for table in tables.values())) for name in names]
    if flown.bounds is not None:
        least = dict(zip((False, True), flown.bounds.whole, strict=True))
        rows.append(
            (
                "Bound on this path",
                *(f"{least[one.name in SMOOTHERS]:.2f} m {_kind(one.name)}" for one in shown),
            )
        )
    rows.append(("Time", *(f"{one.seconds:.2f} s" for one in shown)))
    with ui.element("div").classes("ew-scroll"):
        ui.html(table_html(["", *tables], rows), sanitize=False)
    if flown.bounds is not None:
        ui.label(
            "The bound is of whoever knows the motion, its noise, and which bearings are strays (Tichavsky et al., "
            "1998); on a single path, which a motion's noise would hardly have drawn, an estimator can fall below it."
        ).classes("ew-note")


def _kind(name: str) -> str:
    return "(smoothed)" if name in SMOOTHERS else "(filtered)"


def rmse(one: Estimated) -> float:
    """Root mean square error where a place is told [m], as the command has it."""
    assert one.outcome is not None
    error = one.outcome.tracked.error
    assert error is not None
    return math.sqrt(float(np.nanmean(error[one.outcome.tracked.told] ** 2)))


def _charts(flown: Flown) -> None:
    times = [one.time_s for one in flown.sets]
    errors: list[dict[str, Any]] = []
    squares: list[dict[str, Any]] = []
    for one in flown.each:
        if one.outcome is None or one.outcome.tracked.error is None:
            continue
        error = np.where(one.outcome.tracked.told, one.outcome.tracked.error, math.nan)
        errors.append({"name": one.name, "x": times, "y": _listed(error)})
        squares.append({"name": one.name, "x": times, "y": _listed(nees(one.outcome, flown.truth))})
    if flown.bounds is not None:
        for name, bound in (("bound, filtered", flown.bounds.filter_m), ("bound, smoothed", flown.bounds.smoother_m)):
            errors.append({"name": name, "x": times, "y": _listed(bound), "dashed": True})
    squares.append({"name": "2, if right", "x": [times[0], times[-1]], "y": [WANTED_NEES] * 2, "dashed": True})
    known = np.concatenate([np.array(one["y"], np.float64) for one in errors[: len(squares) - 1]] or [np.ones(1)])
    most = 1.1 * float(np.nanquantile(known, 0.98)) if np.isfinite(known).any() else 1.0
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
    scene, shown = flown.scene, [one for one in flown.each if one.outcome is not None]
    each = [Export(one.name, partial(tracks_csv, one), one.parameters.to_yaml) for one in shown]
    again = COMMAND.format(shown[0].name) if shown else ""
    export_buttons("bearings.zip", lambda: archive(scene), each, again)


def tracks_csv(one: Estimated) -> str:
    """Return the track as the command writes it."""
    assert one.outcome is not None
    names = columns("m")
    return csv_text(names, (cells_of(row)[: len(names)] for row in one.outcome.rows))
