"""Draw existence on recorded infrared, as it is and with its target painted out, and what is left then.

Run from the project's root, the recordings beside it or where ELUSIVE_DATA points; about a minute:
``PYTHONPATH=. python docs/figures/real_frames.py real_frames.png``
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from tests import infrared

SEEDS = range(5)
GLINTS = (217.0, 46.0)  # sequence1, frame 74: two points that light up in the scene at the recording's cut


def existence(axes: Axes, sequence: infrared.Sequence, label: str, colour: str) -> None:
    """Mean existence over seeds, and its range."""
    whitened = infrared.whiten(sequence)
    runs = np.array([infrared.track(whitened, seed).existence for seed in SEEDS])
    frame = np.arange(runs.shape[1])
    axes.fill_between(frame, runs.min(0), runs.max(0), color=colour, alpha=0.25, lw=0)
    axes.plot(frame, runs.mean(0), color=colour, label=f"{label}: mean {runs[:, 10:].mean():.3f} from frame 10")


def crop(axes: Axes, frame: np.ndarray, centre: tuple[float, float], title: str) -> None:
    """A part of a frame with what is left ringed."""
    x, y = (round(v) for v in centre)
    part = (slice(max(y - 20, 0), y + 21), slice(max(x - 35, 0), x + 36))
    axes.imshow(frame[part], cmap="gray", extent=(part[1].start, x + 36, y + 21, part[0].start))
    axes.set(xlim=(part[1].start, x + 36), ylim=(y + 21, part[0].start), autoscale_on=False)
    axes.set_title(title, fontsize=8)
    axes.tick_params(labelsize=6)


def main(path: str) -> None:
    """Write the figure."""
    figure = plt.figure(figsize=(11, 8), layout="constrained")
    grid = figure.add_gridspec(3, 4)
    easy, slow = infrared.read("easy2"), infrared.read("sequence1")
    painted = infrared.scale(easy, 0.0)
    axes = figure.add_subplot(grid[0, :])
    existence(axes, easy, "easy2", "C0")
    existence(axes, painted, "painted out", "C3")
    existence(axes, infrared.without_movers(painted), "two unlabelled movers painted out as well", "C2")
    axes.axvline(23, color="k", lw=0.5, ls=":")
    slow_painted = infrared.scale(slow, 0.0)
    below = figure.add_subplot(grid[1, :])
    existence(below, slow, "sequence1", "C0")
    existence(below, slow_painted, "painted out", "C3")
    for panel in (axes, below):
        panel.set(xlabel="frame", ylabel="probability of existence", ylim=(-0.02, 1.02))
        panel.legend(fontsize=8, loc="center left")
    for column, k in enumerate((25, 28)):
        panel = figure.add_subplot(grid[2, column])
        crop(panel, painted.frames[k], infrared.MOVERS["first"][k], f"easy2 painted, frame {k}: the movers")
        for track in infrared.MOVERS.values():
            panel.plot(*track[k], "o", mfc="none", mec="r", ms=14)
    for column, k in enumerate((71, 74)):
        panel = figure.add_subplot(grid[2, 2 + column])
        centre = GLINTS if k == 74 else (GLINTS[0] - 8, GLINTS[1] - 8)
        crop(
            panel, slow_painted.frames[k], centre, f"sequence1 painted, frame {k}: {'glints' if k == 74 else 'before'}"
        )
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1])
