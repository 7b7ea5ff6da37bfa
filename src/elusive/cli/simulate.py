"""`elusive simulate`: recordings to try a tracker on, with their truth."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any, cast

import typer
from rich.markup import escape

from elusive.cli.bearings import simulate_bearings_command
from elusive.cli.terminal import Config, Out, bar, console, show
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.io.area_files import read_area
from elusive.io.routes import read_route
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.links.simulate import LinkSimulation, simulate_links
from elusive.systems.radar.simulate import RadarSimulation, simulate_radar

TRACKED_WITH = (("", "log.csv"), ("--nodes", "nodes.csv"), ("--truth", "truth.csv"))  # of a simulated log

app = typer.Typer(no_args_is_help=True)


app.command("bearings")(simulate_bearings_command)


@app.callback()
def _root() -> None:
    """Make a recording to try a tracker on, and its truth."""


@app.command("radar")
@accepts(RadarSimulation)
def simulate_radar_command(
    route: Annotated[
        list[Path],
        typer.Option(
            "--route",
            help="Waypoints of a ship: .csv of lon_deg, lat_deg, perhaps speed_mps; or a GeoJSON line. One or several.",
        ),
    ],
    radar_lat: Annotated[float, typer.Option("--radar-lat-deg", help="Latitude of the radar, WGS 84, in degrees.")],
    radar_lon: Annotated[float, typer.Option("--radar-lon-deg", help="Longitude of the radar, WGS 84, in degrees.")],
    out: Annotated[Path, typer.Option("--out", help="CSV of the plots; the truth is written beside it.")],
    given: dict[str, Any],
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="Charts to compare the route with, one or several."),
    ] = None,
    config: Config = None,
) -> None:
    """Sail ships along routes near a coast and write what a radar sees of them."""
    parameters = RadarSimulation(**nested(RadarSimulation, given, read_yaml(config) if config else {}))
    with bar("scans", None) as advance:
        simulated = simulate_radar(
            [read_route(path) for path in route], parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat,
            charts=chart or (), on_scan=advance,
        )  # fmt: skip
    show(out.name, ("", ""), simulated.rows)
    console.print(f"Written to {out}, the truth to {simulated.truth}")


@app.command("links")
@accepts(LinkSimulation)
def simulate_links_command(
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    area: Annotated[
        tuple[float, float, float, float] | None,
        typer.Option("--area", help="X0 X1 Y0 Y1: the rectangle they walk in \\[m]. \\[default: -12 12 -12 12]"),
    ] = None,
    area_file: Annotated[
        Path | None, typer.Option("--area-file", help="Polygon they walk in: a corner a line, x and y \\[m].")
    ] = None,
) -> None:
    """Let people walk through a radio network and write what it reads, and where they were."""
    parameters = LinkSimulation(**nested(LinkSimulation, given, read_yaml(config) if config else {}))
    if area is not None and area_file is not None:
        raise ParameterError("--area-file: --area is given too; give one of them.")
    if area is not None or area_file is not None:
        chosen = Area.rectangle(*area) if area is not None else read_area(cast(Path, area_file))
        parameters = parameters.replace(walks=parameters.walks.replace(area=chosen))
    with bar("frames", parameters.calibration_steps + parameters.walks.total_positions) as advance:
        simulated = simulate_links(parameters, out, on_frame=advance)
    show(out.name, ("", ""), simulated.rows)
    console.print(
        f"Written to {out}: log.csv, nodes.csv, truth.csv, coverage.csv, coverage.png, config.yaml", soft_wrap=True
    )
    files = " ".join(f"{option} {shlex.quote(str(out / name))}" for option, name in TRACKED_WITH)
    command = (
        f"elusive track links {files} --calibration-frames {parameters.calibration_steps} --method image --out tracks"
    )
    console.print(f"To track: {escape(' '.join(command.split()))}", highlight=False, soft_wrap=True)
