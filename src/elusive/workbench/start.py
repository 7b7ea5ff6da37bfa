"""The start page: one card a system, each with an example that runs in one click."""

from __future__ import annotations

import secrets

from nicegui import ui

from elusive.workbench.shell import OWN, head, main, pages

LEAD = (
    "Draw a scene, place sensors, tune, watch and measure. Each card opens one system; its example runs at once, and "
    "everything in it can then be changed."
)


def start_page() -> None:
    """Build the page."""
    head("/")
    with main("What shall be tracked?", LEAD), ui.element("div").classes("ew-cards"):
        with ui.element("article").classes("ew-card"):
            ui.html(f"<h2>{OWN[1]}</h2>", sanitize=False)
            ui.html(
                "<p>Frames, a radio network's log, a signal, a radar's plots or video, bearings: choose the files, "
                "press Run, and see the report. Runs are kept and compared.</p>", sanitize=False,
            ).classes("ew-grow")  # fmt: skip
            with ui.element("div").classes("ew-row"):
                ui.button("Open a recording", on_click=lambda: ui.navigate.to(OWN[0])).props("unelevated no-caps")
        for page in pages():
            with ui.element("article").classes("ew-card"):
                ui.html(f"<h2>{page.title}</h2>", sanitize=False)
                ui.html(f"<p>{page.summary}</p>", sanitize=False)
                ui.html(f"<p><b>Example:</b> {page.example}</p>", sanitize=False).classes("ew-grow")
                with ui.element("div").classes("ew-row"):
                    ui.button(
                        "Run the example",
                        on_click=lambda path=page.path: ui.navigate.to(f"{path}?example={secrets.token_hex(4)}"),
                    ).props(f'unelevated no-caps aria-label="Run the example: {page.title}"')
                    ui.button("Open", on_click=lambda path=page.path: ui.navigate.to(path)).props(
                        f'flat no-caps aria-label="Open {page.title}"'
                    )
