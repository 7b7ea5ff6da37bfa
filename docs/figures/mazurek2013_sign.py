"""Draw why 1 - X is accumulated: what the object does to the local distribution, to X, and to both accumulated maps.

Run from the project's root, some seconds: ``python docs/figures/mazurek2013_sign.py docs/_static/mazurek2013-sign.png``
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from scipy.stats import norm

from elusive.experiments.mazurek2013.scenario import NoiseObjectCase
from elusive.experiments.mazurek2013.trial import NoiseObjectTrial
from elusive.filters import RecurrentFilter
from elusive.preprocess import DotProduct
from elusive.report import plots, run

SIGMA, SIZE, WINDOW, SMOOTHING = 0.75, 5, 3, 0.98
EDGES = np.array([-np.inf, -2, -1, 0, 1, 2, np.inf])  # of the regions, in deviations of the whole signal
AROUND = 18


def distributions(axes: Axes) -> None:
    """Share of the samples in each region, over the whole signal and inside the object."""
    inside = np.hypot(SIGMA, 1.0)
    # with 5 samples of 1200 covered, the whole signal's deviation is the background's to half a per cent
    shares = [np.diff(norm.cdf(EDGES * SIGMA, scale=deviation)) for deviation in (SIGMA, inside)]
    cosine = shares[0] @ shares[1] / np.prod([np.linalg.norm(share) for share in shares])
    place = np.arange(len(EDGES) - 1)
    for share, shift, colour, label in zip(
        shares, (-0.2, 0.2), (plots.MUTED, plots.ESTIMATE), ("whole signal, G", "inside the object"), strict=True
    ):
        axes.bar(place + shift, share, 0.38, color=colour, label=label)
    axes.set_xticks(place, ["< -2", "-2 to -1", "-1 to 0", "0 to 1", "1 to 2", "> 2"])
    axes.set(xlabel="region [deviations of the signal]", ylabel="share of the samples")
    axes.set_title(f"Inside the object, other counts: cosine {cosine:.2f}")
    axes.legend(loc="upper right")


def dip(axes: Axes) -> None:
    """Mean X about the object, over frames of many cases."""
    window, offsets = DotProduct(window=WINDOW), np.arange(-AROUND, AROUND + 1)
    about, overall = [], []
    for seed in range(50):
        case = NoiseObjectCase(object_size=SIZE, background_deviation=SIGMA).simulate(np.random.default_rng(seed))
        for frame, position in zip(case.frames, case.positions, strict=True):
            x = window.statistic(frame)
            about.append(x[(int(position) + offsets) % len(x)])
            overall.append(x.mean())
    axes.axvspan(-SIZE / 2, SIZE / 2, color=plots.TRUTH, alpha=0.12, linewidth=0, label="the object")
    axes.axhline(
        np.mean(overall), color=plots.MUTED, linewidth=1.0, linestyle=(0, (4, 3)), label="mean over the signal"
    )
    axes.plot(offsets, np.mean(about, axis=0), color=plots.ESTIMATE, marker="o", markersize=3, label="mean X")
    axes.set(xlabel="samples from the object's centre", ylabel=f"X, window of {WINDOW}")
    axes.set_title("X dips at the object")
    axes.legend(loc="lower left")


def accumulated(axes: Axes, name: str, label: str) -> None:
    """Map of one case after its 80 frames, largest over the velocities."""
    model = NoiseObjectTrial(object_size=SIZE, background_deviation=SIGMA)
    case = model.simulate(np.random.default_rng(4))
    window = model.window((name, WINDOW))
    search = RecurrentFilter(smoothing=SMOOTHING, min_velocity=0, max_velocity=model.max_velocity)
    evidence = (window.evidence(frame) for frame in case.frames)
    *_, state = run(search, evidence, np.random.default_rng(), start_s=-1.0)
    best = int(state.mean[0])
    axes.axvline(case.positions[-1], color=plots.TRUTH, linewidth=1.2, linestyle=(0, (4, 3)), label="the object")
    axes.plot(state.score, color=plots.MUTED, linewidth=0.9)
    axes.plot(best, state.score[best], "o", color=plots.ESTIMATE, label="maximum: the estimate")
    axes.set(xlabel="sample", ylabel="accumulated [noise deviations]", xlim=(0, 1200), ylim=(-1, 10))
    axes.set_title(f"{label}: off by {model.distance(best, case.positions[-1]):.0f} samples")
    axes.legend(loc="upper right")


def main(path: Path) -> None:
    """Write the figure."""
    with plots.figure(path, 9.0, 6.2, 2, 2) as (_, grid):
        distributions(grid[0, 0])
        dip(grid[0, 1])
        accumulated(grid[1, 0], "dot", "1 - X accumulated")
        accumulated(grid[1, 1], "dot-similar", "X accumulated")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
