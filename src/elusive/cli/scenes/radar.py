"""`elusive simulate radar`, and a scene of ships near a coast."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show
from elusive.geometry.local_frame import LocalFrame
from elusive.io.routes import read_route
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.scene import RadarScene
from elusive.systems.radar.scene_run import HEADER, track_radar_scene
from elusive.systems.radar.simulate import MID_OCEAN_DEG, RadarSimulation, simulate_radar
from elusive.systems.radar.voyage import crossing_routes

SCENE = RadarScene

# of the simulated radar, what the tracker is told


@accepts(RadarSimulation)
def simulate_command(
    out: Out,
    given: dict[str, Any],
    route: Annotated[
        list[Path] | None,
        typer.Option(
            "--route",
            help="Waypoints of a ship: .csv of lon_deg, lat_deg, perhaps speed_mps; or a GeoJSON line. One or several. "
            "\\[default: two ships that cross]",
        ),
    ] = None,
    radar_lat: Annotated[
        float, typer.Option("--radar-lat-deg", help="Latitude of the radar, WGS 84, in degrees.")
    ] = MID_OCEAN_DEG[1],
    radar_lon: Annotated[
        float, typer.Option("--radar-lon-deg", help="Longitude of the radar, WGS 84, in degrees.")
    ] = MID_OCEAN_DEG[0],
    chart: Annotated[
        list[Path] | None,
        typer.Option("--chart", help="Charts to compare the route with, one or several."),
    ] = None,
    own_route: Annotated[
        Path | None, typer.Option("--own-route", help="Waypoints of a ship that the radar stands on.")
    ] = None,
    config: Config = None,
) -> None:
    """Sail ships along routes near a coast and write what a radar sees of them."""
    parameters = parameters_of(RadarSimulation, given, config)
    frame = LocalFrame.at(radar_lon, radar_lat)
    routes = [read_route(path) for path in route] if route else crossing_routes(frame)
    with bar("scans", None) as advance:
        simulated = simulate_radar(
            routes, parameters, out, radar_lon_deg=radar_lon, radar_lat_deg=radar_lat,
            charts=chart or (), own_route=None if own_route is None else read_route(own_route), on_scan=advance,
        )  # fmt: skip
    show(out.name, ("", ""), simulated.rows)
    say(f"Written to {out}: {', '.join(simulated.files)}")
    plots, truth = (shlex.quote(str(out / name)) for name in simulated.files[:2])
    used = "".join(f" --chart {shlex.quote(str(path))}" for path in chart or ())
    doppler_sd = parameters.radar.doppler_sd_mps
    told = "" if doppler_sd == RecordedRadar().doppler_sd_mps else f" --doppler-sd-mps {doppler_sd:g}"
    place = f"--radar-lat-deg {radar_lat:g} --radar-lon-deg {radar_lon:g}"
    command = f"elusive track radar {plots} --truth {truth} {place}{used}{told}"
    say(f"To track: {command} --out tracks")


def run_scene(scene: Path, parameters: RadarScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    total = len(parameters.voyage().times_s) * len(parameters.methods)
    with bar("scans", total) as advance:
        sailed = track_radar_scene(parameters, out, folder=scene.parent, on_scan=advance)
    show(scene.name, HEADER, [used.row for used in sailed.each if used.outcome is not None])
    for used in sailed.each:
        if used.refusal:
            say(f"{used.name}: {used.refusal}")
    say(f"Written to {out}: plots.csv, truth.csv, scene.yaml, the chart, and for each use of it a folder")
