"""Window 5: every use of the chart side by side: error, lost, map left out, time; export."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

from nicegui import ui

from elusive.report.drawing import drawing
from elusive.systems.radar.page.panels import errors_chart
from elusive.systems.radar.page.state import ChartsState
from elusive.systems.radar.report import radar_report
from elusive.systems.radar.scene_run import HEADER, Used, archive
from elusive.workbench.exports import Export, export_buttons, table_html
from elusive.workbench.parts import Drawing
from elusive.workbench.side_by_side import changed


def compare_window(state: ChartsState) -> None:
    """Build the window."""
    sailed = state.run
    with ui.element("section").classes("ew-box w-full"), ui.column().classes("w-full gap-3"):
        if sailed is None or state.chart is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
        shown = [one for one in sailed.each if one.outcome is not None]
        changed(state)
        with ui.element("div").classes("ew-row"):
            for one in shown:
                with ui.column().classes("gap-0 pr-8"):
                    ui.label(f"RMSE, {one.name}").classes("ew-section")
                    ui.label(_metres(one.rmse_m)).classes("ew-score").props(f'data-rmse="{one.name}"')
        for one in sailed.each:
            if one.refusal:
                ui.label(f"{one.name}: {one.refusal}").classes("ew-fault")
        with ui.element("div").classes("ew-scroll"):
            ui.html(
                table_html([*HEADER, "Time [s]"], [(*one.row, f"{one.seconds:.2f}") for one in shown]), sanitize=False
            )
        ui.label(
            "RMSE where a track is confirmed. Lost: ten scans in a row or more in which no confirmed track's own 99.9 "
            "% region holds the ship. One voyage tells little of a few tenths of a metre: change the seed."
        ).classes("ew-note")
        Drawing(drawing("Error of each use of the chart over time", sailed.times_s, [errors_chart(sailed)]))
        _exports(state, shown)
        for one in shown:
            _told_by(one)


def _metres(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.1f} m"


def _told_by(one: Used) -> None:
    assert one.outcome is not None
    tracked = one.outcome.tracked
    with ui.expansion(f"What the command says: {one.name}").props("dense").classes("w-full"):
        ui.label(tracked.verdict)
        with ui.element("div").classes("ew-scroll"):
            if tracked.tracks:
                ui.html(table_html(list(tracked.header), [tuple(line) for line in tracked.tracks]), sanitize=False)
            ui.html(table_html(["", one.name], [tuple(row) for row in tracked.rows]), sanitize=False)


def _exports(state: ChartsState, shown: list[Used]) -> None:
    assert state.chart is not None
    assert state.run is not None
    scene, chart = state.run.scene, state.chart.file
    each = [
        Export(one.name, partial(tracks_csv, one), one.parameters.to_yaml, partial(write_report, one)) for one in shown
    ]
    again = command(state, shown[0].name) if shown else ""
    export_buttons("charts.zip", lambda: archive(scene, chart), each, again)


def command(state: ChartsState, method: str) -> str:
    """Return what repeats one use of the chart from the archive."""
    assert state.chart is not None
    assert state.run is not None
    radar = state.run.scene.radar
    return (
        f"elusive track radar plots.csv --radar-lat-deg {radar.lat_deg!r} --radar-lon-deg {radar.lon_deg!r} --chart "
        f"'{state.chart.file.name}' --truth truth.csv --config config-{method}.yaml --out results"
    )


def write_report(one: Used, path: Path) -> None:
    """Write the report that the command writes."""
    assert one.outcome is not None
    radar_report(one.outcome.tracked, one.outcome.findings).write_page(path)


def tracks_csv(one: Used) -> bytes:
    """Return the tracks as the command writes them."""
    assert one.outcome is not None
    return one.outcome.log.csv_text().encode()
