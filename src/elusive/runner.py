"""The one loop over measurements, and the labelled dataset made of what it yields."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.random import Generator

from elusive.contracts import Filter
from elusive.errors import DataError

if TYPE_CHECKING:
    import xarray as xr

State = TypeVar("State")
Measurement = TypeVar("Measurement")

REPORTED = ("existence", "mean", "covariance")


def run(
    filter: Filter[State, Measurement],
    measurements: Iterable[Measurement | None],
    rng: Generator,
    times_s: Iterable[float] | None = None,
    start_s: float = math.nan,
) -> Iterator[State]:
    """Yield the filter's state after each measurement; lazy, so a live stream and a file are the same.

    Parameters
    ----------
    filter
        Anything with ``init(rng, time_s)`` and ``step(state, time_s, measurement, rng)``.
    measurements
        Any iterable; ``None`` stands for a missing measurement. Those with a ``time_s`` are taken at it.
    rng
        Source of all randomness.
    times_s
        Times of the measurements that have none of their own, in the order of all; without, 0, 1, 2, ... [s].
    start_s
        Time at which the filter's prior holds [s]; that of the first measurement by default.

    Raises
    ------
    DataError
        If there are fewer times than measurements, or a missing measurement among some that have a time has none.
    """
    state = filter.init(rng, start_s)
    for measurement, time_s in timed(measurements, times_s):
        state = filter.step(state, time_s, measurement, rng)
        yield state


def timed(
    measurements: Iterable[Measurement | None], times_s: Iterable[float] | None = None
) -> Iterator[tuple[Measurement | None, float]]:
    """Yield measurements with their times, as :func:`run` takes them."""
    given = None if times_s is None else iter(times_s)
    own = False
    for number, measurement in enumerate(measurements):
        time_s = float(number) if given is None else next(given, None)
        known = getattr(measurement, "time_s", None)
        if known is not None:
            own, time_s = True, float(known)
        elif time_s is None:
            raise DataError(f"times_s: ends before measurement {number}; give one time a measurement.")
        elif own and given is None:
            raise DataError(f"measurement {number}: has no time_s, as earlier ones have; give times_s.")
        yield measurement, time_s


def collect(
    states: Iterable[Any], *, state_names: Sequence[str] | None = None, times_s: Sequence[float] | None = None
) -> xr.Dataset:
    """Gather what states report (existence, mean, covariance) along time; particles are not kept.

    Parameters
    ----------
    states
        What :func:`run` yields.
    state_names
        Names of the ``d`` components; ``s0, s1, ...`` by default.
    times_s
        Time of each state in seconds; what the states say by default, or the step's number where they say nothing.

    Returns
    -------
    xarray.Dataset
        ``existence (time)``, ``mean (time, state)``, ``covariance (time, state, state_)``, those that the states have.

    Raises
    ------
    DataError
        If no state came, or the names or times do not fit.
    """
    import xarray as xr

    kept: dict[str, list[Any]] = {}
    said: list[float] = []
    for state in states:
        if hasattr(state, "time_s"):
            said.append(state.time_s)
        for name in REPORTED:
            if hasattr(state, name):
                kept.setdefault(name, []).append(getattr(state, name))
    if not kept:
        raise DataError(
            "there is nothing to collect: no state came, or the states report none of " + ", ".join(REPORTED)
        )
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in kept.items()}
    steps = len(next(iter(arrays.values())))
    by_default = said if len(said) == steps else range(steps)
    times = np.asarray(by_default if times_s is None else times_s, dtype=np.float64)
    if times.shape != (steps,):
        raise DataError(f"times_s: {times.size} times were given for {steps} states; give one time a state.")
    dims = {"existence": ("time",), "mean": ("time", "state"), "covariance": ("time", "state", "state_")}
    coords: dict[str, Any] = {"time": ("time", times, {"units": "s"})}
    if "mean" in arrays:
        d = arrays["mean"].shape[1]
        names = [f"s{i}" for i in range(d)] if state_names is None else list(state_names)
        if len(names) != d:
            raise DataError(
                f"state_names: {len(names)} names were given for {d} components; give one name a component."
            )
        coords |= {"state": names, "state_": names}
    return xr.Dataset({name: (dims[name], array) for name, array in arrays.items()}, coords=coords)
