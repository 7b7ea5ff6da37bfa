"""What a page gives away of its runs: recording and settings as one archive, tracks and settings one by one; tables."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path
from typing import NamedTuple

from nicegui import ui

from elusive.workbench.jobs import away
from elusive.workbench.parts import errors_shown


class Export(NamedTuple):
    """One run's files, made when they are asked for."""

    name: str
    tracks: Callable[[], str | bytes]  # CSV
    settings: Callable[[], str]  # YAML
    report: Callable[[Path], None] | None = None  # writes HTML


def export_buttons(archive_name: str, archive: Callable[[], bytes], each: Sequence[Export], again: str) -> None:
    """Build the buttons that download the runs, and say which command repeats the first of them."""

    async def give_archive() -> None:
        with errors_shown():
            ui.download.content(await away(archive), archive_name)

    with ui.element("div").classes("ew-row"):
        ui.button("Recording and settings (ZIP)", on_click=give_archive).props("unelevated no-caps")
        for one in each:
            ui.button(
                f"{one.name}: tracks as CSV",
                on_click=lambda one=one: ui.download.content(one.tracks(), f"tracks-{one.name}.csv"),
            ).props("flat no-caps")
            ui.button(
                f"{one.name}: settings as YAML",
                on_click=lambda one=one: ui.download.content(one.settings(), f"config-{one.name}.yaml"),
            ).props("flat no-caps")
            if one.report is not None:
                give = partial(give_made, partial(written, one.report), f"report-{one.name}.html")
                ui.button(f"{one.name}: report (HTML)", on_click=give).props("flat no-caps")
    if again:
        show_command("The same without a browser, from the ZIP:", again)


def show_command(words: str, command: str) -> None:
    """Build a command to be copied, letter by letter, under what it is for."""
    with ui.element("p").classes("ew-note"):
        ui.label(words)
        parts = "".join(f"<span>{escape(word)}</span> " for word in command.split(" "))  # an option is not cut in two
        ui.html(parts, sanitize=False).classes("ew-code")


async def give_made(make: Callable[[], bytes], name: str) -> None:
    """Download what is made now, off the event loop."""
    with errors_shown():
        ui.download.content(await away(make), name)


def written(write: Callable[[Path], None], name: str = "report.html") -> bytes:
    """Return what is written to a path of that name."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()


def table_html(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Write a table; its first column is its heads."""
    heads = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in header)
    body = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>{"".join(f"<td>{escape(cell)}</td>" for cell in row[1:])}</tr>'
        for row in rows
    )
    return f'<table class="ew-table"><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>'
