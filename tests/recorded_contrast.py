"""Recorded targets painted out, and scaled in contrast: two tables of docs/recordings.md.

``python -m tests.recorded_contrast`` measures their rows, of some recordings or all (ten minutes), without trackpy's
columns, which ``python -m tests.recorded_trackpy --contrast .5`` measures.
"""

from __future__ import annotations

import sys

import numpy as np

from tests import infrared
from tests.recorded_table import DOCUMENT, brightest_spot

WEAKER = (0.5, 0.33)  # times a target's own contrast
HEADS = {"out": "| recording, painted out |", "weaker": "| recording, contrast |"}


def measured(name: str) -> dict[str, tuple[float, ...]]:
    """Return the numbers of a recording's rows, by table and contrast."""
    recording = infrared.read(name)
    patches = infrared.target_free(recording, recording.labels)
    out = infrared.score(infrared.scale(recording, 0.0, patches=patches))
    rows: dict[str, tuple[float, ...]] = {"out": (out.seen, out.existence, out.others, out.sure)}
    for factor in WEAKER:
        weaker = infrared.scale(recording, factor, patches=patches)
        found = infrared.score(weaker)
        rows[f"{factor:g}"] = (found.followed, found.shown, found.others, found.sure, brightest_spot(weaker))
    return rows


def row(name: str, table: str, numbers: tuple[float, ...]) -> str:
    """Write a row as it stands in the document, without trackpy's columns."""
    first = name.removeprefix("IR_") + ("" if table == "out" else f", {table}".replace("0.", "."))
    return f"| {' | '.join([first, *(f'{number:.2f}'.removeprefix('0') for number in numbers)])} |"


def documented(name: str, table: str, cells: int) -> str:
    """The same part of the row that the document has; empty where there is none."""
    start = row(name, table, ())
    lines = DOCUMENT.read_text(encoding="utf-8").split(HEADS["out" if table == "out" else "weaker"])[1].splitlines()
    line = next((line for line in lines if line.startswith(start)), "")
    return "|".join(line.split("|")[: cells + 2]) + "|" if line else ""


def main(names: list[str]) -> None:
    """Write the rows of some recordings, and of their mean."""
    every = {}
    for name in names or [*infrared.SEQUENCES, *infrared.CLIPS]:
        every[name] = measured(name)
        for table, numbers in every[name].items():
            print(row(name, table, numbers), flush=True)
    for table in ("out", *(f"{factor:g}" for factor in WEAKER)):
        print(row("mean", table, tuple(np.nanmean([rows[table] for rows in every.values()], axis=0).tolist())))


if __name__ == "__main__":
    main(sys.argv[1:])
