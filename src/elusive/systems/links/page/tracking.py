"""Window 5: the eight stages of tracking, played in step.

Mendieta (2017), section 5.6.
"""

from __future__ import annotations

from nicegui import ui

from elusive.systems.links.page.state import LinksState
from elusive.workbench.parts import Drawing


def tracking_window(state: LinksState) -> None:
    """Build the window."""
    with ui.element("section").classes("ew-box w-full"):
        if state.tracking_spec is None:
            ui.label("Nothing is tracked yet: press Apply under Algorithm.").classes("ew-note")
        else:
            Drawing(state.tracking_spec)
