"""`elusive locate`: the place of an emitter that stands still, from bearings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.bearings import HEARD, SENSORS
from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Strict, console, say, show, tell_findings
from elusive.errors import ParameterError
from elusive.io.bearings import open_bearings
from elusive.io.sensor_files import read_sensors
from elusive.systems.bearings.locate import EmitterLocation, locate_recording


@accepts(EmitterLocation)
def locate_command(
    bearings: Annotated[str, typer.Argument(help=f"What is heard: .csv of {HEARD}")],
    given: dict[str, Any],
    sensors: Annotated[Path | None, typer.Option("--sensors", help=SENSORS)] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for emitter.csv, emitter.geojson, emitter.png.")
    ] = None,
    config: Config = None,
    confidence: Annotated[
        float, typer.Option(help="Probability that the ellipse holds the emitter.", min=0.01, max=0.9999)
    ] = 0.95,
    origin_lat: Annotated[
        float | None,
        typer.Option("--origin-lat-deg", help="Latitude of the sensors' (0, 0): GeoJSON is geographic."),
    ] = None,
    origin_lon: Annotated[float | None, typer.Option("--origin-lon-deg", help="Its longitude.")] = None,
    strict: Strict = False,
) -> None:
    """Locate an emitter that stands still."""
    parameters = parameters_of(EmitterLocation, given, config)
    if (origin_lat is None) != (origin_lon is None):
        raise ParameterError("--origin-lat-deg, --origin-lon-deg: one is missing; give both or none.")
    origin = None if origin_lat is None or origin_lon is None else (origin_lon, origin_lat)
    source = open_bearings(bearings, None if sensors is None else read_sensors(sensors))
    located = locate_recording(source, parameters, out, confidence=confidence, origin_deg=origin)
    for remark in located.remarks:
        console.print(f"[yellow]{escape(remark)}[/]", highlight=False, soft_wrap=True)
    show("Emitter", ("", ""), located.table)
    if out is not None:
        say(f"Written to {out}: emitter.csv, emitter.geojson, emitter.png, checks.json, config.yaml")
    tell_findings(located.findings, strict=strict)
