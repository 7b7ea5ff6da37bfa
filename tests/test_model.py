"""Models: frozen, strict, spoken errors, and files that repeat a run."""

from __future__ import annotations

import subprocess
import sys
from typing import Literal

import numpy as np
import pytest
import shapely
from pydantic import Field

import elusive
from elusive import DataError, ElusiveError, ParameterError
from elusive.charts import ExactWater, IntervalWater
from elusive.experiments.amrouche2018.scenario import WeakTarget
from elusive.filters.particle.births import BrightBirth, MeasurementBirth, UniformBirth
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.geometry.areas import Area
from elusive.model import Model, Positive, Probability
from elusive.motion import (
    ConstantAcceleration,
    ConstantTurnRateVelocity,
    ConstantVelocity,
    CoordinatedTurn,
    MovingOrAnchored,
    WithCoastError,
    WithIntensity,
)
from elusive.sensors import RadarSensor, ScanPrior
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.image import ImageSensor
from tests.charts.shapes import land


class Lens(Model):
    """A small model."""

    focal_length_mm: Positive = 50.0
    transmission: Probability = 0.9


class Camera(Model):
    """A model that holds another."""

    lens: Lens = Lens()
    turns: tuple[float, ...] = ()
    pixels: int = Field(gt=0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"focal_lenght_mm": 3}, "Lens.focal_lenght_mm: there is no such field; did you mean 'focal_length_mm'?"),
        (
            {"colour": 1},
            "Lens.colour: there is no such field; known are focal_length_mm, transmission.",
        ),
        ({"focal_length_mm": -1}, "Lens.focal_length_mm: must be greater than 0 (got -1)."),
        ({"focal_length_mm": float("inf")}, "Lens.focal_length_mm: must be a finite number (got inf)."),
        ({"transmission": 1.5}, "Lens.transmission: must be less than or equal to 1 (got 1.5)."),
        ({"transmission": float("nan")}, "Lens.transmission: must be a finite number (got nan)."),
        (
            {"transmission": "much"},
            "Lens.transmission: must be a valid number, unable to parse string as a number (got 'much').",
        ),
    ],
)
def test_a_bad_parameter_is_answered_with_a_sentence(given, sentence):
    with pytest.raises(ParameterError) as caught:
        Lens(**given)
    assert str(caught.value) == sentence
    assert isinstance(caught.value, ElusiveError)
    assert isinstance(caught.value, ValueError)


def test_a_missing_parameter_and_two_faults_at_once_are_told():
    with pytest.raises(ParameterError, match=r"Camera\.pixels: Field required\."):
        Camera()
    with pytest.raises(ParameterError) as caught:
        Lens(focal_length_mm=0, transmission=2)
    assert "focal_length_mm" in str(caught.value)
    assert "transmission" in str(caught.value)


def test_a_misspelt_field_of_an_inner_model_is_told():
    with pytest.raises(ParameterError, match=r"there is no such field; did you mean 'transmission'\?"):
        Camera(pixels=3, lens={"transmision": 0.5})


def test_a_model_is_frozen():
    lens = Lens()
    with pytest.raises(ValueError, match="frozen"):
        lens.transmission = 0.5
    assert lens == Lens()
    assert hash(lens) == hash(Lens())


def test_a_changed_copy_is_checked_again():
    camera = Camera(pixels=8)
    assert camera.replace(pixels=9) == Camera(pixels=9)
    assert camera.pixels == 8
    with pytest.raises(ParameterError, match="greater than 0"):
        camera.replace(pixels=0)
    with pytest.raises(ParameterError, match="did you mean 'pixels'"):
        camera.replace(pixel=3)


@pytest.mark.parametrize(
    "model",
    [
        Camera(pixels=4, lens=Lens(transmission=0.1), turns=(0.1, 1e-300)),
        ImageSensor(rows=7, noise="rayleigh", swerling=1, psf_sigma=1 / 3),
        ConstantVelocity(q=0.0),
        CoordinatedTurn(turn_rate_deg=-3.7),
        ConstantAcceleration(),
        ConstantTurnRateVelocity(q_turn=1e-9),
        WithIntensity(motion=CoordinatedTurn(turn_rate_deg=1.0), q_intensity=0.2),
        UniformBirth(snr_db=3.18),
        BrightBirth(threshold=1.5),
        MeasurementBirth(uniform_share=0.3),
        WeakTarget(motion="ct", snr_db=12.0),
    ],
    ids=lambda model: type(model).__name__,
)
def test_a_file_repeats_the_model(model, tmp_path):
    file = tmp_path / "model.yaml"
    file.write_text(model.to_yaml(), encoding="utf-8")
    again = type(model).from_yaml(file)
    assert again == model
    assert again.to_yaml() == model.to_yaml()
    written = [line.split(":")[0] for line in model.to_yaml().splitlines() if line[0] not in " -"]
    assert written == list(type(model).model_fields)


