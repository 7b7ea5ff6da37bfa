"""Options made from models: every field once, each where it belongs, and sentences for what contradicts itself."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Annotated, Any, Literal, get_args, get_origin

import pytest
import typer
from pydantic import Field

from elusive.cli import app
from elusive.cli.given import accepts, nested
from elusive.errors import ParameterError
from elusive.filters.particle.recorded import RecordedFrames
from elusive.model import FROM_RECORDING, Model
from elusive.options import MAIN, Option, options_of
from elusive.systems.images.track import ImageTracking

FILTER = ("filter",)
MOTION = ("filter", "motion", "motion")
BIRTH = ("filter", "birth")
SENSOR = ("filter", "sensor")


class Disc(Model):
    kind: Literal["disc"] = "disc"
    radius: float = Field(1.0, gt=0, description="Radius")
    rate: float = 0.5


class Ring(Model):
    kind: Literal["ring"] = "ring"
    inner: float = 1.0
    outer: float = 2.0
    rate: float = 0.25


class Holder(Model):
    kind: Literal["holder"] = "holder"
    shape: Annotated[Disc | Ring, Field(discriminator="kind")] = Ring()
    rate: float | None = None


class Bare(Model):
    kind: Literal["bare"] = "bare"
    shape: Annotated[Disc | Ring, Field(discriminator="kind")] = Disc()


class Whole(Model):
    holder: Annotated[Holder | Bare, Field(discriminator="kind")] = Field(Holder(rate=3.0), description="Who holds")
    rate: int = Field(7, description="[Hz]")
    size: int = Field(4, json_schema_extra=FROM_RECORDING)
    levels: tuple[float, ...] = (1.0, 2.0)
    pair: tuple[int, int] = (1, 2)
    quick: bool = False


def leaves(schema: dict[str, Any], definitions: dict[str, Any], path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Paths of the leaf fields, read from the JSON schema: the oracle, since it knows nothing of options."""
    several = schema.get("oneOf", schema.get("anyOf", []))
    if "$ref" in schema:
        yield from leaves(definitions[schema["$ref"].rpartition("/")[2]], definitions, path)
    elif any("$ref" in one for one in several):
        if "discriminator" in schema:
            yield (*path, "kind")
        for one in several:
            yield from leaves(one, definitions, path)
    elif "properties" in schema:
        for name, inner in schema["properties"].items():
            if name != "kind" and "from_recording" not in inner:
                yield from leaves(inner, definitions, (*path, name))
    else:
        yield path


def by_name(model: type[Model]) -> dict[str, Option]:
    return {option.name: option for option in options_of(model)}


def at(model: Any, path: tuple[str, ...]) -> Any:
    for part in path:
        model = getattr(model, part)
    return model


@pytest.mark.parametrize("model", [ImageTracking, Whole])
def test_every_leaf_becomes_an_option_once(model: type[Model]) -> None:
    schema = model.model_json_schema()
    expected = set(leaves(schema, schema.get("$defs", {}), ()))
    options = options_of(model)
    paths = [option.path for option in options]
    assert len(paths) == len(set(paths))
    assert set(paths) == expected
    names = [option.name for option in options]
    assert len(names) == len(set(names))


def test_the_models_of_the_test_have_the_options_one_would_write() -> None:
    options = by_name(Whole)
    assert {name: option.path for name, option in options.items()} == {
        "holder": ("holder", "kind"),
        "rate": ("rate",),
        "levels": ("levels",),
        "pair": ("pair",),
        "quick": ("quick",),
        "holder_rate": ("holder", "rate"),
        "shape": ("holder", "shape", "kind"),
        "radius": ("holder", "shape", "radius"),
        "shape_rate": ("holder", "shape", "rate"),
        "inner": ("holder", "shape", "inner"),
        "outer": ("holder", "shape", "outer"),
    }
    assert options["rate"].annotation is int
    assert options["quick"].annotation is bool
    assert options["levels"].annotation == list[float]
    assert options["pair"].annotation == tuple[int, int]
    assert options["holder_rate"].annotation is float
    assert get_args(options["shape"].annotation) == ("disc", "ring")
    assert options["holder_rate"].help.endswith("[default: 3.0]")  # of the model that stands there, not of its class
    assert options["levels"].help.endswith("[default: 1.0 2.0]")
    assert options["outer"].kinds == {("holder",): ("holder", "bare"), ("holder", "shape"): ("ring",)}


