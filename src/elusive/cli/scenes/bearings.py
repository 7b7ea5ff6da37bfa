"""`elusive simulate bearings`, and a scene of emitters heard at a few places."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show
from elusive.geometry.places import NamedPlace
from elusive.io.routes import read_way
from elusive.io.sensor_files import read_sensors
from elusive.systems.bearings.scene import BearingScene, track_bearing_scene
from elusive.systems.bearings.simulate import BearingSimulation, simulate_bearings

SCENE = BearingScene


@accepts(BearingSimulation)
def simulate_command(
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    place: Annotated[
        Path | None, typer.Option("--sensors", help="Where the sensors stand: .csv of sensor, x_m, y_m.")
    ] = None,
    path: Annotated[
        list[Path] | None,
        typer.Option("--path", help="Corners of an emitter's path: .csv of x_m, y_m. One or several."),
    ] = None,
) -> None:
    """Fly emitters past sensors; write the bearings, without labels, and where each was."""
    parameters = parameters_of(BearingSimulation, given, config)
    if place is not None:
        sites = read_sensors(place)
        rows = zip(sites.names, sites.positions_m[:, :2].tolist(), strict=True)
        parameters = parameters.replace(sites=tuple(NamedPlace(name=name, x_m=x, y_m=y) for name, (x, y) in rows))
    if path:
        parameters = parameters.replace(ways_m=tuple(tuple(map(tuple, read_way(file).tolist())) for file in path))
    files = simulate_bearings(parameters, out)
    names = ", ".join(file.name for file in files)
    say(f"Written to {out}: {names}, simulation.yaml")
    bearings, sensors, truth = (shlex.quote(str(file)) for file in files)
    command = f"elusive track bearings {bearings} --sensors {sensors} --truth {truth}"
    say(f"To track: {command} --sigma-deg {parameters.sensors.sigma_deg:g} --out tracks")


def run_scene(scene: Path, parameters: BearingScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    with bar("estimators", len(parameters.estimators)) as advance:
        flown = track_bearing_scene(parameters, out, on_estimator=advance)
    show(scene.name, *flown.table)
    for used in flown.each:
        if used.refusal:
            say(f"{used.name}: {used.refusal}")
    say(f"Written to {out}: bearings.csv, sensors.csv, truth.csv, scene.yaml, and for each estimator a folder")
