"""The one loop over measurements, and the labelled dataset made of what it yields."""

from __future__ import annotations

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
    filter: Filter[State, Measurement], measurements: Iterable[Measurement | None], rng: Generator
) -> Iterator[State]:
    """Yield the filter's state after each measurement; lazy, so a live stream and a file are the same.

    Parameters
    ----------
    filter
        Anything with ``init(rng)`` and ``step(state, measurement, rng)``.
    measurements
        Any iterable; ``None`` stands for a missing measurement.
    rng
        Source of all randomness.
    """
    state = filter.init(rng)
    for measurement in measurements:
        state = filter.step(state, measurement, rng)
        yield state


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
        Time of each state in seconds; the step's number by default.

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
    for state in states:
        for name in REPORTED:
            if hasattr(state, name):
                kept.setdefault(name, []).append(getattr(state, name))
    if not kept:
        raise DataError(
            "there is nothing to collect: no state came, or the states report none of " + ", ".join(REPORTED)
        )
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in kept.items()}
    steps = len(next(iter(arrays.values())))
    times = np.arange(steps, dtype=np.float64) if times_s is None else np.asarray(times_s, dtype=np.float64)
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
