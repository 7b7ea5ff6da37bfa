"""`elusive chart`: what is in electronic charts."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, say, show
from elusive.systems.radar.chart import ChartParameters, describe_charts


@accepts(ChartParameters)
def chart_command(
    charts: Annotated[list[Path], typer.Argument(help="S-57 base cells (.000), GeoJSON or shapefiles of land.")],
    given: dict[str, Any],
    config: Config = None,
    figure: Annotated[Path | None, typer.Option("--figure", help="PNG, PDF or SVG to draw them in.")] = None,
    water_probability: Annotated[
        Path | None,
        typer.Option("--water-probability", help="GeoTIFF (.tif) or netCDF (.nc) to write P(water) to, WGS 84."),
    ] = None,
) -> None:
    """Say what is in charts: layers, extent, edition, quality, and where they disagree."""
    parameters = parameters_of(ChartParameters, given, config)
    described = describe_charts(charts, parameters, figure, water_probability)
    for summary in described.summaries:
        show(summary.name, ("", ""), summary.rows)
    for sentence in (*(one.sentence for one in described.disagreements), *described.remarks):
        say(sentence)
    for written in (figure, water_probability):
        if written is not None:
            say(f"Written to {written}")
