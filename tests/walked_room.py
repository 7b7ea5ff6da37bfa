"""A made-up room with eight nodes on its border, and the log of one person who crosses it."""

from __future__ import annotations

import csv
import itertools

import numpy as np

NODES = np.array([[0, 0], [3, 0], [6, 0], [6, 3], [6, 6], [3, 6], [0, 6], [0, 3.0]])
PAIRS = list(itertools.permutations(range(8), 2))
EMPTY, FRAMES = 30, 68


def walker(frame):
    """Across the room at 0.2 m a frame from frame 40 on."""
    return np.array([0.4 + 0.2 * (frame - 40), 2.1 + 0.04 * (frame - 40)]) if frame >= 40 else None


def excess_of(place):
    """Excess path of somebody at a place over each reading's link; without a place, the links' lengths."""
    ends = NODES[[pair[0] for pair in PAIRS] * 2], NODES[[pair[1] for pair in PAIRS] * 2]
    apart = np.linalg.norm(ends[0] - ends[1], axis=1)
    return apart if place is None else sum(np.linalg.norm(end - place, axis=1) for end in ends) - apart


def other(frame):
    """Somebody else, the other way."""
    return np.array([5.6 - 0.2 * (frame - 40), 4.8 - 0.04 * (frame - 40)]) if frame >= 40 else None


def write_room(folder, *others, frames=FRAMES):
    """Write nodes, a wide log and the truth of one: levels drop where the person, or others, are in the way."""
    rng = np.random.default_rng(0)
    (folder / "nodes.csv").write_text("node,x_m,y_m\n" + "".join(f"n{k},{x},{y}\n" for k, (x, y) in enumerate(NODES)))
    names = [f"n{a}-n{b}-{c}" for c in (11, 26) for a, b in PAIRS]
    apart = excess_of(None)
    level = -45 - 20 * np.log10(apart) + rng.normal(0, 2, len(names))
    rows, truth = [["time_s", *names]], ["time_s,x_m,y_m"]
    for frame in range(frames):
        heard = level + rng.normal(0, 0.4, len(names))
        for place in (walk(frame) for walk in (walker, *others)):
            if place is None:
                continue
            excess = excess_of(place)
            heard -= 9 * np.exp(-excess / 0.03) + 2.5 * rng.normal(size=len(names)) * np.exp(-excess / 1.0)
        if (place := walker(frame)) is not None:
            truth.append(f"{0.5 * frame},{place[0]},{place[1]}")
        rows.append([0.5 * frame, *(f"{value:.0f}" for value in heard)])
    with (folder / "log.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    (folder / "truth.csv").write_text("\n".join(truth) + "\n")
    return folder


def changed(network, tmp_path, change):
    """Write the log with its lines changed."""
    lines = (network / "log.csv").read_text().splitlines()
    path = tmp_path / "changed.csv"
    path.write_text("\n".join(change(lines)) + "\n")
    return path


def all_missing(lines):
    return [lines[0], *(line.split(",")[0] + "," * (lines[0].count(",")) for line in lines[1:])]
