"""One case of Mazurek (2013), section 4: the same frames through every statistic, window and smoothing."""

from __future__ import annotations

from itertools import product
from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array
from elusive.experiments.mazurek2013.scenario import NoiseObjectCase
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.preprocess import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation, Window

StatisticName = Literal["dot", "std", "chi2", "llr", "dot-similar"]  # the last accumulates X, which the object lowers
STATISTICS: dict[StatisticName, str] = {
    "dot": "dot product, 1 - X (the paper's)",
    "std": "standard deviation",
    "chi2": "chi-square",
    "llr": "log likelihood ratio",
}
WINDOWS = (3, 5, 7, 9, 11, 13)
SMOOTHINGS = (0.95, 0.98)
Method = tuple[StatisticName, int]
METHODS: tuple[Method, ...] = tuple(product(STATISTICS, WINDOWS))


class NoiseObjectTrial(NoiseObjectCase):
    """The scenario, and the searches that look at it."""

    methods: tuple[Method, ...] = Field(METHODS, min_length=1, description="Statistic and window of each search")
    smoothings: tuple[float, ...] = Field(
        SMOOTHINGS, min_length=1, description="Smoothing coefficients alpha, each with every method"
    )

    def window(self, method: Method) -> Window:
        """Statistic of a search; it knows the object's deviation, and takes the background's from each frame.

        Its window closes to a ring even where the signal is bounded: noise alone then looks alike at all places.
        """
        name, window = method
        if name == "llr":
            return LikelihoodRatio(window=window, object_deviation=self.object_deviation, mode=self.mode)
        if name in ("dot", "dot-similar"):
            return DotProduct(window=window, sign="dissimilar" if name == "dot" else "similar")
        return LocalDeviation(window=window) if name == "std" else ChiSquare(window=window)

    def filter(self, smoothing: float) -> RecurrentFilter:
        """Accumulator over the paper's motion vectors, 0 to 10, of evidence ``(methods, samples)``.

        The searches are rows of one image that nothing crosses: a step of all of them costs little more than of one.
        """
        vectors = tuple((float(velocity), 0.0) for velocity in range(self.max_velocity + 1))
        return RecurrentFilter(smoothing=smoothing, velocities=vectors, border=self.border)


def trial(parameters: NoiseObjectTrial, rng: Generator) -> dict[str, Array | float]:
    """Draw a case and search it by every method.

    Returns
    -------
    dict
        ``error (smoothing, method)``, the distance from the best cell of the last map to the object in samples, and
        ``background_sigma``.
    """
    case = parameters.simulate(rng)
    windows = [parameters.window(method) for method in parameters.methods]
    filters = [parameters.filter(smoothing) for smoothing in parameters.smoothings]
    states = [each.init(rng, -1.0) for each in filters]
    for number, frame in enumerate(case.frames):
        evidence = np.stack([window.evidence(frame) for window in windows])
        states = [each.step(state, float(number), evidence, rng) for each, state in zip(filters, states, strict=True)]
    found = np.stack([state.score.argmax(axis=1) for state in states])
    error = np.array([[parameters.distance(place, case.positions[-1]) for place in row] for row in found])
    return {"error": error, "background_sigma": case.background_sigma}


SCENARIO = Scenario(trial, NoiseObjectTrial, {"error": ("smoothing", "method")})
