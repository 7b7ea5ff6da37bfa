"""`elusive scene`: run again what was exported from the workbench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.terminal import Out, bar, console, show
from elusive.errors import DataError
from elusive.model import read_yaml
from elusive.systems.bearings.scene import BearingScene, track_bearing_scene
from elusive.systems.images.scene import ImageScene, track_image_scene
from elusive.systems.links.scene import LinkScene, track_scene
from elusive.systems.radar.scene import RadarScene
from elusive.systems.radar.scene_run import HEADER, track_radar_scene
from elusive.systems.signals.scene import SignalScene, track_signal_scene


def scene_command(
    scene: Annotated[Path, typer.Argument(help="Scene that the workbench has exported: .yaml.")], out: Out
) -> None:
    """Run a scene that the workbench has exported: the same numbers, without a browser."""
    given = read_yaml(scene)
    system = given.get("system", "links")
    if system not in SCENES:
        raise DataError(f"{scene}: is a scene of system {system!r:.40}; known are {', '.join(SCENES)}.")
    SCENES[system](scene, given, out)


def _links(scene: Path, given: dict[str, Any], out: Path) -> None:
    parameters = LinkScene(**given)
    simulation = parameters.simulation
    with bar("frames", simulation.calibration_steps + simulation.walks.total_positions) as advance:
        outcome = track_scene(parameters, out, on_frame=advance)
    console.print(escape(outcome.verdict), highlight=False)
    show(scene.name, ("", ""), outcome.table)
    console.print(
        f"Written to {out}: tracks.csv, events.csv, result.nc, report.html, report.png, scores.json, config.yaml, "
        "scene.yaml; the log in recording"
    )


def _images(scene: Path, given: dict[str, Any], out: Path) -> None:
    parameters = ImageScene(**given)
    with bar("frames", parameters.frames) as advance:
        outcome = track_image_scene(parameters, out, on_frame=advance)
    show(scene.name, ("", ""), outcome.tracked.rows)
    console.print(
        f"Written to {out}: tracks.csv, result.nc, report.html, report.png, frames.npy, truth.txt, scene.yaml"
    )


def _signals(scene: Path, given: dict[str, Any], out: Path) -> None:
    parameters = SignalScene(**given)
    with bar("frames", parameters.frames) as advance:
        tracked = track_signal_scene(parameters, out, on_frame=advance).tracked
    console.print(escape(tracked.verdict), highlight=False)
    show(scene.name, ("", ""), tracked.rows)
    console.print(f"Written to {out}: tracks.csv, result.nc, report.html, report.png, signal.npy, scene.yaml")


def _radar(scene: Path, given: dict[str, Any], out: Path) -> None:
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


def _bearings(scene: Path, given: dict[str, Any], out: Path) -> None:
    parameters = BearingScene(**given)
    with bar("estimators", len(parameters.estimators)) as advance:
        flown = track_bearing_scene(parameters, out, on_estimator=advance)
    show(scene.name, *flown.table)
    for used in flown.each:
        if used.refusal:
            console.print(f"{used.name}: {escape(used.refusal)}", highlight=False)
    console.print(
        f"Written to {out}: bearings.csv, sensors.csv, truth.csv, scene.yaml, and for each estimator a folder",
        soft_wrap=True,
    )


SCENES = {
    "links": _links,
    "images": _images,
    "signals": _signals,
    "radar": _radar,
    "bearings": _bearings,
}  # by the scene's key `system`
