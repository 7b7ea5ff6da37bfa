"""`elusive simulate radar`, and a scene of ships near a coast."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.terminal import Config, bar, console, show
from elusive.io.routes import read_route
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.radar.scene import RadarScene
from elusive.systems.radar.scene_run import HEADER, track_radar_scene
from elusive.systems.radar.simulate import RadarSimulation, simulate_radar


@accepts(RadarSimulation)
def simulate_command(
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


def run_scene(scene: Path, given: dict[str, Any], out: Path) -> None:
    """Run a scene and say what came of it."""
    parameters = RadarScene(**given)
    total = len(parameters.voyage().times_s) * len(parameters.methods)
    with bar("scans", total) as advance:
        sailed = track_radar_scene(parameters, out, folder=scene.parent, on_scan=advance)
    show(scene.name, HEADER, [used.row for used in sailed.each if used.outcome is not None])
    for used in sailed.each:
        if used.refusal:
            console.print(f"{used.name}: {escape(used.refusal)}", highlight=False)
    console.print(
        f"Written to {out}: plots.csv, plots_truth.csv, scene.yaml, the chart, and for each use of it a folder",
        soft_wrap=True,
    )