def candidates(annotation: Any) -> list[Any]:
    if get_origin(annotation) is Literal:
        return list(get_args(annotation))
    if annotation is int:
        return [1, 5, 7, 77]
    if annotation is float:
        return [0.013, 0.35, 0.58, 0.93, 3.5, 12.0]
    if annotation is bool:
        return [True, False]
    if get_origin(annotation) is list:
        values = candidates(get_args(annotation)[0])
        return [*([value] * 2 for value in values), values[:2]]  # some must rise
    assert get_origin(annotation) is tuple, annotation
    return [(a, b) for a in candidates(get_args(annotation)[0]) for b in candidates(get_args(annotation)[1])]


def flat(dump: Any, path: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    if not isinstance(dump, dict):
        return {path: dump}
    return {key: value for name, inner in dump.items() for key, value in flat(inner, (*path, name)).items()}


@pytest.mark.parametrize("option", options_of(ImageTracking), ids=lambda option: option.name)
def test_each_option_alone_changes_its_field_and_no_other(option: Option) -> None:
    # what tells of a target's intensity, or of a level, is refused where the sensor does not use it
    white = ("q_intensity", "amplitude_spread", "pedestal", "polarity")
    beside = {"sensor": "white"} if option.name in white else {}
    if option.path[0] in RecordedFrames.model_fields:  # the usual filter whitens in its finder
        beside = {"filter": "single"}
    usual = flat(ImageTracking(**nested(ImageTracking, beside, {})).model_dump())
    changed = 0
    for value in candidates(option.annotation):
        try:
            made = ImageTracking(**nested(ImageTracking, beside | {option.name: value}, {}))
        except ParameterError as error:
            assert option.path[-1] in str(error) or "levels must be in order" in str(error)  # noqa: PT017
            continue
        found = at(made, option.path)
        assert (list(found) if isinstance(value, list) else found) == value
        now = flat(made.model_dump())
        chosen = [union for union in option.kinds if now[(*union, "kind")] != usual.get((*union, "kind"))]
        if option.path[-1] == "kind" and value != usual.get(option.path):
            chosen.append(option.path[:-1])
        elsewhere = {path for path in now if not any(path[: len(union)] == union for union in chosen)} - {option.path}
        assert {path: now[path] for path in elsewhere} == {path: usual[path] for path in elsewhere}
        changed += now != usual
    assert changed > 0


@pytest.mark.parametrize(
    ("given", "path", "kind"),
    [
        ({"turn_rate_deg": 3.0}, MOTION, "ct"),
        ({"turn_rate_deg": 3.0, "q": 0.1}, MOTION, "ct"),  # those that fit several kinds follow
        ({"q_turn": 0.1}, MOTION, "ctrv"),
        ({"q": 0.1}, MOTION, "cv"),
        ({"motion": "ca", "q": 0.1}, MOTION, "ca"),
        ({"threshold": 1.0, "uniform_share": 0.2, "snr_db": 3.0}, BIRTH, "bright"),
        ({"newborns": 10}, FILTER, "several"),
        ({"initial_existence": 0.1}, FILTER, "single"),
        ({"snr_db": 8.0}, BIRTH, "frame"),
        ({"filter": "existence", "snr_db": 3.0}, BIRTH, "uniform"),  # that filter's own usual births
        ({"filter": "existence", "uniform_share": 0.2}, BIRTH, "bright"),
        # another filter looks at the same frames, as the pipeline has it
        ({"psf_sigma": 0.9}, SENSOR, "clutter"),
        ({"filter": "existence", "psf_sigma": 0.9}, SENSOR, "clutter"),
        ({"filter": "existence", "psf_sigma": 0.9, "noise_sigma": 2.0}, SENSOR, "white"),
        ({"filter": "existence", "lookalike": 0.002}, SENSOR, "clutter"),
        ({"sensor": "white", "q_intensity": 0.2, "amplitude_spread": 2.0}, SENSOR, "white"),
    ],
)
def test_options_choose_the_kind_that_has_them(given: dict[str, Any], path: tuple[str, ...], kind: str) -> None:
    made = ImageTracking(**nested(ImageTracking, given, {}))
    assert at(made, path).kind == kind
    options = by_name(ImageTracking)
    for name, value in given.items():
        assert at(made, options[name].path) == value


@pytest.mark.parametrize(
    ("given", "base", "sentence"),
    [
        (
            {"motion": "cv", "turn_rate_deg": 3.0},
            {},
            "^--turn-rate-deg: has no meaning for motion 'cv', only for ct; leave it out or choose --motion ct.$",
        ),
        (
            {"newborns": 3, "filter": "existence"},
            {},
            "^--newborns: has no meaning for filter 'existence', only for several, single; leave it out or",
        ),
        ({"threshold": 3.0, "birth": "uniform"}, {}, "^--threshold: has no meaning for birth 'uniform', only for brig"),
        ({"q_turn": 0.1, "turn_rate_deg": 3.0}, {}, "has no meaning for motion"),
        (
            {"turn_rate_deg": 3.0},
            {"filter": {"kind": "several", "motion": {"motion": {"kind": "ca"}}}},
            "^--turn-rate-deg: has no meaning for motion 'ca', only for ct",
        ),
        ({"snr_db": 3.0}, {"filter": 4}, "^filter: must be a mapping of parameters in the configuration .got 4."),
        ({"snr_db": 3.0}, {"filter": {"birth": None}}, "^birth: must be a mapping of parameters"),
    ],
)
def test_what_contradicts_itself_is_a_sentence(given: dict[str, Any], base: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        nested(ImageTracking, given, base)


def test_options_go_before_the_file_and_leave_the_rest_of_it() -> None:
    base = {
        "seed": 5,
        "filter": {"kind": "single", "particles": 77, "newborns": 33, "birth": {"kind": "bright", "threshold": 1.5}},
        "tracks": {"confirm_frames": 9},
    }
    before = repr(base)
    made = ImageTracking(**nested(ImageTracking, {"particles": 88, "threshold": None, "snr_db": 4.0}, base))
    assert repr(base) == before
    assert (made.seed, made.tracks.confirm_frames) == (5, 9)
    assert (made.filter.particles, made.filter.newborns) == (88, 33)
    assert made.filter.birth.model_dump(include={"kind", "threshold", "snr_db"}) == {
        "kind": "bright",
        "threshold": 1.5,
        "snr_db": 4.0,
    }


@pytest.mark.parametrize(
    "base",
    [
        {"filter": {"kind": "several", "particles": 77}},
        {"filter": {"kind": "several", "motion": {"motion": {"q": 0.5}}}},
        {"filter": {"kind": "existence", "birth": {"max_speed": 2.0}}},
        {"filter": {"kind": "several", "birth": {"max_speed": 2.0}}},
        {"filter": {"kind": "existence", "sensor": {"psf_sigma": 2.0}}},
    ],
)
def test_a_file_need_not_name_the_usual_kind(base: dict[str, Any]) -> None:
    given, usual = flat(base), ImageTracking(filter={"kind": base["filter"].get("kind", "several")})
    made = flat(ImageTracking(**nested(ImageTracking, {}, base)).model_dump())
    assert {path: value for path, value in made.items() if path in given} == given
    other = {path: value for path, value in flat(usual.model_dump()).items() if path not in given}
    assert {path: value for path, value in made.items() if path not in given and path in other} == other


@pytest.mark.parametrize(
    ("base", "sentence"),
    [
        ({"sead": 1}, "^ImageTracking.sead: there is no such field; did you mean 'seed'?"),
        (
            {"filter": {"kind": "several", "particels": 1}},
            "particels: there is no such field; did you mean 'particles'?",
        ),
        ({"filter": {"kind": "single", "birth": {"kind": "bright", "treshold": 1}}}, "did you mean 'threshold'?"),
        ({"filter": {"kind": "singel", "particles": 3}}, "filter: .*singel.*single"),
        ({"filter": {"kind": ["single"]}}, "filter"),
        (
            {"filter": {"kind": "several", "motion": {"motion": {"turn_rate_deg": 1.0}}}},
            "turn_rate_deg: there is no such field",
        ),
        (
            {"filter": {"kind": "several", "motion": {"q_intensity": 1.0}}},
            "^q_intensity: has no meaning for sensor 'clutter', which integrates the amplitude out; leave it out or "
            "choose sensor 'white'.$",
        ),
        (
            {"filter": {"kind": "single", "birth": {"amplitude_spread": 1.0}}},
            "^amplitude_spread: has no meaning for sensor 'clutter'",
        ),
        (
            {"filter": {"kind": "existence", "birth": {"kind": "uniform", "amplitude_spread": 1.0}}},
            "^amplitude_spread: has no meaning for sensor 'clutter'",
        ),
        (
            {"filter": {"kind": "several", "motion": {"q_intensity": -1.0}}},
            "q_intensity: must be greater than or equal to 0",
        ),
    ],
)
def test_a_file_with_a_fault_is_a_sentence(base: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        ImageTracking(**nested(ImageTracking, {}, base))


MODELS = [
    "systems.images.parameters:ImageTracking", "systems.signals.parameters:SignalTracking",
    "systems.radar.parameters:RadarTracking", "systems.links.track:LinkTracking", "systems.links.fit:LinkFitting",
    "systems.bearings.parameters:BearingTracking", "systems.images.simulate:ImageSimulation",
    "systems.signals.scene:SignalSimulation", "systems.radar.simulate:RadarSimulation",
    "systems.links.simulate:LinkSimulation", "systems.bearings.simulate:BearingSimulation",
    "systems.bearings.locate:EmitterLocation", "systems.radar.chart:ChartParameters",
]  # fmt: skip
UNITS = re.compile(r"_(m|s|px|samples|frames|db|dbm|hz|deg|rad|mrad|mps|mps2|mm)(_|$)")
# what has no unit says what it is
PURE = re.compile(
    r"probability|share|quantile|weight|existence|factor|times|multiple|power\b|exponent|relative|mean number|"
    r"degrees of freedom|amplitudes fall|\bP\b", re.IGNORECASE
)  # fmt: skip


def commands(group: Any, *words: str) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every command under a group, with the words that call it."""
    for name in group.commands:
        command = group.commands.get(name)
        if hasattr(command, "commands"):
            yield from commands(command, *words, name)
        else:
            yield (*words, name), command


def test_every_number_that_a_command_takes_says_its_unit() -> None:
    seen = 0
    for words, command in commands(typer.main.get_group(app)):
        for option in (taken for taken in command.params if taken.param_type_name == "option"):
            assert re.fullmatch(r"--[a-z0-9-]+", option.opts[0]), (words, option)
            if option.type_descriptor.annotation is float:
                text = option.help.replace("\\[", "[").partition("[default")[0]
                assert UNITS.search(option.opts[0].replace("-", "_")) or "[" in text or PURE.search(text), (
                    words,
                    option.opts,
                    text,
                )
                seen += 1
    assert seen > 200


@pytest.mark.parametrize("place", MODELS)
def test_help_shows_the_default_that_acts(place: str) -> None:
    module, _, name = place.partition(":")
    model: type[Model] = getattr(import_module(f"elusive.{module}"), name)
    options = options_of(model)
    choosers = {option.path[:-1]: option for option in options if option.path[-1] == "kind"}

    @cache  # of many options
    def chosen(union: tuple[str, ...], kind: str) -> Model:
        return model(**nested(model, {choosers[union].name: kind}, {}))

    seen = 0
    for option in options:
        # as a user chooses: each kind of the innermost union alone
        unions = list(option.kinds)
        for kind in option.kinds[unions[-1]] if unions else [""]:
            try:
                acts = at(chosen(unions[-1], kind) if unions else model(), option.path)
            except (ParameterError, AttributeError):
                continue  # that kind needs more to stand there
            if acts is not None and not isinstance(acts, Model):
                shown = " ".join(map(str, acts)) if isinstance(acts, tuple) else str(acts)
                assert re.search(rf"(: |; ){re.escape(shown)}[;\]]", option.help), (option.name, kind, option.help)
                seen += 1
    assert seen > len(options) / 2


@pytest.mark.parametrize("place", MODELS)
def test_what_matters_first_is_named_and_the_rest_stands_in_groups(place: str) -> None:
    module, _, name = place.partition(":")
    model: type[Model] = getattr(import_module(f"elusive.{module}"), name)
    options = options_of(model)
    main = [option.name for option in options if option.panel == MAIN]
    assert main == list(model.main_options)  # all of them, first and in their order
    assert len(main) <= 10
    assert main or len(options) < 20
    assert {option.path[0] for option in options if len(option.path) == 1 and option.name not in main} <= {
        option.path[0] for option in options if option.panel == "Parameters"
    }


def test_a_command_takes_the_options_and_is_handed_what_was_given() -> None:
    seen: list[Any] = []

    @accepts(Whole)
    def command(name: str, given: dict[str, Any]) -> None:
        """Do something."""
        seen.append((name, given))

    parameters = inspect.signature(command).parameters
    assert list(parameters) == ["name", *by_name(Whole)]
    assert all(parameters[name].default is None for name in by_name(Whole))
    command(name="n", **dict.fromkeys(by_name(Whole)) | {"radius": 2.0})
    assert seen == [("n", dict.fromkeys(by_name(Whole)) | {"radius": 2.0})]
    assert command.__doc__ == "Do something."
