"""What a campaign runs: a scenario, its fixed parameters, a grid over some of them, trials and a seed."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, field_validator

from elusive.errors import ParameterError
from elusive.model import Model

TRIAL, DONE = "trial", "done"  # dimension and record of every store: no parameter of a grid is called so


class CampaignConfig(Model):
    """A Monte Carlo campaign, complete: two equal configurations give two equal stores.

    Raises
    ------
    ParameterError
        If a field is missing, unknown or out of its bounds, a parameter is no plain value (number, text, list,
        mapping), an axis of the grid is empty or repeats a value, or one axis lies inside another.
    """

    scenario: str = Field(min_length=1, description="Registered name, or import string 'package.module:function'")
    parameters: dict[str, Any] = Field({}, description="Parameters that every trial shares")
    grid: dict[str, list[Any]] = Field(
        {}, description="Values of each varied parameter ('snr_db', 'birth.snr_db'): all combinations are run"
    )
    trials: int = Field(gt=0, description="Trials at each point of the grid")
    seed: int = Field(0, ge=0, description="Root of all random numbers")
    chunk: int = Field(16, gt=0, description="Trials run and stored together: what a kill can lose for each worker")

    @field_validator("parameters", mode="before")
    @classmethod
    def _plain_parameters(cls, value: Any) -> Any:
        return plain(value, "parameters")

    @field_validator("grid", mode="before")
    @classmethod
    def _plain_grid(cls, value: Any) -> Any:
        # Not sorted: the order of the axes is the order of the result's dimensions.
        if not isinstance(value, Mapping):
            return value
        return {axis: plain(values, f"grid.{axis}") for axis, values in value.items()}

    @field_validator("grid")
    @classmethod
    def _check_grid(cls, value: dict[str, list[Any]]) -> dict[str, list[Any]]:
        for axis, values in value.items():
            if axis in (TRIAL, DONE) or not all(part.isidentifier() for part in axis.split(".")):
                raise ParameterError(f"grid: {axis!r} names no parameter; write a name or a dotted path of names.")
            if not values:
                raise ParameterError(f"grid.{axis}: holds no value; list at least one.")
            if len(np.unique(coordinate(values))) < len(values):
                raise ParameterError(f"grid.{axis}: holds the same value twice; list each once.")
            for other in value:
                if other.startswith(f"{axis}."):
                    raise ParameterError(f"grid: {other} lies inside {axis}; vary only one of them.")
        return value

    def canonical(self) -> str:
        """Write the configuration as one line of JSON: equal text for equal campaigns, and only for them."""
        return json.dumps(self.model_dump(mode="json"), separators=(",", ":"), allow_nan=False)


def coordinate(values: list[Any]) -> NDArray[Any]:
    """Label an axis of the grid: its numbers or truth values themselves, ``(n,)``; of anything else its text."""
    types = {type(value) for value in values}
    if types == {bool} or types <= {int, float}:
        numbers = np.asarray(values)
        if numbers.dtype.kind in "bif":
            return numbers
    return np.asarray([value if isinstance(value, str) else json.dumps(value) for value in values], dtype=np.str_)


def plain(value: Any, where: str) -> Any:
    """Reduce a value to what JSON and YAML can hold, mappings sorted, so that equal parameters read equally."""
    if isinstance(value, BaseModel):
        value = value.model_dump(mode="json")
    elif isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        if not all(isinstance(key, str) for key in value):
            raise ParameterError(f"{where}: holds a key that is no text; quote it.")
        return {key: plain(value[key], f"{where}.{key}") for key in sorted(value)}
    if isinstance(value, list | tuple):
        return [plain(item, f"{where}.{index}") for index, item in enumerate(value)]
    if value is None or isinstance(value, str | bool | int) or (isinstance(value, float) and math.isfinite(value)):
        return value
    raise ParameterError(f"{where}: must be a finite number, text, truth value, list or mapping (got {value!r:.60}).")
