"""A report: one HTML file that asks nothing of the network, with verdict, tables and drawing; and one figure."""

from __future__ import annotations

import html
from collections.abc import Collection, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import NamedTuple

from elusive.checks import Finding, doubted
from elusive.io.atomic import atomic_path
from elusive.report.drawing import Drawing
from elusive.report.findings import findings_html
from elusive.report.packing import dumps
from elusive.report.picture import write_picture

SCRIPTS = ("base", "layers", "tracks", "axes", "panel", "events", "surface", "controls", "player")  # of any drawing
LIVE_SCRIPTS = (*SCRIPTS, "place", "live")  # of the workbench: what is placed, what goes on


def stored(name: str) -> str:
    """Return the text of a script, a style or the page's frame."""
    return files("elusive").joinpath("report", "static", name).read_text(encoding="utf-8")


class Report(NamedTuple):
    """What a run came to, as a page and as a figure."""

    title: str
    verdict: str  # what it came to, in a sentence
    drawing: Drawing
    rows: Sequence[tuple[str, str]] = ()  # of the table about the run, beneath the drawing
    findings: Sequence[Finding] = ()  # those that do not hold stand above all numbers
    tracks: str = ""  # their table, as :func:`track_table` gives it, above the drawing
    note: str = ""  # a sentence under that table
    figure: Drawing | None = None  # what the figure shows, where that is not the drawing

    def write(self, folder: Path) -> None:
        """Write ``report.html`` and ``report.png``."""
        self.write_page(folder / "report.html")
        self.write_figure(folder / "report.png")

    def write_figure(self, path: Path) -> None:
        """Write the drawing as a figure."""
        write_picture(path, self.figure or self.drawing, self.title, self.verdict)

    def write_page(self, path: Path) -> None:
        """Write the page, whole or not at all."""
        note = f'<p class="note">{html.escape(self.note)}</p>\n' if self.note and self.tracks else ""
        verdict = f'<p class="verdict">{html.escape(self.verdict)}</p>\n' if self.verdict else ""
        tracks = f'<div class="wide">{self.tracks}</div>\n{note}' if self.tracks else ""
        rows = doubted(self.rows, self.findings)
        page = Template(stored("report.html")).substitute(
            title=html.escape(self.title),
            before=findings_html(self.findings) + verdict + tracks,
            after=f'<table class="run">{_facts(rows)}</table>\n' if rows else "",
            style=stored("drawing.css") + stored("report.css"),
            # no "</script>" can end the script early
            data=dumps(self.drawing).replace("<", "\\u003c"),
            scripts="".join(stored(f"{name}.js") for name in (*SCRIPTS, "report")),
        )
        with atomic_path(path) as temporary:
            temporary.write_text(page, encoding="utf-8")


def _facts(rows: Sequence[tuple[str, str]]) -> str:
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)


def track_table(header: Sequence[str], lines: Sequence[Sequence[str]], drawn: Collection[str] = ()) -> str:
    """Return a table of tracks, a line each, or nothing; the number of one that is drawn is a button that leads to it.

    Parameters
    ----------
    header, lines
        Names of the columns; cells, the first of a line the track's number.
    drawn
        Numbers of those that are drawn.
    """
    if not lines:
        return ""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = ""
    for first, *others in lines:
        name = html.escape(first)
        button = f'<button type="button" data-track="{name}" title="Centre on it">{name}</button>'
        cells = "".join(f"<td>{html.escape(cell)}</td>" for cell in others)
        body += f"<tr><td>{button if first in drawn else name}</td>{cells}</tr>"
    return f"<table class='tracks'><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
