"""A scene of people in a radio network, complete in one file: paths, radiation, nodes and the way they are tracked.

Mendieta (2017), chapter 5: what the six windows hold. The log that is simulated is tracked as any other is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.geometry.areas import Area
from elusive.io import existing_folder
from elusive.io.link_logs import open_link_log
from elusive.io.truth import Truth
from elusive.model import Model
from elusive.preprocess.link_weights import coverage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RssFrame
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.recording import simulate_links
from elusive.systems.links.results import LinkOutcome, LinkRun
from elusive.systems.links.run import track_links_recording
from elusive.systems.links.simulate import LinkSimulation, people_of
from elusive.systems.links.smoothing import Beliefs, ParticleSmoothing
from elusive.systems.links.track import LinksMethod, LinkTracking, track
from elusive.tracking.track import Step

VALUES_AT_MOST = 40_000_000  # steps times voxels: every frame of a scene is kept


class LinkScene(Model):
    """Everything that a run of the workbench's radio tomography can be told."""

    system: Literal["links"] = Field("links", description="What kind of scene this is")
    simulation: LinkSimulation = Field(LinkSimulation(), description="Paths, network, radiation")
    tracking: LinkTracking = Field(LinkTracking(), description="How people are tracked")
    particle: ParticleSmoothing = Field(
        ParticleSmoothing(), description="Particle filter shown beside the smoothing behind each track"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        steps, voxels = self.simulation.walks.total_positions, math.prod(self.grid.shape)
        if steps * voxels > VALUES_AT_MOST:
            raise ParameterError(
                f"Walks.total_positions: {steps} steps of {voxels} voxels are more than a scene keeps, "
                f"{VALUES_AT_MOST}; give fewer steps or larger voxels."
            )
        return self

    @property
    def area(self) -> Area:
        """The watched area."""
        return self.simulation.walks.area

    @property
    def grid(self) -> VoxelGrid:
        """The voxels of radiation and image."""
        return self.simulation.weights.grid(self.area)

    @property
    def bound(self) -> LinkScene:
        """The same, where the tracker watches the simulation's area, by its voxels."""
        method: Any = self.tracking.method
        weights = self.simulation.weights
        if not isinstance(method, LinksMethod):
            method = method.replace(weights=weights)
        elif method.effect.kind == "radiation":
            method = method.replace(effect=method.effect.replace(weights=weights))
        return self.replace(tracking=self.tracking.replace(method=method, area=self.area))

    @property
    def calibrated(self) -> LinkTracking:
        """How the simulated log is tracked: calibrated on the steps in which nobody is there."""
        return self.bound.tracking.replace(calibration_frames=self.simulation.calibration_steps)


class Radiated(NamedTuple):
    """What is there before any sensor."""

    truth: Array  # (T, users, 2) [m], NaN where absent
    images: Array  # (K + T, V) of the calibration's steps, then of the truth's [dB]


def radiate(scene: LinkScene, truth: Array | None = None) -> Radiated:
    """Draw the paths, unless given, and the radiation of every step."""
    truth = scene.simulation.truth() if truth is None else truth
    return Radiated(truth, np.array(list(scene.simulation.images(truth))))


class SceneRun(NamedTuple):
    """A scene or a recorded log, and what became of it."""

    scene: LinkScene
    tracking: LinkTracking  # as it was run
    truth: Truth | None
    images: Array | None  # (T, V) of the steps after calibration [dB]; None of a recorded log
    steps: tuple[Step, ...]  # after calibration; their states are those of the people alone
    particles: tuple[Beliefs, ...]  # of each step, where people are tracked by heads
    outcome: LinkOutcome
    tables: tuple[str, str]  # tracks and events, as CSV


def run_scene(
    scene: LinkScene, radiated: Radiated | None = None, *, on_frame: Callable[[int], None] | None = None
) -> SceneRun:
    """Draw the log of a scene and track its people.

    Parameters
    ----------
    scene
        Complete: equal scenes give equal runs.
    radiated
        From :func:`radiate` with the same scene; by default it is drawn here.
    on_frame
        Called with the number of frames done. What it raises ends the run.

    Raises
    ------
    DataError
        If the nodes are no network, no link passes the area, or the empty area shows no noise to calibrate on.
    """
    radiated = radiate(scene) if radiated is None else radiated
    simulation = scene.simulation
    run = run_log(
        scene, simulation.frames(radiated.images), scene.calibrated, people_of(simulation, radiated.truth),
        on_frame=on_frame,
    )  # fmt: skip
    return run._replace(images=radiated.images[simulation.calibration_steps :])


def run_log(
    scene: LinkScene,
    log: Iterable[RssFrame],
    tracking: LinkTracking,
    truth: Truth | None = None,
    *,
    name: str = "log.csv",
    on_frame: Callable[[int], None] | None = None,
) -> SceneRun:
    """Track people through a log of a scene's nodes, every step kept.

    Parameters
    ----------
    scene
        Its paths and radiation have no part in it.
    log
        All frames.
    tracking
        How.
    truth
        Where people truly were; scores only.
    name
        Of the log.
    on_frame
        Called with the number of frames done. What it raises ends the run.

    Raises
    ------
    DataError
        If the calibration takes all frames, or a frame is not of the scene's nodes.
    """
    nodes = scene.simulation.network.bind(scene.area)
    rng = np.random.default_rng(tracking.seed)
    steps: list[Step] = []
    particles: list[Beliefs] = []
    with LinkRun(name, nodes, tracking, truth) as run:
        for number, step in enumerate(track(log, nodes, tracking), 1):
            run.append(step)
            people = step.state.people
            if not step.state.calibrating:
                if isinstance(people, ImageState):
                    particles.append(scene.particle.step(particles[-1] if particles else {}, people.people, rng))
                    people = people._replace(image=people.image.astype(np.float32))
                steps.append(step._replace(measurement=None, state=people))  # the room's levels are large
            if on_frame is not None:
                on_frame(number)
        tables = run.log.csv_text(), run.events_text()
        return SceneRun(scene, tracking, truth, None, tuple(steps), tuple(particles), run.outcome(), tables)


def track_scene(scene: LinkScene, out: Path, *, on_frame: Callable[[int], None] | None = None) -> LinkOutcome:
    """Simulate a scene's log into ``recording``, track it as any other, and write ``scene.yaml``.

    Parameters
    ----------
    scene
        What to run.
    out
        Folder for the results.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If the scene cannot be run, or a file cannot be written.
    """
    network, tracking = scene.simulation.bind(), scene.calibrated
    folder = existing_folder(out)
    simulate_links(scene.simulation, folder / "recording")
    log = open_link_log(str(folder / "recording" / "log.csv"), network.nodes)
    truth = people_of(scene.simulation, scene.simulation.truth())
    outcome = track_links_recording(log, network.nodes, tracking, folder, truth=truth, on_frame=on_frame)
    (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    return outcome


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
    network = scene.simulation.bind()
    held = coverage(network.weights)
    inside = network.grid.inside
    return Coverage(held.astype(np.float64), int((held[inside] == 0).sum()), int(inside.sum()))
