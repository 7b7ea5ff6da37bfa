"""What a worker does: the trials of one block, each on its own random numbers, stacked into arrays."""

from __future__ import annotations

import copy
import threading
from collections.abc import Mapping
from concurrent.futures import CancelledError
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from elusive.campaign.scenario import GridPoint, Trial
from elusive.errors import ElusiveError
from elusive.model import Model

Layout: TypeAlias = dict[str, tuple[str, tuple[int, ...]]]  # of each output the type's name and the shape

STORABLE = frozenset(
    ["bool", "complex64", "complex128", "float16", "float32", "float64"]
    + [f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)]
)

stopping = threading.Event()  # set in a worker process whose campaign has ended


class TrialError(ElusiveError):
    """A trial of a campaign failed, or gave what cannot be stored; the message says which and where."""


def run_block(trial: Trial, point: GridPoint, seed: int, numbers: range) -> dict[str, NDArray[Any]]:
    """Run consecutive trials at one point of the grid.

    Trial ``i`` draws from ``SeedSequence(seed, spawn_key=(i,))`` whatever the point and whoever runs it.

    Returns
    -------
    dict
        Each output, ``(n, ...)``, one row a trial, by name in alphabetical order.

    Raises
    ------
    TrialError
        If a trial raises, or its outputs differ from the trial before in names, shapes or types.
    """
    rows: list[dict[str, NDArray[Any]]] = []
    for number in numbers:
        if stopping.is_set():
            raise CancelledError
        where = trial_name(number, point)
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
        # A trial that writes into its mapping must not change the next one's.
        given = point.parameters if isinstance(point.parameters, Model) else copy.deepcopy(point.parameters)
        try:
            outputs = trial(given, rng)
        except Exception as error:
            raise TrialError(f"{where} failed: {type(error).__name__}: {error}") from error
        rows.append(_as_arrays(outputs, where))
        require_equal(_layout(rows[-1]), _layout(rows[0]), where)
    return {name: np.stack([row[name] for row in rows]) for name in sorted(rows[0])}


def trial_name(number: int, point: GridPoint) -> str:
    """Say which trial is meant, to begin a sentence with."""
    return f"Trial {number} at {point.label}" if point.label else f"Trial {number}"


def block_layout(outputs: Mapping[str, NDArray[Any]]) -> Layout:
    """Layout of one trial of a block, whose arrays have the trials in front."""
    return {name: (array.dtype.name, array.shape[1:]) for name, array in outputs.items()}


def require_equal(found: Layout, expected: Layout, where: str) -> None:
    """Refuse outputs that cannot stand in one array with the others.

    Raises
    ------
    TrialError
        If names, shapes or types differ.
    """
    if found != expected:
        raise TrialError(
            f"{where} gave {_describe(found)}, but other trials {_describe(expected)}; "
            "every trial must give the same names, shapes and types."
        )


def _as_arrays(outputs: Any, where: str) -> dict[str, NDArray[Any]]:
    if not isinstance(outputs, Mapping) or not outputs:
        raise TrialError(f"{where} gave {outputs!r:.40}; a trial must return a mapping of names to numbers or arrays.")
    arrays = {}
    for name, value in outputs.items():
        if not isinstance(name, str) or not name.isidentifier():
            raise TrialError(f"{where} names an output {name!r:.40}; use letters, digits and underscores.")
        # Python's own 0 and 0.5 come from the same expression, so both count as float64.
        number = isinstance(value, int | float) and not isinstance(value, bool | np.generic)
        array = np.asarray(value, dtype=np.float64 if number else None)
        if array.dtype.name not in STORABLE:
            raise TrialError(f"{where} gave {name} as {array.dtype.name}; an output must be numbers or truth values.")
        arrays[name] = array
    return arrays


def _layout(arrays: Mapping[str, NDArray[Any]]) -> Layout:
    return {name: (array.dtype.name, array.shape) for name, array in arrays.items()}


def _describe(layout: Layout) -> str:
    return ", ".join(f"{name} {kind} {shape}" for name, (kind, shape) in sorted(layout.items()))
