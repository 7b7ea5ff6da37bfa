"""`elusive track`: find and track what is in a recording."""

from __future__ import annotations

import typer

from elusive.cli.lazy import lazy

COMMANDS = {
    "images": "elusive.cli.images:track_images_command",
    "signal": "elusive.cli.signals:track_signal_command",
    "radar": "elusive.cli.radar:track_radar_command",
    "links": "elusive.cli.links:track_links_command",
    "bearings": "elusive.cli.bearings:track_bearings_command",
}

app = typer.Typer(cls=lazy(COMMANDS), no_args_is_help=True)


@app.callback()
def _root() -> None:
    """Find and track what is in a recording."""
