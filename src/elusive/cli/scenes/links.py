"""`elusive simulate links`, and a scene of people in a radio network."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show, tell_written
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.io.placed_files import read_area
from elusive.systems.links.recording import simulate_links
from elusive.systems.links.run import FILES
from elusive.systems.links.scene import LinkScene, track_scene
from elusive.systems.links.simulate import LinkSimulation

SCENE = LinkScene

TRACKED_WITH = (("", "log.csv"), ("--nodes", "nodes.csv"), ("--truth", "truth.csv"))  # of a simulated log


@accepts(LinkSimulation)
def simulate_command(
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
    parameters = parameters_of(LinkSimulation, given, config)
    if area is not None and area_file is not None:
        raise ParameterError("--area-file: --area is given too; give one of them.")
    if area is not None or area_file is not None:
        chosen = Area.rectangle(*area) if area is not None else read_area(cast(Path, area_file))
        parameters = parameters.replace(walks=parameters.walks.replace(area=chosen))
    with bar("frames", parameters.calibration_steps + parameters.walks.total_positions) as advance:
        simulated = simulate_links(parameters, out, on_frame=advance)
    show(out.name, ("", ""), simulated.rows)
    say(f"Written to {out}: log.csv, nodes.csv, truth.csv, coverage.csv, coverage.png, simulation.yaml")
    files = " ".join(f"{option} {shlex.quote(str(out / name))}" for option, name in TRACKED_WITH)
    command = f"elusive track links {files} --calibration-frames {parameters.calibration_steps} --out tracks"
    say(f"To track: {' '.join(command.split())}")


def run_scene(scene: Path, parameters: LinkScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    simulation = parameters.simulation
    with bar("frames", simulation.calibration_steps + simulation.walks.total_positions) as advance:
        outcome = track_scene(parameters, out, on_frame=advance)
    say(outcome.verdict)
    show(scene.name, ("", ""), outcome.tracked.rows)
    tell_written(out, (*FILES, "scene.yaml", "recording"), outcome.scored)
