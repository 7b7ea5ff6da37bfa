"""`elusive workbench`: the web interface."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elusive.errors import DataError
from elusive.systems.registry import SYSTEMS


def workbench_command(
    folder: Annotated[
        Path, typer.Option("--folder", help="The one folder that the pages read from and write to; made if need be.")
    ] = Path("workbench"),
    host: Annotated[
        str, typer.Option("--host", help="Address to listen at; any but this machine's own asks for a token.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", help="Port to listen at.")] = 8765,
    browser: Annotated[bool, typer.Option(help="Open a browser.")] = True,
) -> None:
    """Draw scenes, place sensors, tune, watch and measure, in a browser."""
    try:
        from elusive.workbench.asking import Recording
        from elusive.workbench.server import serve
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "nicegui":
            raise
        raise DataError("workbench: needs NiceGUI; install it: pip install 'elusive[workbench]'.") from None
    scenes = [
        Recording(f"{system.name} scene", "a scene", f"elusive.cli.scenes.{system.name}:SCENE", system.tries, True)
        for system in SYSTEMS
    ]
    recordings = [
        Recording(
            system.noun,
            system.recording,
            f"elusive.cli.{system.name}:track_{system.name}_command",
            system.tries,
            look=system.look,
        )
        for system in SYSTEMS
    ]
    pages = [system.page for system in SYSTEMS]
    serve(folder, pages, [*recordings, *scenes], host=host, port=port, show=browser)
