"""The table of docs/recordings.md: ``python -m tests.recorded_table`` measures its rows, of some recordings or all."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy import ndimage

from tests import infrared

WIDTHS_PX = (1.0, 1.5, 2.0, 3.0)  # of the Laplacian of Gaussian, the best of them by the labels
COLUMNS = 6  # name, followed, shown, others, strongest peak, brightest spot: what this makes of a row
DOCUMENT = Path(__file__).parents[1] / "docs" / "recordings.md"


def brightest_spot(sequence: infrared.Sequence) -> float:
    """Share of the target's frames in which the greatest Laplacian of Gaussian, alone, is at it; of the best width."""
    numbers = [k for k in range(infrared.FIRST, len(sequence.frames)) if np.isfinite(sequence.labels[k, 0])]
    found = np.zeros((len(numbers), len(WIDTHS_PX)))
    for at, k in zip(found, numbers, strict=True):
        for j, width in enumerate(WIDTHS_PX):
            curved = ndimage.gaussian_laplace(sequence.frames[k].astype(np.float32), width)
            y, x = np.unravel_index(int(curved.argmin()), curved.shape)
            at[j] = np.hypot(*(np.array([x, y]) - sequence.labels[k])) <= sequence.near_px
    return float(found.mean(axis=0).max())


def measured(sequence: infrared.Sequence, score: infrared.Score) -> tuple[float, ...]:
    """Return the numbers of a recording's row."""
    return score.followed, score.shown, score.others, score.brightest, brightest_spot(sequence)


def row(name: str, numbers: tuple[float, ...]) -> str:
    """Write a row as it stands in the document, without its last columns."""
    cells = [f"{number:.{1 if column == 2 else 2}f}".removeprefix("0") for column, number in enumerate(numbers)]
    return f"| {' | '.join([name.removeprefix('IR_'), *cells])} |"


def documented(name: str) -> str:
    """The same part of the row that the document has; empty where there is none."""
    start = f"| {name.removeprefix('IR_')} |"
    lines = DOCUMENT.read_text(encoding="utf-8").split("| recording | followed | shown, when due |")[1].splitlines()
    line = next((line for line in lines if line.startswith(start)), "")
    return "|".join(line.split("|")[: COLUMNS + 1]) + "|" if line else ""


def main(names: list[str]) -> None:
    """Write the rows of some recordings, and of their mean."""
    every = []
    for name in names or [*infrared.SEQUENCES, *infrared.CLIPS]:
        sequence = infrared.read(name)
        every.append(measured(sequence, infrared.score(sequence)))
        print(row(name, every[-1]), flush=True)
    print(row("mean", tuple(np.nanmean(every, axis=0).tolist())))


if __name__ == "__main__":
    main(sys.argv[1:])
