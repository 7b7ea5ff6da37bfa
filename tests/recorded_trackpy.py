"""What trackpy finds on recorded infrared, its settings the best by the labels: two columns of docs/recordings.md.

``python -m tests.recorded_trackpy`` measures them, of some recordings or all; ``--contrast .5``, of targets of half
their contrast. The project does not depend on trackpy: ``pip install trackpy==0.7`` first. A minute a recording.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from tests import infrared

SPOTS = ((5, False), (7, False), (11, False), (7, True))  # diameter [px], and whether dark spots are sought
LEVELS = ((64, np.geomspace(0.5, 40, 9)), (0, np.geomspace(20, 150, 3)))  # percentile, and spots a frame that are left
RANGES_PX, MEMORY, LEAST = (4, 8), 3, 5  # of a search; frames without a spot; frames of a trajectory
FEW = 2.0  # other trajectories a frame, up to which a setting lets few in


class Found(NamedTuple):
    """How a setting does from the tenth frame on."""

    at_target: float  # share of the target's frames with a trajectory at it
    others: float  # other trajectories a frame


def settings(sequence: infrared.Sequence) -> Iterator[Found]:
    """Yield what each setting of the grid finds, but for those that trackpy refuses: too many spots near each other."""
    trackpy = importlib.import_module("trackpy")
    trackpy.quiet()
    frames = sequence.frames.astype(np.uint8)
    for diameter, dark in SPOTS:
        for percentile, levels in LEVELS:
            spots = trackpy.batch(frames, diameter, minmass=0, invert=dark, percentile=percentile, processes=1)
            heaviest = np.sort(spots["mass"])[::-1]
            for level in levels:
                least = heaviest[min(int(level * len(frames)), len(heaviest) - 1)]
                for search_range in RANGES_PX:
                    kept = spots[spots["mass"] >= least]
                    try:
                        linked = trackpy.link(kept, search_range, memory=MEMORY)
                    except trackpy.SubnetOversizeException:
                        continue
                    yield _scored(sequence, trackpy.filter_stubs(linked, LEAST))


def _scored(sequence: infrared.Sequence, trajectories: Any) -> Found:
    """Score trajectories, a table of ``frame``, ``x`` and ``y``, by the labels."""
    frames, places = trajectories["frame"].to_numpy(), trajectories[["x", "y"]].to_numpy()
    found, others = [], []
    for k in range(infrared.FIRST, len(sequence.frames)):
        near = np.hypot(*(places[frames == k] - sequence.labels[k]).T) <= sequence.near_px
        others.append(np.count_nonzero(~near))
        if np.isfinite(sequence.labels[k, 0]):
            found.append(near.any())
    return Found(float(np.mean(found)), float(np.mean(others)))


def best(sequence: infrared.Sequence) -> tuple[Found, Found]:
    """Return the best of the settings that let few others in, and of all.

    Better is what has more of the target, then fewer others.
    """
    grid = sorted(settings(sequence), key=lambda one: (-one.at_target, one.others))
    return next(one for one in grid if one.others <= FEW), grid[0]


def cell(found: Found) -> str:
    """Write a cell as it stands in the document."""
    others = f"{found.others:.1f}".removeprefix("0") if 0.05 <= found.others < 10 else f"{found.others:.0f}"
    return f"{found.at_target:.2f}".removeprefix("0") + f" ({others})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[*infrared.SEQUENCES, *infrared.CLIPS])
    parser.add_argument("--contrast", type=float, default=1.0, help="of the target, times its own")
    asked = parser.parse_args()
    every = []
    for name in asked.names:
        recording = infrared.read(name)
        every.append(best(recording if asked.contrast == 1 else infrared.scale(recording, asked.contrast)))
        print(name.removeprefix("IR_"), *map(cell, every[-1]), sep=" | ", flush=True)
    print("mean", *(cell(Found(*np.mean(column, axis=0))) for column in zip(*every, strict=True)), sep=" | ")
