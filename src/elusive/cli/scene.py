"""`elusive scene`: run again what was exported from the workbench."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from elusive.cli.terminal import Out
from elusive.errors import DataError
from elusive.model import read_yaml
from elusive.systems.registry import SYSTEMS


def scene_command(
    scene: Annotated[Path, typer.Argument(help="Scene that the workbench has exported: .yaml.")], out: Out
) -> None:
    """Run a scene that the workbench has exported: the same numbers, without a browser."""
    given = read_yaml(scene)
    system = given.get("system", "links")
    known = [system.name for system in SYSTEMS]
    if system not in known:
        raise DataError(f"{scene}: is a scene of system {system!r:.40}; known are {', '.join(known)}.")
    scenes = import_module(f"elusive.cli.scenes.{system}")
    scenes.run_scene(scene, scenes.SCENE(**given), out)
