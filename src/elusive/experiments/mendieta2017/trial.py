"""One run of Mendieta (2017), chapter 4: people drawn, tracked and scored (eqs. 4.1 to 4.7)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array, X, Y
from elusive.experiments.mendieta2017.scenario import MethodName, method_of
from elusive.metrics import clear_mot, gospa, identity, sightings, sightings_of
from elusive.model import Model, Positive
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.presets import FIRST
from elusive.systems.links.simulate import LinkSimulation, SimulatedLinks
from elusive.systems.links.smoothing import Beliefs, ParticleSmoothing

GATE_M = 2.0  # section 4.1
ESTIMATORS = ("head", "kalman", "particle")  # "simple tracking", tables 3.8 and 3.9
SHOWN = ("all", "confirmed")


class ChapterFour(Model):
    """A simulation and the tracker that sees it."""

    simulation: LinkSimulation = Field(FIRST, description="Paths, network, radiation (tables 4.1 and 4.2)")
    method: MethodName = Field("thesis", description="Who tracks")
    memory_frames: int | None = Field(None, ge=1, description="Tracking memory (table 4.5); none: as usual [frames]")
    radius_m: Positive | None = Field(None, description="Tracking radius (table 4.6); none: as usual [m]")


class Row(NamedTuple):
    """A track in a frame."""

    frame: int
    track: int
    confirmed: bool
    places: Array  # (3, 2) by each of ESTIMATORS [m]; NaN where a method has no such estimator


def trial(parameters: ChapterFour, rng: Generator) -> dict[str, Array | float | int]:
    """Draw a run, track it, score it.

    Returns
    -------
    dict
        ``targets``; ``misses``, ``false_positives``, ``mismatches``, ``mota``, ``idf1``, ``gospa_m`` ``(shown,)``, of
        all tracks and of the confirmed; ``mean_deviation_m``, ``max_deviation_m`` ``(estimator,)`` over the pairs that
        heads and all tracks make.
    """
    drawn, own = rng.spawn(2)  # so that every tracker sees the same run
    links = parameters.simulation.draw(drawn)
    return _scores(links.truth, list(_tracked(parameters, links, own)))


def _scores(places: Array, rows: list[Row]) -> dict[str, Array | float | int]:
    truth, frames = sightings_of(places), len(places)
    found: dict[str, list[float]] = {}
    deviations = np.full((2, len(ESTIMATORS)), np.nan)
    targets = 0
    for shown in SHOWN:
        chosen = [row for row in rows if row.confirmed or shown == "all"]
        tracks = sightings(
            np.array([row.frame for row in chosen], np.int64), np.array([row.track for row in chosen], np.int64),
            np.array([row.places[0] for row in chosen]).reshape(-1, 2),
        )  # fmt: skip
        mot = clear_mot(truth, tracks, GATE_M, frames)
        targets = int(mot.targets.sum())
        for name, value in (
            ("misses", mot.misses.sum()),
            ("false_positives", mot.false_positives.sum()),
            ("mismatches", mot.mismatches.sum()),
            ("mota", mot.mota),
            ("idf1", identity(truth, tracks, GATE_M).idf1),
            ("gospa_m", gospa(truth, tracks, GATE_M, 2.0, frames).distance.mean()),
        ):
            found.setdefault(name, []).append(float(value))
        if shown == "all" and len(mot.pairs):
            estimates = {(row.frame, row.track): row.places for row in chosen}
            apart = [estimates[frame, track] - places[frame, target] for frame, target, track in mot.pairs.tolist()]
            distances = np.linalg.norm(apart, axis=2)
            deviations = np.array([distances.mean(axis=0), distances.max(axis=0)])
    scores = {name: np.array(values) for name, values in found.items()}
    return scores | {"targets": targets, "mean_deviation_m": deviations[0], "max_deviation_m": deviations[1]}


def _tracked(parameters: ChapterFour, links: SimulatedLinks, rng: Generator) -> Iterator[Row]:
    """Yield the tracks; straight on the links the mean of a person's particles is the one estimator."""
    chain: Any = _chain(parameters.replace(simulation=parameters.simulation.replace(seed=0)).model_dump_json())
    particles: Beliefs = {}
    filter_, state = ParticleSmoothing(), chain.init(links.empty, rng)
    for frame, change in enumerate(links.changes):
        state = chain.step(state, frame * parameters.simulation.interval_s, change, rng)
        people = {}
        if isinstance(state, ImageState):
            particles = filter_.step(particles, state.people, rng)
            people = state.people.living
        for track in chain.shown(state):
            if track.status == "deleted":
                continue
            places = np.full((len(ESTIMATORS), 2), np.nan)
            places[0] = people[track.track].position if people else track.mean[[X, Y]]
            if people:
                places[1:] = track.mean[[X, Y]], particles[track.track].mean[[X, Y]]
            yield Row(frame, track.track, track.status == "confirmed", places)


@lru_cache(maxsize=8)
def _chain(parameters: str) -> Any:
    """Prepare a chain, once for each JSON of its parameters."""
    known = ChapterFour.model_validate_json(parameters)
    method = method_of(known.method, known.simulation, known.memory_frames, known.radius_m)
    return method.bind(known.simulation.bind().nodes, known.simulation.walks.area)


SCENARIO = Scenario(
    trial,
    ChapterFour,
    dict.fromkeys(("misses", "false_positives", "mismatches", "mota", "idf1", "gospa_m"), ("shown",))
    | {"mean_deviation_m": ("estimator",), "max_deviation_m": ("estimator",)},
)
