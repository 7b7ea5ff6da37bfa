"""The start page: what lies in the folder, the latest runs, a card a system with an example that runs at a click."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import quote

from nicegui import ui

from elusive.workbench.files import in_folder
from elusive.workbench.guessing import system_of
from elusive.workbench.kept_runs import Kept, is_result, kept_runs
from elusive.workbench.opener import sender
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import OWN, head, main, pages

RECENT = 4  # runs

LEAD = (
    "Draw a scene, place sensors, tune, watch and measure. Each card opens one system; its example runs at once, and "
    "everything in it can then be changed."
)


def start_page() -> None:
    """Build the page."""
    head("/")
    with main("What shall be tracked?", LEAD):
        _opening()
        with ui.element("div").classes("ew-cards"):
            with _card(OWN[0], OWN[1]):
                ui.html(
                    "<p>Frames, a radio network's log, a signal, a radar's plots or video, bearings, recorded or live: "
                    "choose the files, press Run, and see the report. Runs are kept and compared.</p>", sanitize=False,
                ).classes("ew-grow")  # fmt: skip
                with ui.element("div").classes("ew-row"):
                    _leading("Open a recording", OWN[0], "Open a recording", "unelevated")
            for page in pages():
                with _card(page.path, page.title):
                    ui.html(f"<p>{page.summary}</p>", sanitize=False)
                    ui.html(f"<p><b>Example:</b> {page.example}</p>", sanitize=False).classes("ew-grow")
                    with ui.element("div").classes("ew-row"):
                        example = f"{page.path}?example={secrets.token_hex(4)}"
                        _leading("Run the example", example, f"Run the example: {page.title}", "unelevated")
                        _leading("Open", page.path, f"Open {page.title}", "flat")


def _leading(words: str, address: str, name: str, look: str) -> None:
    """Build a button that leads to a page: a link, which the browser follows before the server hears this page, too."""
    ui.button(words).props(f'{look} no-caps href="{address}" aria-label="{name}"')


@contextmanager
def _card(path: str, title: str) -> Iterator[None]:
    with ui.element("article").classes("ew-card"):
        ui.html(f'<img src="/workbench{path}.svg" alt="" class="ew-picture"><h2>{title}</h2>', sanitize=False)
        yield


def _opening() -> None:
    """Build what opens anything in the folder, and the latest runs."""
    with ui.element("section").classes("ew-box w-full"), ui.element("div").classes("ew-row"):
        names = in_folder(SETTINGS.folder)
        ui.select(
            names, label="Open anything in the workbench's folder" if names else "The workbench's folder is empty",
            with_input=True, on_change=lambda event: ui.navigate.to(_address_of(event.value)),
        ).props('dense outlined options-dense data-field="anything"').classes("ew-anything")  # fmt: skip
        with ui.expansion("Send it from this computer").props("dense").classes("ew-anything"):
            sender(
                "Send a file to the workbench's folder, and open it",
                lambda name: ui.navigate.to(_address_of(name)), several=False,
            )  # fmt: skip
        runs = kept_runs(SETTINGS.folder)[:RECENT]
        if runs:
            ui.label("Latest runs:").classes("ew-note")
        for run in runs:
            ui.link(run.name, _address_of_run(run)).props(f'aria-label="Open {run.name}"')


def _address_of(file: str) -> str:
    """Return what opens a file of the folder: a scene on the page of its system, or the page of any recording."""
    path = SETTINGS.folder / file
    system, seen = system_of(path), is_result(path)
    here = next((page.path for page in pages() if page.system == system and (page.keeps_runs or not seen)), OWN[0])
    return f"{here}?file={quote(file)}&token={secrets.token_hex(4)}"


def _address_of_run(run: Kept) -> str:
    """Return what opens a run: of a scene, the page of its system."""
    for page in pages():
        if run.noun == f"{page.system} scene":
            return f"{page.path}?file={quote(run.name)}&token={secrets.token_hex(4)}"
    return f"{OWN[0]}?run={quote(run.name)}"
