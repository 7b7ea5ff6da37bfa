"""Draw existence on recorded infrared, as it is and with its target painted out.

Run from the project's root, the recordings beside it or where ELUSIVE_DATA points; a few minutes:
``PYTHONPATH=. python docs/figures/real_frames.py docs/_static/real-frames.png``
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from elusive.report import plots
from tests import infrared

SEEDS = range(3)
CUT, ENTER = 72, 23  # frames: the recording jumps in sequence1; two unlabelled objects enter in easy2


def existence(axes: Axes, sequence: infrared.Sequence, label: str, colour: str) -> None:
    """Mean existence over seeds, and its range."""
    runs = np.array([infrared.track(sequence, seed).existence for seed in SEEDS])
    frame = np.arange(runs.shape[1], dtype=float)
    mean = f"{label}: mean {runs[:, 10:].mean():.3f} from frame 10"
    plots.band(axes, frame, runs, colour, mean, quantiles=(0.0, 1.0))


def main(path: Path) -> None:
    """Write the figure."""
    easy, slow = infrared.read("easy2"), infrared.read("sequence1")
    painted = infrared.scale(easy, 0.0)
    with plots.figure(path, 9.0, 6.4, 2, 1) as (_, grid):
        above, below = grid[:, 0]
        existence(above, easy, "easy2 as recorded", plots.TRUTH)
        existence(above, painted, "its target painted out", plots.ESTIMATE)
        existence(above, infrared.without_movers(painted), "two unlabelled movers painted out too", plots.SERIES[1])
        above.axvline(ENTER, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
        above.annotate("two unlabelled objects enter", (ENTER, 0.5), (-4, 0), textcoords="offset points", ha="right")
        existence(below, slow, "sequence1 as recorded", plots.TRUTH)
        existence(below, infrared.scale(slow, 0.0), "its target painted out", plots.ESTIMATE)
        below.axvline(CUT, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)))
        below.annotate("the recording jumps 8 px", (CUT, 0.5), (-4, 0), textcoords="offset points", ha="right")
        for axes in (above, below):
            axes.set(xlabel="frame", ylabel="probability of existence", ylim=(-0.02, 1.02))
            axes.legend(loc="center left", bbox_to_anchor=(0.3, 0.35))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
