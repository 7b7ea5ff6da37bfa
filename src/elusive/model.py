"""The base of every model: a frozen pydantic object that is argument, configuration file and form at once."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import yaml
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ValidationError,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    model_validator,
)
from pydantic_core import PydanticSerializationError

from elusive.errors import DataError, ParameterError

Probability = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]

# marks a field that a pipeline takes from the recording: it is no option of a command
FROM_RECORDING: dict[str, JsonValue] = {"from_recording": True}


class Model(BaseModel):
    """A set of parameters, checked once and never changed.

    Raises
    ------
    ParameterError
        If a field is missing, unknown or out of its bounds; the message names the model and the field.
    """

    main_options: ClassVar[tuple[str, ...]] = ()  # of a command's parameters: the options that help shows first

    model_config = ConfigDict(defer_build=True, frozen=True, extra="forbid", validate_default=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _over_defaults(cls, given: Any) -> Any:
        """Let what is not given of an inner model stay as in the default that stands there."""
        if not isinstance(given, Mapping):
            return given
        standing = {name: field.default for name, field in cls.model_fields.items() if isinstance(field.default, Model)}
        return {name: over_default(standing[name], it) if name in standing else it for name, it in given.items()}

    if not TYPE_CHECKING:

        def __init__(self, **data: Any) -> None:
            try:
                super().__init__(**data)
            except ValidationError as error:
                raise ParameterError(explain(error, type(self))) from None

    def __eq__(self, other: object) -> bool:
        # fields alone: what a cached property has computed of them is no difference, and may be an array
        if not isinstance(other, Model):
            return NotImplemented
        same = type(self) is type(other)
        return same and all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed, checked again."""
        return type(self)(**{name: getattr(self, name) for name in type(self).model_fields} | changes)

    @classmethod
    def from_yaml(cls, path: str | Path) -> Self:
        """Read the model from a YAML file.

        Raises
        ------
        DataError
            If the file cannot be read or is no mapping.
        ParameterError
            If a key is misspelt or a value out of bounds.
        """
        return cls(**read_yaml(path))

    def to_yaml(self) -> str:
        """Write every field, defaults too, so that the file alone repeats the run.

        Raises
        ------
        ParameterError
            If a part cannot be read back from a file: an object of a class that is no model, or of no ``kind``.
        """
        try:
            data = self.model_dump(mode="json")
            type(self)(**data)
        except (PydanticSerializationError, ParameterError) as error:
            where, part = _unwritten(self, type(self).__name__) or (type(self).__name__, None)
            why = str(error) if part is None else f"holds a {type(part).__name__}, which no file can say"
            raise ParameterError(
                f"{where}: {why}; keep the model in Python, or make that part a Model with a kind of its own."
            ) from None
        text: str = yaml.safe_dump(data, sort_keys=False)
        return text


def _unwritten(model: Model, where: str) -> tuple[str, Any] | None:
    """Find the first part of a model that a file cannot say, and the field that holds it."""
    for name in type(model).model_fields:
        here, value = f"{where}.{name}", getattr(model, name)
        plain = isinstance(value, tuple | list) and not hasattr(value, "_fields")
        for part in value if plain else (value,):
            if isinstance(part, Model):
                found = _unwritten(part, here)
                if found is not None:
                    return found
            elif not isinstance(part, str | int | float | tuple | list | dict | None) or hasattr(part, "_fields"):
                return here, part
    return None


def over_default(default: Model, given: Any) -> Any:
    """Lay a mapping of fields over a model: what is not given stays as in this model, not as in its class.

    A mapping that chooses another ``kind`` stands alone.
    """
    if not isinstance(given, Mapping):
        return given
    if given.get("kind", getattr(default, "kind", None)) != getattr(default, "kind", None):
        return dict(given)
    filled = {name: getattr(default, name) for name in type(default).model_fields}
    for name, value in given.items():
        here = filled.get(name)
        filled[name] = over_default(here, value) if isinstance(here, Model) else value
    return filled


