"""People who walk through a radio network, as its links see them: changes, or a log of readings in dBm, with truth.

Mendieta (2017), sections 3.3 to 3.6: paths, radiation, links (eq. 3.10), quantisation and bit errors; received power
by the link budget (eqs. 3.1-3.2) less the change.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from elusive.contracts import Array
from elusive.geometry.areas import Area
from elusive.io.atomic import atomic_folder
from elusive.io.csv_files import write_csv
from elusive.io.path_truth import TRUTH_COLUMNS
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.quantiser import Quantiser
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.link_budget import LinkBudget
from elusive.sensors.radiation import Radiation
from elusive.sensors.radio_network import COLUMNS as NODE_COLUMNS
from elusive.sensors.radio_network import RadioNodes, RssFrame, directed_links_of, radio_nodes, undirected_of
from elusive.systems.links.coverage import write_coverage
from elusive.systems.links.networks import BorderNodes, Network
from elusive.systems.links.walks import Walks

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
    network: Network = Field(BorderNodes(), description="Where the nodes stand")
    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    weights: EllipseWeights = Field(EllipseWeights(), description="How voxels weigh on links")
    radiation: Radiation = Field(Radiation(), description="What people do to voxels and links, and the noise")
    quantiser: Quantiser = Field(Quantiser(), description="How changes are sent to the centre")
    budget: LinkBudget = Field(LinkBudget(), description="Level of a link with nobody there, of a log")
    fade_sd_db: NonNegative = Field(
        0.0, description="Deviation of each link's and channel's own level from the budget, of a log: multipath [dB]"
    )
    calibration_steps: int = Field(
        10, ge=1, le=1_000_000, description="Steps before the first, in which nobody is there (table 3.2)"
    )
    interval_s: Positive = Field(1.0, description="Time of a step, of a log [s]")
    seed: int = Field(0, ge=0, description="Root of all random numbers, of a log")

    def on(self) -> SimulatedNetwork:
        """Return the network, its grid and weights.

        Raises
        ------
        DataError
            If the nodes are no network, or no link passes the area.
        """
        nodes = self.network.on(self.walks.area)
        places = tuple(map(tuple, nodes.positions_m.tolist()))
        return SimulatedNetwork(nodes, *_weights(places, self.walks.area.corners_m, self.voxel_m, self.weights))

    def draw(self, rng: Generator) -> SimulatedLinks:
        """Draw the paths and what the centre receives of them: eq. 3.10, quantised, with bit errors.

        Parameters
        ----------
        rng
            Source of randomness. Paths are drawn first, so that they are the same whatever the network and the noise.

        Raises
        ------
        DataError
            As :meth:`on`.
        """
        network = self.on()
        truth = self.walks.draw(rng)
        empty, changes = (
            np.array([self._received(people, network, self.radiation, rng) for people in steps])
            for steps in (np.full((self.calibration_steps, 1, 2), np.nan), truth)
        )
        return SimulatedLinks(empty, changes, truth)

    def frames(self, truth: Array, rng: Generator) -> Iterator[RssFrame]:
        """Draw a log's frames, lazily: calibration, then a frame a step of the truth.

        Parameters
        ----------
        truth
            ``(T, users, 2)`` from :meth:`Walks.draw`.
        rng
            Source of randomness.

        Yields
        ------
        RssFrame
            ``(D, C)`` levels: the link budget's and each link's own, less the change, drawn for each direction and
            channel on its own. Both directions of a link have one level while nobody is there.
        """
        network = self.on()
        nodes, channels = network.nodes, self.radiation.channels
        first, second = nodes.positions_m[directed_links_of(len(nodes.names))].transpose(1, 0, 2)
        apart = np.hypot(*(first - second).T)
        budgets = [self.budget.replace(frequency_hz=frequency) for frequency in self.frequencies_hz]
        link = undirected_of(len(nodes.names))
        own = self.fade_sd_db * rng.standard_normal((network.weights.shape[0], channels))
        level = np.column_stack([budget.received_dbm(apart) for budget in budgets]) + own[link]
        one = self.radiation.replace(channels=1)
        up = directed_links_of(len(nodes.names))
        upwards = up[:, 0] < up[:, 1]
        nobody = np.full((self.calibration_steps, 1, 2), np.nan)
        for number, people in enumerate([*nobody, *truth]):
            image = self.radiation.image(people, network.grid, rng)
            change = np.empty(level.shape)
            for channel in range(channels):
                for way in (upwards, ~upwards):
                    sent = self.quantiser.send(one.links(image, network.weights, rng), rng)
                    change[way, channel] = sent[link[way]]
            yield RssFrame(number * self.interval_s, level - change)

    @property
    def frequencies_hz(self) -> list[float]:
        """Carrier of each channel."""
        return [self.budget.frequency_hz + CHANNEL_STEP_HZ * number for number in range(self.radiation.channels)]

    def _received(self, people: Array, network: SimulatedNetwork, radiation: Radiation, rng: Generator) -> Array:
        image = radiation.image(people, network.grid, rng)
        return self.quantiser.send(radiation.links(image, network.weights, rng), rng)


@lru_cache(maxsize=8)
def _weights(
    places: tuple[tuple[float, ...], ...],
    corners_m: tuple[tuple[float, float], ...],
    voxel_m: float,
    weights: EllipseWeights,
) -> tuple[VoxelGrid, Any]:
    grid = VoxelGrid.over(Area(corners_m=corners_m), voxel_m)
    return grid, weights.sparse(radio_nodes(np.array(places)), grid)


class LinkSimulated(NamedTuple):
    """What a simulated log came to."""

    rows: list[tuple[str, str]]


def simulate_links(
    parameters: LinkSimulation, out: Path, *, on_frame: Callable[[int], None] | None = None
) -> LinkSimulated:
    """Write ``log.csv``, ``nodes.csv``, ``truth.csv``, ``coverage.csv`` and ``.png``, and ``config.yaml``.

    The log has a frame a line, under the header ``time_s`` and ``tx-rx-channel``; channels are numbered from 0.

    Parameters
    ----------
    parameters
        What to simulate.
    out
        The folder; made if need be.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If the nodes are no network, no link passes the area, or a file cannot be written.
    """
    rng = np.random.default_rng(parameters.seed)
    network = parameters.on()
    truth = parameters.walks.draw(rng)
    nodes = network.nodes
    links = directed_links_of(len(nodes.names))
    channels = parameters.radiation.channels
    header = [
        "time_s", *(f"{nodes.names[tx]}-{nodes.names[rx]}-{c}" for tx, rx in links.tolist() for c in range(channels))
    ]  # fmt: skip
    present = np.isfinite(truth[..., 0])
    with atomic_folder(out) as folder:
        with (folder / "log.csv").open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(header)
            for number, frame in enumerate(parameters.frames(truth, rng), 1):
                writer.writerow([f"{frame.time_s:.6g}", *(f"{level:.2f}" for level in frame.rss_dbm.ravel())])
                if on_frame is not None:
                    on_frame(number)
        write_csv(folder / "nodes.csv", NODE_COLUMNS, zip(nodes.names, *nodes.positions_m.T.tolist(), strict=True))
        write_csv(folder / "truth.csv", TRUTH_COLUMNS, _truth_rows(parameters, truth, present))
        covered = write_coverage(folder, nodes, network.grid, network.weights)
        (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
    there = present.any(axis=1)
    return LinkSimulated(
        [
            ("Network", f"{len(nodes.names)} nodes, {len(links) // 2} links, {_counted(channels, 'channel')}"),
            ("Coverage", covered),
            ("Frames", f"{parameters.calibration_steps + len(truth)}, the first {parameters.calibration_steps} empty"),
            (
                "People",
                f"{truth.shape[1]}, at most {present.sum(axis=1).max()} at a time; somebody in "
                f"{_counted(int(there.sum()), 'frame')}",
            ),
        ]
    )


def _counted(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"


def _truth_rows(parameters: LinkSimulation, truth: Array, present: NDArray[np.bool_]) -> Iterator[tuple[object, ...]]:
    for step, person in np.argwhere(present):
        x, y = truth[step, person]
        yield f"{(parameters.calibration_steps + step) * parameters.interval_s:.6g}", person + 1, f"{x:.4f}", f"{y:.4f}"
