"""`elusive simulate`: recordings to try a tracker on, with their truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.terminal import Config, bar, console, show
from elusive.io.routes import read_route
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.pipelines.radar_simulation import RadarSimulation, simulate_radar

app = typer.Typer(no_args_is_help=True, help="Make a recording to try a tracker on, and its truth.")


@app.callback()
def _root() -> None:
    """Make a recording to try a tracker on, and its truth."""


@app.command("radar")
@accepts(RadarSimulation)
def simulate_radar_command(
    route: Annotated[
        Path, typer.Option("--route", help="Waypoints: .csv of lon_deg, lat_deg, perhaps speed_mps; or a GeoJSON line.")
    ],
    radar_lat: Annotated[float, typer.Option("--radar-lat", help="Latitude of the radar, WGS 84, in degrees.")],
    radar_lon: Annotated[float, typer.Option("--radar-lon", help="Longitude of the radar, WGS 84, in degrees.")],
    out: Annotated[Path, typer.Option("--out", help="CSV of the plots; the truth is written beside it.")],
    given: dict[str, Any],
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="Chart to compare the route with; give it again for more."),
    ] = None,
    config: Config = None,
) -> None:
    """Sail a route near a coast and write what a radar sees of it."""
    parameters = RadarSimulation(**nested(RadarSimulation, given, read_yaml(config) if config else {}))
    with bar("scans", None) as advance:
        simulated = simulate_radar(
            read_route(route), parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat,
            charts=chart or (), on_scan=advance,
        )  # fmt: skip
    show(out.name, ("", ""), simulated.rows)
    console.print(f"Written to {out}, the truth to {simulated.truth}")