def test_an_empty_file_gives_the_defaults(tmp_path):
    file = tmp_path / "empty.yaml"
    file.write_text("")
    assert Lens.from_yaml(file) == Lens()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"a: [1", r"line \d+: is not valid YAML; write one 'name: value' a line\."),
        (b"- 1\n- 2\n", r"must hold 'name: value' pairs, not list\."),
        (b"3: 4\n", r"must hold 'name: value' pairs"),
        (b"\xff\xfe\xfa", r"is not valid YAML"),
        (b'a: 1\nto: ["ndjson:a\\0b"]', r"line 2: holds a NUL"),
    ],
)
def test_a_file_that_is_no_mapping_is_refused_by_name(text, words, tmp_path):
    file = tmp_path / "bad.yaml"
    file.write_bytes(text)
    with pytest.raises(DataError, match=words) as caught:
        Lens.from_yaml(file)
    assert str(file) in str(caught.value)


def test_a_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(DataError, match=r"none\.yaml: cannot be read \(No such file or directory\); check the path\."):
        Lens.from_yaml(tmp_path / "none.yaml")


def test_import_alone_loads_nothing_heavy():
    heavy = ("numba", "matplotlib", "xarray", "scipy", "pydantic", "zarr")
    code = f"import sys, elusive; print([name for name in {heavy!r} if name in sys.modules])"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "[]"


def test_public_names_are_all_there():
    assert all(hasattr(elusive, name) for name in elusive.__all__)
    with pytest.raises(AttributeError, match="no attribute 'colect'"):
        _ = elusive.colect


def test_equal_fields_are_equal_whatever_has_been_computed_of_them():
    one, two = (Area.rectangle(0, 4, 0, 3) for _ in range(2))
    assert one.bounds_m == (0, 4, 0, 3)
    assert one.contains([[1.0, 1.0]]).all()
    assert one == two
    assert hash(one) == hash(two)
    assert one.__eq__(0) is NotImplemented
    assert one != Area.rectangle(0, 4, 0, 2)


class Buoy(ConstantVelocity):
    """A user's own motion, a model with a kind."""

    kind: Literal["buoy"] = "buoy"


class Current:
    """A user's own motion in plain Python."""

    state_names = ("x", "vx", "y", "vy")

    def propagate(self, states, interval_s, rng):
        return states


@pytest.mark.parametrize(
    "motion", [ConstantVelocity(q=0.5), MovingOrAnchored(), WithCoastError(motion=ConstantVelocity(q=2.0)), Buoy()]
)
def test_parts_are_read_back_by_their_kind(motion, tmp_path):
    d = len(motion.state_names)
    model = ParticleFilter(
        motion=motion,
        sensor=RadarSensor(range_sd_m=7.0),
        prior=GaussianPrior(mean=(0.0,) * d, covariance=np.eye(d).tolist()),
        knowledge=(FieldOfView(), IntervalWater(sigma_m=3.0)),
    )
    (tmp_path / "filter.yaml").write_text(model.to_yaml())
    assert ParticleFilter.from_yaml(tmp_path / "filter.yaml") == model


def test_what_no_file_can_say_is_named():
    prior = GaussianPrior(mean=(0.0,) * 4, covariance=np.eye(4).tolist())
    usual = {"motion": ConstantVelocity(), "sensor": RadarSensor(), "prior": prior}
    coast = ExactWater().bind(land(shapely.box(0, 0, 9, 9)))
    scan = RadarSensor().simulate(np.array([[5.0, 0, 900.0, 0]]), np.random.default_rng(0))
    for own, sentence in (
        (
            {"motion": Current()},
            "ParticleFilter.motion: holds a Current, which no file can say; keep the",
        ),
        ({"knowledge": (FieldOfView(), coast)}, f"ParticleFilter.knowledge: holds a {type(coast).__name__}, which no"),
        ({"motion": WithCoastError(motion=Current())}, r"ParticleFilter.motion.motion: holds a Current"),
        ({"prior": ScanPrior(RadarSensor(), scan)}, "ParticleFilter.prior: holds a ScanPrior"),
    ):
        with pytest.raises(ParameterError, match=sentence):
            ParticleFilter(**usual | own).to_yaml()
