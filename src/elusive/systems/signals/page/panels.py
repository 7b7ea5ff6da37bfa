"""The panels of the noise objects: signal, accumulated statistic and tracks, each over samples and time, as they grow.

Samples go across and frames down; in each frame of the player what is later is still dark.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.results import STATUSES, TrackLog
from elusive.systems.signals.report import SignalTracked, Waterfall
from elusive.systems.signals.track import SignalState
from elusive.workbench.blocks import Panel, player_spec, scaled

SIDE_AT_MOST = 200  # cells of a map, across and down
FRAMES_AT_MOST = 160  # of the player
TRUTH = 248  # label whose colour is grey
LEGEND = ("+ where an object truly is, grey its path", "red: candidate", "green: confirmed")


class Maps:
    """Gathers what is shown of a run."""

    def __init__(self) -> None:
        self._signal = Waterfall("largest", times=FRAMES_AT_MOST, samples=SIDE_AT_MOST)
        self._score = Waterfall("largest", times=FRAMES_AT_MOST, samples=SIDE_AT_MOST)

    def offer(self, state: SignalState) -> None:
        """Take what is known after one frame."""
        self._signal.offer(np.abs(state.taken))
        self._score.offer(state.score)

    @property
    def stride(self) -> int:
        """Frames of the run for one of the player."""
        return self._score.stride

    def player(self, tracked: SignalTracked, log: TrackLog) -> dict[str, Any]:
        """Return a player of the run."""
        shrink, stride = self._score.shrink, self._score.stride
        signal, score = self._signal.picture(), self._score.picture()
        bins, width = score.shape
        tall = max(1, min(SIDE_AT_MOST, width) // bins)

        def place(x: float, k: int) -> list[float]:
            return [round((x - (shrink - 1) / 2) / shrink, 2), tall * k + (tall - 1) / 2]

        truth = tracked.truth
        crosses: list[list[Any]] = [[] for _ in range(bins)]
        if truth is not None:
            for k in range(bins):
                crosses[k] = [["truth", *place(x, k), "", "", 0] for x in truth[k * stride] if np.isfinite(x)]
        dots = _dots(log, stride, bins)
        marks = [[[*("mark", *place(x, k)), status, str(track), 0] for x, status, track in there]
                 for k, there in enumerate(dots)]  # fmt: skip
        both = [[*cross, *mark] for cross, mark in zip(crosses, marks, strict=True)]
        seen = scaled("Signal", _grown(signal, tall), "", low=0.0, colours="grey")
        found = scaled("Statistic", _grown(score, tall), "deviations", low=0.0)
        paths = Panel("Tracks", _grown(_paths(tracked, shrink, stride, score.shape), tall), colours="labels")
        across = f"across: samples 0 to {tracked.samples - 1}"
        down = f"down: frames 0 to {len(tracked.times) - 1}"
        return player_spec(
            "Signal, statistic and tracks", [seen, found, paths], (-0.5, width - 0.5, -0.5, tall * bins - 0.5),
            marks=[None, both, both], down=True, autoplay=True, legend=[across, down, *LEGEND],
        )  # fmt: skip


def _grown(picture: NDArray[Any], tall: int) -> NDArray[Any]:
    """Return the picture as it was after each of its rows, ``(T, T * tall, W)``, each row repeated."""
    bins = len(picture)
    known = np.arange(bins)[:, None] >= np.arange(bins)
    return np.repeat(np.where(known[:, :, None], picture, 0), tall, axis=1)


def _dots(log: TrackLog, stride: int, bins: int) -> list[list[tuple[float, str, int]]]:
    """Return place, status and number of each living track in each frame of the player."""
    dots: list[list[tuple[float, str, int]]] = [[] for _ in range(bins)]
    for row in log.rows:
        status = STATUSES[row["status"]]
        if status != "deleted" and row["step"] % stride == 0:
            dots[row["step"] // stride].append((float(row["position"][0]), status.upper(), int(row["track"])))
    return dots


def _paths(tracked: SignalTracked, shrink: int, stride: int, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Label the cells of true paths and of tracks."""
    labels = np.zeros(shape, np.uint8)

    def draw(frame: int, x: float, label: int) -> None:
        for column in range(int(x) // shrink - 1, int(x) // shrink + 2):
            labels[frame // stride, column % shape[1]] = label

    if tracked.truth is not None:
        for frame, places in enumerate(tracked.truth):
            for x in places[np.isfinite(places)]:
                draw(frame, float(x), TRUTH)
    for path in tracked.paths:
        for frame, x in zip(path.frames.tolist(), path.x.tolist(), strict=True):
            draw(frame, x, 1 + path.track % 240)
    return labels
