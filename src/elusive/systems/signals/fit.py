"""What a signal says of its noise and of its objects' size, from itself and without labels."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from elusive.checks.fitted import Fit, Fitted
from elusive.io import SignalSource
from elusive.preprocess.whiten import NoiseModel
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.run import bound_to, follow

SIZES = (3, 5, 7, 11, 17)  # samples, of objects that are tried
SURE = 1e-3  # by chance, that any of them is so clear in noise
LEAST = 1e-300


def fit_signal(source: SignalSource, on_frame: Callable[[int], None] | None = None) -> Fit:
    """Fit a recording: whether its noise is white, and the object's size whose evidence is least by chance.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_signal`; it is read once for each size that is tried.
    on_frame
        Called with the number of frames done, over all readings.

    Raises
    ------
    DataError
        If a frame cannot be used.
    """
    chances, done, noise = dict[int, float](), 0, None
    sizes = [size for size in SIZES if 8 * size <= source.samples] or [SIZES[0]]
    for size in sizes:
        least = 1.0
        for step in follow(source, bound_to(source, SignalTracking(object_size=size))):
            noise, done = step.state.noise, done + 1
            if step.state.law is not None:
                least = min(least, step.state.law.probability(float(step.state.score.max())))
            if on_frame is not None:
                on_frame(done)
        # the frames, one in a memory, and the sizes are so many chances
        chances[size] = min(1.0, least * len(sizes) * done)
    best = min(chances, key=lambda size: chances[size])
    values, tree = [_noise(noise)], dict[str, Any]()
    tree["noise"] = values[0].value
    if chances[best] < SURE:
        near = [size for size in sizes if chances[size] < math.sqrt(max(chances[best], LEAST))]
        spread = (max(near) - min(near)) / 4 if len(near) > 1 else math.nan
        how = f"an object of this size is {max(chances[best], LEAST):.0e} by chance"
        values.append(Fitted("--object-size", "samples of an object", str(best), spread, how))
        tree["object_size"] = best
    else:
        values.append(Fitted("--object-size", "samples of an object", "-", math.nan, "nothing stands out at any size"))
    return Fit(tuple(values), tree)


def _noise(model: NoiseModel | None) -> Fitted:
    """Say what the noise is at the end; white only where nothing else predicts it better."""
    if model is None:
        return Fitted("--noise", "noise", "estimated", math.nan, "no frame can be used")
    seen = []
    if model.plain.order:
        seen.append(f"coloured (predicted by {model.plain.order} samples)")
    if model.judged.chosen is not None:
        seen.append("levels of the samples differ")
    if model.trend.chosen:
        seen.append("the level changes along a frame")
    return Fitted("--noise", "noise", "estimated" if seen else "white", math.nan, ", ".join(seen) or "white, one level")
