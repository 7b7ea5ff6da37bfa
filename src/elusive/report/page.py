"""The page of a report: one HTML file that asks nothing of the network: verdict, tables, drawing."""

from __future__ import annotations

import html
from collections.abc import Collection, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template

from elusive.checks import Finding, doubted
from elusive.io.atomic import atomic_path
from elusive.report.drawing import Drawing
from elusive.report.findings import findings_html
from elusive.report.packing import dumps

SCRIPTS = ("base", "layers", "tracks", "axes", "panel", "events", "surface", "controls", "player")  # of any drawing
LIVE_SCRIPTS = (*SCRIPTS, "place", "live")  # of the workbench: what is placed, what goes on


def stored(name: str) -> str:
    """Return the text of a script, a style or the page's frame."""
    return files("elusive").joinpath("report", "static", name).read_text(encoding="utf-8")


def write_page(
    path: Path, title: str, verdict: str, drawn: Drawing, tracks: str = "", rows: Sequence[tuple[str, str]] = (),
    note: str = "", findings: Sequence[Finding] = (),
) -> None:  # fmt: skip
    """Write a report, whole or not at all.

    Parameters
    ----------
    path
        File to write.
    title, verdict
        What it is of; what it came to, in a sentence.
    drawn
        Its drawing.
    tracks
        Table of tracks, as :func:`track_table` gives it; it stands above the drawing.
    rows
        Names and values of the table about the run, beneath it.
    note
        A sentence under the table of tracks.
    findings
        What was checked; those that do not hold stand above all numbers.
    """
    said = f'<p class="note">{html.escape(note)}</p>\n' if note and tracks else ""
    said_first = f'<p class="verdict">{html.escape(verdict)}</p>\n' if verdict else ""
    page = Template(stored("report.html")).substitute(
        title=html.escape(title),
        before=findings_html(findings) + said_first + (f'<div class="wide">{tracks}</div>\n{said}' if tracks else ""),
        after=f'<table class="run">{_facts(doubted(rows, findings))}</table>\n' if rows else "",
        style=stored("drawing.css") + stored("report.css"),
        # no "</script>" can end the script early
        data=dumps(drawn).replace("<", "\\u003c"),
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
