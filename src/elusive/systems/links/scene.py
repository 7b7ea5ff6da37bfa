"""A scene of people in a radio network, complete in one file: paths, radiation, nodes and the way they are tracked.

Mendieta (2017), chapter 5: what the six windows hold. Paths and nodes are drawn by rule or listed one by one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.geometry.places import NamedPlace
from elusive.model import Model
from elusive.preprocess.link_weights import coverage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes, radio_nodes
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.smoothing import KalmanSmoothing, ParticleSmoothing

PATHS_AT_MOST, NODES_AT_MOST = 1000, 1000
VALUES_AT_MOST = 40_000_000  # steps times voxels: every frame of a scene is kept


class DrawnPath(Model):
    """One person's places, step by step from the step at which they come in."""

    start: int = Field(0, ge=0, description="Step of the first place, from 0")
    places_m: tuple[tuple[float, float], ...] = Field(min_length=1, description="x and y of each step [m]")


class LinkScene(Model):
    """Everything that a run of the workbench's radio tomography can be told."""

    system: Literal["links"] = Field("links", description="What kind of scene this is")
    simulation: LinkSimulation = Field(LinkSimulation(), description="Paths, network, radiation")
    paths: tuple[DrawnPath, ...] = Field(
        (), max_length=PATHS_AT_MOST, description="Paths drawn by hand; none: as the simulation's walks say"
    )
    nodes: tuple[NamedPlace, ...] | None = Field(
        None, max_length=NODES_AT_MOST, description="Nodes placed by hand; none: as the simulation's network says"
    )
    method: ImageMethod = Field(ImageMethod(), description="How people are tracked by way of an image")
    particle: ParticleSmoothing = Field(ParticleSmoothing(), description="Particle filter behind each track")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        steps = self.simulation.walks.total_positions
        for number, path in enumerate(self.paths, 1):
            last = path.start + len(path.places_m)
            if last > steps:
                raise ParameterError(
                    f"LinkScene.paths: path {number} ends at step {last}, the scene has {steps} steps; draw a shorter "
                    "path, or give more steps."
                )
        if steps * math.prod(self.grid.shape) > VALUES_AT_MOST:
            raise ParameterError(
                f"Walks.total_positions: {steps} steps of {math.prod(self.grid.shape)} voxels are more than a scene "
                f"keeps, {VALUES_AT_MOST}; give fewer steps or larger voxels."
            )
        if not isinstance(self.method.smoothing, KalmanSmoothing):
            raise ParameterError(
                "LinkScene.method.smoothing: must be a Kalman filter; the particle filter stands under 'particle'."
            )
        return self

    @property
    def area(self) -> Area:
        """The watched area."""
        return self.simulation.walks.area

    @property
    def grid(self) -> VoxelGrid:
        """The voxels of radiation and image."""
        return VoxelGrid.over(self.area, self.simulation.voxel_m)

    @property
    def with_entrance(self) -> LinkScene:
        """The same, where the area of the entrance is the watched one."""
        tracker = self.method.tracker
        if tracker.entrance.area is not None and tracker.entrance.area.corners_m == self.area.corners_m:
            return self
        entrance = tracker.entrance.replace(area=self.area)
        return self.replace(method=self.method.replace(tracker=tracker.replace(entrance=entrance)))

    def truth(self, rng: Generator) -> Array:
        """Return everybody's places, ``(T, users, 2)`` [m], NaN where absent."""
        if not self.paths:
            return self.simulation.walks.draw(rng)
        truth = np.full((self.simulation.walks.total_positions, len(self.paths), 2), np.nan)
        for number, path in enumerate(self.paths):
            truth[path.start : path.start + len(path.places_m), number] = path.places_m
        return truth

    def network(self) -> RadioNodes:
        """Return the nodes.

        Raises
        ------
        DataError
            If they are no network.
        """
        if self.nodes is None:
            return self.simulation.network.on(self.area)
        places = np.array([(one.x_m, one.y_m) for one in self.nodes]).reshape(-1, 2)
        return radio_nodes(places, [one.name for one in self.nodes])

    def streams(self) -> tuple[Generator, ...]:
        """Return the sources of paths, radiation, links and filters: a window repeats what the others leave alone."""
        return tuple(np.random.default_rng(self.simulation.seed).spawn(4))


class Radiated(NamedTuple):
    """What is there before any sensor."""

    truth: Array  # (T, users, 2) [m], NaN where absent
    empty: Array  # (K, V) images of the calibration's steps [dB]
    images: Array  # (T, V) [dB]


def radiate(scene: LinkScene, truth: Array | None = None) -> Radiated:
    """Draw the paths, unless given, and the radiation of every step."""
    paths, radiation, *_ = scene.streams()
    grid, source = scene.grid, scene.simulation.radiation
    truth = scene.truth(paths) if truth is None else truth
    nobody = np.full((scene.simulation.calibration_steps, 1, 2), np.nan)
    empty, images = (np.array([source.image(people, grid, radiation) for people in steps]) for steps in (nobody, truth))
    return Radiated(truth, empty, images)


def received(scene: LinkScene, weights: Any, images: Array, rng: Generator) -> Iterator[Array]:
    """Yield the changes ``(L,)`` of each step's links as the centre receives them [dB]."""
    for image in images:
        yield scene.simulation.quantiser.send(scene.simulation.radiation.links(image, weights, rng), rng)


class Coverage(NamedTuple):
    """How well the network sees the area."""

    links: Array  # (V,) number of links whose ellipse holds each voxel
    blind: int  # voxels in the area that none holds
    voxels: int  # in the area


def coverage_of(scene: LinkScene) -> Coverage:
    """Count the links that see each voxel.

    Raises
    ------
    DataError
        If the nodes are no network, or no link passes the area.
    """
    grid = scene.grid
    held = coverage(scene.simulation.weights.sparse(scene.network(), grid))
    return Coverage(held.astype(np.float64), int((held[grid.inside] == 0).sum()), int(grid.inside.sum()))
