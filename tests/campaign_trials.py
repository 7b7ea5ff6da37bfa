"""Trials small enough to run by the hundred, at the top of a module so that other processes find them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.campaign.trials import stopping
from elusive.model import Model

HOLD = "ELUSIVE_TESTS_HOLD_TRIALS"


class Birth(Model):
    kind: Literal["box"] = "box"
    snr_db: float = Field(3.0, le=50.0)
    rate: float = 0.1


class Ring(Model):
    kind: Literal["ring"] = "ring"
    snr_db: float = 5.0
    radius: float = 1.0


class Noisy(Model):
    size: int = 3
    bias: float = 0.0
    birth: Birth | Ring = Field(Birth(rate=0.7), discriminator="kind")


def noisy(parameters: Noisy, rng: Generator) -> Mapping[str, Any]:
    draws = rng.standard_normal(parameters.size)
    return {"error": draws + parameters.birth.snr_db, "rms": float(np.sqrt(np.mean(draws**2))), "hits": draws > 0}


def held(parameters: Noisy, rng: Generator) -> Mapping[str, Any]:
    """Wait at the higher level for the campaign's end, where the surroundings say so."""
    if HOLD in os.environ and parameters.birth.snr_db > 2:
        stopping.wait()
    return noisy(parameters, rng)


def mapped(parameters: dict[str, Any], rng: Generator) -> Mapping[str, Any]:
    seen = parameters["level"]["value"]
    parameters["level"]["value"] = -1.0
    return {"seen": seen, "count": np.int32(rng.integers(1, 10))}


def fails_at_five(parameters: Noisy, rng: Generator) -> Mapping[str, Any]:
    if parameters.bias == 1.0 and rng.bit_generator.seed_seq.spawn_key == (5,):
        raise ZeroDivisionError("no particle is left")
    return noisy(parameters, rng)


def grows(parameters: Noisy, rng: Generator) -> Mapping[str, Any]:
    return {"error": np.zeros(3 + (rng.bit_generator.seed_seq.spawn_key >= (5,)))}


def says(parameters: dict[str, Any], rng: Generator) -> Any:
    return {"text": {"error": "far"}, "nothing": None, "name": {"my error": 1.0}, "axis": {"what": 1.0}}[
        parameters["what"]
    ]


def uneven(parameters: dict[str, Any], rng: Generator) -> Mapping[str, Any]:
    return {"error": np.zeros(3), "late": np.zeros(1)}


def dies(parameters: Noisy, rng: Generator) -> Mapping[str, Any]:
    os._exit(3)


scenario = Scenario(noisy, Noisy, {"error": ("time",), "hits": ("time",)})
number = 3
