"""What one trial is: the callable, the model of its parameters, and that model at every point of the grid."""

from __future__ import annotations

import copy
import difflib
import json
from collections.abc import Callable, Mapping
from importlib import import_module
from inspect import signature
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias, get_type_hints

from numpy.random import Generator
from pydantic import BaseModel

from elusive.campaign.config import CampaignConfig
from elusive.errors import ParameterError
from elusive.model import Model, kind_of, models_in

# The parameters are a model or a mapping: Any, so that a trial may say which model it takes.
Trial: TypeAlias = Callable[[Any, Generator], Mapping[str, Any]]


class Scenario(NamedTuple):
    """A trial and what is known of it beforehand."""

    trial: Trial  # trial(parameters, rng) -> outputs; at the top of a module, so that other processes find it
    model: type[Model] | None = None  # checks the parameters and is handed to the trial; None hands it the mapping
    dims: Mapping[str, tuple[str, ...]] = MappingProxyType({})  # names of an output's own dimensions


class GridPoint(NamedTuple):
    """One combination of the grid's values."""

    place: tuple[int, ...]  # position along each axis
    label: str  # "snr_db=3, birth.rate=0.1"; empty where there is no grid
    parameters: Mapping[str, Any] | Model


def resolve(name: str, scenarios: Mapping[str, Scenario] = MappingProxyType({})) -> Scenario:
    """Find a scenario by its registered name or by import string.

    Parameters
    ----------
    name
        A key of ``scenarios``, or ``"package.module:name"`` of a :class:`Scenario` or of a trial.
    scenarios
        The registered ones.

    Returns
    -------
    Scenario
        Of a bare trial, with the model that annotates its first parameter, where one does.

    Raises
    ------
    ParameterError
        If there is no such name, or it cannot be imported or called.
    """
    if name in scenarios:
        return scenarios[name]
    module, colon, attribute = name.partition(":")
    if not colon:
        near = difflib.get_close_matches(name, scenarios, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(scenarios) or 'none'};"
        raise ParameterError(
            f"scenario: there is no {name!r}; {hint} A function of yours is 'package.module:function'."
        )
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ParameterError(f"scenario: {name!r} cannot be imported ({error}); check its spelling.") from None
    if not callable(found) and not isinstance(found, Scenario):
        raise ParameterError(f"scenario: {name!r} is a {type(found).__name__}; name a function or a Scenario.")
    return as_scenario(found)


def as_scenario(trial: Trial | Scenario) -> Scenario:
    """Take a bare trial as a scenario whose model is the one that annotates the first parameter."""
    if isinstance(trial, Scenario):
        return trial
    try:
        named = get_type_hints(trial).get(next(iter(signature(trial).parameters), ""))
    except TypeError:  # a partial or another object that is called but bears no annotations
        named = None
    except NameError as error:
        raise ParameterError(f"scenario: the trial's annotations cannot be read ({error}); give a Scenario.") from None
    return Scenario(trial, named if isinstance(named, type) and issubclass(named, Model) else None)


def grid_points(configuration: CampaignConfig, model: type[Model] | None) -> list[GridPoint]:
    """Combine and check the parameters of every point of the grid, the last axis fastest.

    A dotted path changes one field of what would be used without it: the fixed parameter, else the model's default.

    Raises
    ------
    ParameterError
        If the model refuses any of them; the sentence names the field and the point.
    """
    points = []
    axes = configuration.grid
    for combination in product(*(enumerate(values) for values in axes.values())):
        parameters = copy.deepcopy(configuration.parameters)
        for axis, (_, value) in zip(axes, combination, strict=True):
            _place(parameters, model, axis, axis.split("."), copy.deepcopy(value))
        label = ", ".join(f"{axis}={json.dumps(value)}" for axis, (_, value) in zip(axes, combination, strict=True))
        place = tuple(position for position, _ in combination)
        try:
            points.append(GridPoint(place, label, parameters if model is None else model(**parameters)))
        except ParameterError as error:
            raise ParameterError(f"{error} (At {label}.)" if label else str(error)) from None
    return points


def _place(node: dict[str, Any], model: type[BaseModel] | None, axis: str, path: list[str], value: Any) -> None:
    """Set the value at the end of a path, filling what the path goes through from the model's defaults."""
    head, *rest = path
    if not rest:
        node[head] = value
        return
    field = model.model_fields.get(head) if model is not None else None
    if head not in node:
        default = field.get_default(call_default_factory=True) if field is not None else None
        node[head] = _stated(default) if isinstance(default, BaseModel | dict) else {}
    inner = node[head]
    if not isinstance(inner, dict):
        raise ParameterError(f"grid.{axis}: {head} is {inner!r:.40} and has no fields; vary {head} itself.")
    candidates = models_in(field.annotation) if field is not None else []
    tagged = [found for found in candidates if kind_of(found) == inner.get("kind")]
    _place(inner, next(iter(tagged or candidates), None), axis, rest, value)


def _stated(value: Any) -> Any:
    """Reduce a model to the fields it was given, so that another kind can be put in its place field by field."""
    if isinstance(value, BaseModel):
        given = value.model_fields_set | {"kind"}
        return {name: _stated(getattr(value, name)) for name in type(value).model_fields if name in given}
    return copy.deepcopy(value)
