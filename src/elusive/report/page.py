"""The page of a report: one HTML file that asks nothing of the network, with its numbers, tables and pictures."""

from __future__ import annotations

import base64
import html
import io
import json
from collections.abc import Collection, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from elusive.io.atomic import atomic_path


def write_page(
    path: Path, template: str, data: Mapping[str, object], texts: Mapping[str, str], **parts: str
) -> None:  # fmt: skip
    """Fill a stored template in.

    Parameters
    ----------
    path
        File to write, whole or not at all.
    template
        Its name.
    data
        What the page's script draws, as JSON.
    texts
        Texts by their name in the template; written so that nothing in them is taken for HTML.
    parts
        HTML and scripts by their name in the template, as they are.
    """
    page = Template(stored(template)).substitute(
        {name: html.escape(text) for name, text in texts.items()},
        style=stored("report.css"),
        # no "</script>" can end the script early
        data=json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        **parts,
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def stored(name: str) -> str:
    """Return the text of a template, a script or a style."""
    return files("elusive").joinpath("templates", name).read_text(encoding="utf-8")


def rounded(values: ArrayLike, digits: int = 2) -> list[Any]:
    """Return numbers for JSON, rounded, NaN as null."""
    given = np.asarray(values, dtype=np.float64)
    numbers = np.round(given, digits).astype(object)
    numbers[~np.isfinite(given)] = None
    listed: list[Any] = numbers.tolist()
    return listed


def facts(rows: Sequence[tuple[str, str]]) -> str:
    """Return the lines of a table of names and values."""
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)


def track_table(
    header: Sequence[str], lines: Sequence[Sequence[str]], drawn: Collection[str] = (), hint: str = ""
) -> str:  # fmt: skip
    """Return a table of tracks, a line each, or nothing; the number of one that is drawn is a button.

    Parameters
    ----------
    header, lines
        Names of the columns; cells, the first of a line the track's number.
    drawn
        Numbers of those that are drawn.
    hint
        What the button does.
    """
    if not lines:
        return ""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in header)
    body = ""
    for first, *others in lines:
        name = html.escape(first)
        button = f'<button type="button" data-track="{name}" title="{html.escape(hint)}">{name}</button>'
        cells = "".join(f"<td>{html.escape(cell)}</td>" for cell in others)
        body += f"<tr><td>{button if first in drawn else name}</td>{cells}</tr>"
    return f"<table class='tracks'><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def picture_url(image: Any) -> str:
    """Return a picture, an array of grey or a Pillow image, as a PNG in a data URL."""
    from PIL import Image

    buffer = io.BytesIO()
    (Image.fromarray(image) if isinstance(image, np.ndarray) else image).save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
