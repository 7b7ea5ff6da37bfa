"""People who walk through a radio network, as its links see them: changes, or a log of readings in dBm, with truth.

Mendieta (2017), sections 3.3 to 3.6: paths, radiation, links (eq. 3.10), quantisation and bit errors; received power
by the link budget (eqs. 3.1-3.2) less the change.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.io.truth import Truth
from elusive.model import FROM_RECORDING, Model, NonNegative, Positive
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.quantiser import Quantiser
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.link_budget import LinkBudget
from elusive.sensors.radiation import Radiation
from elusive.sensors.radio_network import RadioNodes, RssFrame, directed_links_of, radio_nodes, undirected_of
from elusive.systems.links.networks import BorderNodes, Network
from elusive.systems.links.walks import DrawnPath, Walks

PATHS_AT_MOST = 1000
CHANNEL_STEP_HZ = 5e6  # between neighbouring channels of IEEE 802.15.4


class SimulatedNetwork(NamedTuple):
    """A network over an area cut into voxels."""

    nodes: RadioNodes
    grid: VoxelGrid
    weights: Any  # sparse (L, V)


class SimulatedLinks(NamedTuple):
    """What the centre receives, and who truly was where."""

    empty: Array  # (K, L) changes of the calibration's steps, nobody there [dB]
    changes: Array  # (T, L) changes [dB]
    truth: Array  # (T, users, 2) x and y [m], NaN where absent


class LinkSimulation(Model):
    """Everything `elusive simulate links` can be told."""

    main_options: ClassVar[tuple[str, ...]] = (
        "users", "total_positions", "network", "nodes", "calibration_steps", "interval_s", "fade_sd_db",
        "amplitude_db", "link_noise_db", "seed",
    )  # fmt: skip

    walks: Walks = Field(Walks(), description="How people walk")
    paths: tuple[DrawnPath, ...] = Field(
        (), max_length=PATHS_AT_MOST, description="Paths drawn by hand; none: as the walks say",
        json_schema_extra=FROM_RECORDING,
    )  # fmt: skip
    network: Network = Field(BorderNodes(), description="Where the nodes stand")
    weights: EllipseWeights = Field(EllipseWeights(), description="Voxels, and how they weigh on links")
    radiation: Radiation = Field(Radiation(), description="What people do to voxels and links, and the noise")
    quantiser: Quantiser = Field(Quantiser(), description="How changes are sent to the centre")
    budget: LinkBudget = Field(LinkBudget(), description="Level of a link with nobody there, of a log")
    fade_sd_db: NonNegative = Field(
        0.0, description="Deviation of each link's and channel's own level from the budget, of a log: multipath [dB]"
    )
    calibration_steps: int = Field(
        10, ge=2, le=1_000_000, description="Steps before the first, in which nobody is there (table 3.2)"
    )
    interval_s: Positive = Field(1.0, description="Time of a step [s]")
    seed: int = Field(0, ge=0, description="Root of all random numbers, of a log")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        steps = self.walks.total_positions
        for number, path in enumerate(self.paths, 1):
            last = path.start + len(path.places_m)
            if last > steps:
                raise ParameterError(
                    f"LinkSimulation.paths: path {number} ends at step {last}, the scene has {steps} steps; draw a "
                    "shorter path, or give more steps."
                )
        return self

    def bind(self) -> SimulatedNetwork:
        """Return the network, its grid and weights.

        Raises
        ------
        DataError
            If the nodes are no network, or no link passes the area.
        """
        nodes = self.network.bind(self.walks.area)
        places = tuple(map(tuple, nodes.positions_m.tolist()))
        return SimulatedNetwork(nodes, *_weights(places, self.walks.area.corners_m, self.weights))

    def streams(self) -> tuple[Generator, ...]:
        """Return the sources of a log's paths, radiation and links: a change of one leaves what it follows on alone."""
        return tuple(np.random.default_rng(self.seed).spawn(3))

    def truth(self) -> Array:
        """Draw everybody's places of a log, ``(T, users, 2)`` [m], NaN where absent."""
        if not self.paths:
            return self.walks.draw(self.streams()[0])
        truth = np.full((self.walks.total_positions, len(self.paths), 2), np.nan)
        for number, path in enumerate(self.paths):
            truth[path.start : path.start + len(path.places_m), number] = path.places_m
        return truth

    def images(self, truth: Array) -> Iterator[Array]:
        """Draw the radiation ``(V,)`` of a log's steps, lazily: of the calibration's, then of the truth's [dB]."""
        rng, grid = self.streams()[1], self.weights.grid(self.walks.area)
        nobody = np.full((self.calibration_steps, 1, 2), np.nan)
        for people in [*nobody, *truth]:
            yield self.radiation.image(people, grid, rng)

    def draw(self, rng: Generator) -> SimulatedLinks:
        """Draw the paths and what the centre receives of them: eq. 3.10, quantised, with bit errors.

        Parameters
        ----------
        rng
            Source of randomness. Paths are drawn first, so that they are the same whatever the network and the noise.

        Raises
        ------
        DataError
            As :meth:`bind`.
        """
        network, truth = self.bind(), self.walks.draw(rng)
        received = []
        for people in [*np.full((self.calibration_steps, 1, 2), np.nan), *truth]:
            image = self.radiation.image(people, network.grid, rng)
            received.append(self.quantiser.send(self.radiation.links(image, network.weights, rng), rng))
        first, changes = self.calibration_steps, np.array(received)
        return SimulatedLinks(changes[:first], changes[first:], truth)

    def frames(self, images: Iterable[Array]) -> Iterator[RssFrame]:
        """Draw a log's frames, lazily.

        Parameters
        ----------
        images
            Of all steps, from :meth:`images`.

        Yields
        ------
        RssFrame
            ``(D, C)`` levels to .01 dB, as they are written: the link budget's and each link's own, less the change,
            drawn for each direction and channel on its own. Both directions of a link have one level while nobody is
            there.
        """
        network, rng = self.bind(), self.streams()[2]
        channels, way = self.radiation.channels, directed_links_of(len(network.nodes.names))
        first, second = network.nodes.positions_m[way].transpose(1, 0, 2)
        apart = np.hypot(*(first - second).T)
        budgets = [self.budget.replace(frequency_hz=frequency) for frequency in self.frequencies_hz]
        link = undirected_of(len(network.nodes.names))
        own = self.fade_sd_db * rng.standard_normal((network.weights.shape[0], channels))
        level = np.column_stack([budget.received_dbm(apart) for budget in budgets]) + own[link]
        alone = self.radiation.replace(channels=1)
        upwards = way[:, 0] < way[:, 1]
        for number, image in enumerate(images):
            change = np.empty(level.shape)
            for channel in range(channels):
                for directed in (upwards, ~upwards):
                    sent = self.quantiser.send(alone.links(image, network.weights, rng), rng)
                    change[directed, channel] = sent[link[directed]]
            yield RssFrame(number * self.interval_s, np.round(level - change, 2))

    @property
    def frequencies_hz(self) -> list[float]:
        """Carrier of each channel."""
        return [self.budget.frequency_hz + CHANNEL_STEP_HZ * number for number in range(self.radiation.channels)]


@lru_cache(maxsize=8)
def _weights(
    places: tuple[tuple[float, ...], ...], corners_m: tuple[tuple[float, float], ...], weights: EllipseWeights
) -> tuple[VoxelGrid, Any]:
    grid = weights.grid(Area(corners_m=corners_m))
    return grid, weights.sparse(radio_nodes(np.array(places)), grid)


def people_of(simulation: LinkSimulation, truth: Array) -> Truth | None:
    """Return who was where and when, from places ``(T, users, 2)`` of a simulation's steps; None: nobody."""
    paths = {}
    for person in range(truth.shape[1]):
        there = np.flatnonzero(np.isfinite(truth[:, person, 0]))
        if len(there):
            times_s = (simulation.calibration_steps + there) * simulation.interval_s
            paths[str(person + 1)] = np.column_stack([times_s, truth[there, person]])
    return Truth(tuple(paths), tuple(paths.values())) if paths else None
