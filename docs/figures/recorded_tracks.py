"""Draw what is shown in four recorded clips (Drone-detection dataset, CC0), each on one of its frames.

Run from the project's root, the recordings beside it or where ELUSIVE_DATA points; some minutes:
``PYTHONPATH=. python docs/figures/recorded_tracks.py docs/_static/recorded-tracks.png``
"""

import sys
from itertools import groupby
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from PIL import Image

from elusive.report import plots
from elusive.systems.images.track import ImageTracking, track_images
from tests import infrared

CLIPS = {  # the frame that is drawn of each
    "IR_AIRPLANE_044": 240,
    "IR_HELICOPTER_045": 240,
    "IR_DRONE_151": 260,
    "IR_DRONE_142": 240,
}
LABEL, AT, OTHER = "#2dd4bf", "#f43f5e", "#facc15"  # to be told apart on grey


def clip(axes: Axes, name: str, last: int) -> None:
    """Track a clip up to a frame; draw this with the ways so far, laid over it as the scene moved."""
    sequence = infrared.read(name)
    frames, labels = sequence.frames[: last + 1], sequence.labels[: last + 1]
    steps = list(track_images(frames, ImageTracking().bind(frames.shape[1:])))
    offsets = np.array([step.state.peaks.offset_px for step in steps])
    drift = offsets[-1] - offsets
    rows = [
        (track.track, k, *track.mean[[0, 2]])
        for k, step in enumerate(steps)
        for track in step.tracks
        if track.status == "confirmed" and track.extra["shown"]
    ]
    plots.frame(axes, frames[-1])
    axes.plot(*(labels + drift).T, color=LABEL, linewidth=4.0, alpha=0.6)
    for _, members in groupby(sorted(rows), key=lambda row: row[0]):
        _, when, x, y = np.array(list(members)).T
        number = when.astype(int)
        gaps = np.flatnonzero(np.diff(number) > 1) + 1  # shown, hidden and shown again: the line breaks
        apart = np.hypot(*(np.stack([x, y]) - labels[number].T))
        colour = AT if np.mean(apart <= sequence.near_px) > 0.5 else OTHER
        way = np.insert(np.column_stack([x, y]) + drift[number], gaps, np.nan, axis=0)
        axes.plot(*way.T, color=colour, linewidth=1.6)
    axes.set(title=name.removeprefix("IR_"), xlim=(-0.5, 319.5), ylim=(255.5, -0.5))


def main(path: Path) -> None:
    """Write the figure."""
    with plots.figure(path, 9.0, 8.0, 2, 2) as (drawn, grid):
        for axes, (name, last) in zip(grid.ravel(), CLIPS.items(), strict=True):
            clip(axes, name, last)
        drawn_as = {"label": (LABEL, 4.0), "shown, at the label": (AT, 1.6), "shown, elsewhere": (OTHER, 1.6)}
        lines = [Line2D([], [], color=colour, linewidth=width) for colour, width in drawn_as.values()]
        drawn.legend(lines, list(drawn_as), loc="outside lower center", ncols=3)
    with Image.open(path) as picture:  # a palette in a third of the bytes; coverage, for the lines are few among greys
        picture.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE).save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
