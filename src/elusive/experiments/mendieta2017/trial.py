"""One run of Mendieta (2017), chapter 4: people drawn, tracked and scored (eqs. 4.1 to 4.7)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.campaign import Scenario
from elusive.contracts import Array
from elusive.experiments.mendieta2017.scenario import MethodName, image_method, links_filter
from elusive.metrics import clear_mot, gospa, identity, sightings, sightings_of
from elusive.model import Model, Positive
from elusive.preprocess.binary_links import BinaryLinks
from elusive.systems.links.by_image import ImageChain, ImageMethod
from elusive.systems.links.decisions import DecisionChain
from elusive.systems.links.presets import FIRST
from elusive.systems.links.simulate import LinkSimulation, SimulatedLinks
from elusive.systems.links.smoothing import ParticleSmoothing, SmoothedTrack

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
    rows = list((_straight if parameters.method == "links" else _by_image)(parameters, links, own))
    return _scores(links.truth, rows)


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


def _by_image(parameters: ChapterFour, links: SimulatedLinks, rng: Generator) -> Iterator[Row]:
    """Yield the tracks by way of an image.

    The thesis counts observations: a track that has no head in a frame is not shown. The default tracker shows where
    it takes its people to be.
    """
    method = image_method(parameters.method, parameters.memory_frames, parameters.radius_m)
    simulation = parameters.simulation
    method = method.replace(voxel_m=simulation.voxel_m, weights=simulation.weights)
    empty, changes = links.empty, links.changes
    if parameters.method == "binary":
        binary = BinaryLinks(bit_error_rate=simulation.quantiser.bit_error_rate)
        tests = binary.calibrate(empty)
        chain: ImageChain = DecisionChain(method, simulation.on().nodes, simulation.walks.area, binary, tests)
        empty, changes = binary.decide(empty, tests, rng), binary.decide(changes, tests, rng)
    else:
        chain = _chain(method.model_dump_json(), simulation.model_dump_json(include={"network", "walks"}))
    observed = parameters.method == "thesis"
    state = chain.init(empty)
    particles: dict[int, SmoothedTrack] = {}
    filter_ = ParticleSmoothing()
    for frame, change in enumerate(changes):
        state = chain.step(state, change, rng)
        heads = {one.track: None if one.missed else np.array(one.position) for one in state.people.tracks}
        particles = filter_.step(particles, heads, rng)
        for one in state.people.tracks:
            if one.status == "deleted" or (observed and one.missed):
                continue
            smoothed = (one.position, state.smoothed[one.track].position, particles[one.track].position)
            yield Row(frame, one.track, one.status == "confirmed", np.array(smoothed))


def _straight(parameters: ChapterFour, links: SimulatedLinks, rng: Generator) -> Iterator[Row]:
    """Yield the tracks straight on the links; the mean of a person's particles is the one estimator."""
    people = links_filter(parameters.simulation, parameters.simulation.on())
    state = people.init(rng)
    for frame, change in enumerate(links.changes):
        state = people.step(state, float(frame), change, rng)
        for one in state.tracks:
            places = np.full((len(ESTIMATORS), 2), np.nan)
            places[0] = one.position
            yield Row(frame, one.track, one.status == "confirmed", places)


@lru_cache(maxsize=8)
def _chain(method: str, simulation: str) -> ImageChain:
    """Prepare a chain, once for each JSON of a method and of the paths and network."""
    seen = LinkSimulation.model_validate_json(simulation)
    return ImageMethod.model_validate_json(method).on(seen.network.on(seen.walks.area), seen.walks.area)


SCENARIO = Scenario(
    trial,
    ChapterFour,
    dict.fromkeys(("misses", "false_positives", "mismatches", "mota", "idf1", "gospa_m"), ("shown",))
    | {"mean_deviation_m": ("estimator",), "max_deviation_m": ("estimator",)},
)
