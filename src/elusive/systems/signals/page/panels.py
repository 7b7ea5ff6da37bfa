"""The panels of the noise objects: the report's, growing as they are played, and how far off each object was."""

from __future__ import annotations

import numpy as np

from elusive.contracts import Array
from elusive.report import drawing as draw
from elusive.report import plots
from elusive.systems.signals.report import SignalTracked, Waterfall, signal_drawing
from elusive.systems.signals.summary import apart
from elusive.systems.signals.track import SignalState

TIMES_AT_MOST, SAMPLES_AT_MOST = 400, 300  # cells of a map


class Maps:
    """Gathers what is shown of a run."""

    def __init__(self) -> None:
        self._signal, self._score = (
            Waterfall("largest", times=TIMES_AT_MOST, samples=SAMPLES_AT_MOST) for _ in range(2)
        )

    def offer(self, state: SignalState) -> None:
        """Take what is known after one frame."""
        self._signal.offer(np.abs(state.taken))
        self._score.offer(state.score)

    def drawing(self, tracked: SignalTracked, period: float, near: float) -> draw.Drawing:
        """Return what a page draws of a run; errors as :func:`errors_of` has them."""
        drawn = signal_drawing(tracked, self._signal, self._score, autoplay=True)
        drawn["start"] = 0
        step = float(np.median(np.diff(tracked.times))) if len(tracked.times) > 1 else 1.0
        for panel in drawn["panels"]:
            for layer in panel["layers"]:
                if layer["type"] == "image":
                    layer["grows"] = step * self._score.stride / 2
        if tracked.truth is not None:
            errors = errors_of(tracked, period, near).T
            names = ["error"] if len(errors) == 1 else [f"object {number}" for number in range(1, len(errors) + 1)]
            lines = [
                draw.line(tracked.times, error, plots.SERIES[number % len(plots.SERIES)], name=name)
                for number, (name, error) in enumerate(zip(names, errors, strict=True))
            ]
            title = "How far off, where found?"
            drawn["panels"].append(draw.chart(title, tracked.times, lines, axis="error", unit="samples", span=12))
        return drawn


def errors_of(tracked: SignalTracked, period: float, near: float) -> Array:
    """Return how far from each object the nearest confirmed track is, ``(T, objects)``, NaN where none is near."""
    assert tracked.truth is not None
    errors = np.full(tracked.truth.shape, np.inf)
    for path in tracked.paths:
        frames = path.frames[path.sure]
        errors[frames] = np.fmin(errors[frames], apart(path.x[path.sure][:, None] - tracked.truth[frames], period))
    return np.where(errors <= near, errors, np.nan)