def or_own(protocol: type) -> WrapValidator:
    """Let a field that takes built-in models take any other object with a protocol's methods, as it is.

    A mapping whose ``kind`` is that of another model with those methods, a user's own too, is read as that model.
    """

    def validate(value: Any, built_in: ValidatorFunctionWrapHandler) -> Any:
        fits = isinstance(value, protocol)
        if fits and not isinstance(value, Model):
            return value
        try:
            return built_in(value)
        except ValidationError as error:
            if fits:
                return value
            kind = value.get("kind") if isinstance(value, Mapping) else None
            other = _of_kind(kind, protocol) if isinstance(kind, str) else None
            if other is None:
                raise
            try:
                return other(**value)
            except ParameterError:
                if error.errors(include_url=False)[0]["type"] in ("union_tag_invalid", "is_instance_of"):
                    raise
            raise  # a built-in model with a fault, which is told with its place

    return WrapValidator(validate)


def _of_kind(kind: str, protocol: type, base: type[Model] = Model) -> type[Model] | None:
    """Find the model of a kind with a protocol's methods, among all that have been imported."""
    methods = [name for name in vars(protocol) if not name.startswith("_")]
    for found in base.__subclasses__():
        if kind_of(found) == kind and all(hasattr(found, name) for name in methods):
            return found
        deeper = _of_kind(kind, protocol, found)
        if deeper is not None:
            return deeper
    return None


def read_yaml(path: str | Path) -> dict[str, Any]:
    """Read a YAML file that holds one mapping of parameters (an empty file is an empty mapping)."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
        data = yaml.safe_load(text)
        scalars = (token for token in yaml.scan(text) if isinstance(token, yaml.ScalarToken))
        nul = next((token.start_mark.line + 1 for token in scalars if "\0" in token.value), None)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        place = getattr(error, "problem_mark", None)
        where = f", line {place.line + 1}" if place is not None else ""
        raise DataError(f"{path}{where}: is not valid YAML; write one 'name: value' a line.") from None
    if nul is not None:
        raise DataError(f"{path}, line {nul}: holds a NUL, which no name and no value has; take it out.")
    if data is None:
        return {}
    if not isinstance(data, dict) or not all(isinstance(key, str) for key in data):
        raise DataError(f"{path}: must hold 'name: value' pairs, not {type(data).__name__}.")
    return data


def explain(error: ValidationError, model: type[BaseModel]) -> str:
    """Turn pydantic's report into one sentence a fault, with the nearest spelling of an unknown field."""
    sentences = []
    for fault in error.errors(include_url=False):
        where = ".".join(str(part) for part in (model.__name__, *fault["loc"]))
        cause = fault.get("ctx", {}).get("error")
        if isinstance(cause, ParameterError):
            sentences.append(str(cause))
        elif fault["type"] == "extra_forbidden":
            known = _fields_at(model, fault["loc"][:-1])
            near = difflib.get_close_matches(str(fault["loc"][-1]), known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"known are {', '.join(known)}."
            sentences.append(f"{where}: there is no such field; {hint}")
        else:
            message = fault["msg"].removeprefix("Value error, ").removeprefix("Input should be ").rstrip(".")
            must = "must be " if fault["msg"].startswith("Input should be ") else ""
            got = "" if fault["type"] in ("missing", "value_error") else f" (got {fault['input']!r:.80})"
            sentences.append(f"{where}: {must}{message}{got}.")
    return " ".join(sentences)


def _fields_at(model: type[BaseModel], location: tuple[int | str, ...]) -> list[str]:
    """Names of the fields of the model found by following a location from another model."""
    here: list[type[BaseModel]] = [model]
    for part in location:
        inner = [field for owner in here for name, field in owner.model_fields.items() if name == part]
        if inner:
            here = [found for field in inner for found in models_in(field.annotation)]
        else:
            tagged = [owner for owner in here if owner.__name__ == part or kind_of(owner) == part]
            here = tagged or here
    return [name for owner in here for name in owner.model_fields]


def kind_of(model: type[BaseModel]) -> str | None:
    """Return what tells a model from the others of its union; None if nothing does."""
    field = model.model_fields.get("kind")
    return None if field is None else str(field.default)


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """Every model class named in a type annotation (a union of models gives each)."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for inner in getattr(annotation, "__args__", ()) for found in models_in(inner)]
