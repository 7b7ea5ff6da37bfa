"""What one tab holds of radio tomography: the scene, what was drawn of it, the run, and the run kept beside it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.geometry.places import NamedPlace
from elusive.io.link_logs import open_link_log
from elusive.io.truth import Truth
from elusive.sensors.radio_network import RssFrame, directed_links_of
from elusive.systems.links.network import LEAST_HEARD
from elusive.systems.links.networks import PlacedNodes
from elusive.systems.links.presets import first_simulation
from elusive.systems.links.scene import LinkScene, Radiated, SceneRun
from elusive.systems.links.walks import DrawnPath
from elusive.workbench.files import read_upload
from elusive.workbench.jobs import Job

LOGS = (".csv", ".txt")
UNDONE = 50  # changes, at most


class Recorded(NamedTuple):
    """A log as it was sent, read anew with the nodes as they stand."""

    name: str
    data: bytes
    truth: Truth | None = None

    def frames(self, scene: LinkScene) -> list[RssFrame]:
        """Return its frames.

        Raises
        ------
        DataError
            If it is no log of the scene's nodes.
        """
        nodes = scene.simulation.network.bind(scene.area)
        frames = read_upload(self.name, self.data, LOGS, lambda path: list(open_link_log(path, nodes)))
        links = directed_links_of(len(nodes.names))
        seen = np.any([np.isfinite(frame.rss_dbm).any(axis=1) for frame in frames], axis=0)
        heard = len(np.unique(links[seen]))
        if heard < len(nodes.names) * LEAST_HEARD:
            raise DataError(
                f"{self.name}: holds links of {heard} of the {len(nodes.names)} sensors; open the log's own sensors "
                "under Sensors first."
            )
        return frames


class LinksState:
    """A change of the scene throws away paths and radiation that no longer follow from it; a run stays."""

    def __init__(self) -> None:
        self.scene = first_simulation()
        self.truth: Array | None = None  # (T, users, 2) [m]
        self.radiated: Radiated | None = None
        self.run: SceneRun | None = None  # with the scene that it is of
        self.run_log: Recorded | None = None  # that it is of, in place of a simulation
        self.kept: SceneRun | None = None  # to compare with
        self.radiation_spec: dict[str, Any] | None = None
        self.tracking_spec: dict[str, Any] | None = None
        self.log: Recorded | None = None  # in place of paths and radiation
        self.job: Job | None = None
        self.message = self.refused = ""  # what the latest run came to; why it was none
        self.step: str | None = None
        self.selected: set[str] = set()  # names of nodes
        self.before: list[tuple[LinkScene, Array | None]] = []  # scenes and paths, that can be had back
        self.shows_ellipses = False
        self.shows_coverage = False

    def take(self, scene: LinkScene) -> LinkScene:
        """Take a changed scene; return it as it is kept."""
        scene = scene.bound
        before, self.scene = self.scene, scene
        if scene != before:
            self.before = [*self.before, (before, self.truth)][-UNDONE:]
        if _paths_of(scene) != _paths_of(before):
            self.truth = None
        if self.truth is None or _radiation_of(scene) != _radiation_of(before):
            self._forget_radiation()
        return scene

    def undo(self) -> bool:
        """Take the scene and the paths before the latest change; False where there was none."""
        if not self.before:
            return False
        *rest, (scene, truth) = self.before
        self.take(scene)
        self.truth, self.before = truth, rest
        return True

    def record(self, log: Recorded | None) -> None:
        """Take a log in place of paths and radiation, or go back to them."""
        self.log = log

    @property
    def run_scene(self) -> LinkScene | None:
        """The scene of the run."""
        return None if self.run is None else self.run.scene

    def listed(self) -> tuple[NamedPlace, ...]:
        """Return the nodes one by one, whether placed by hand or by rule."""
        network = self.scene.simulation.network
        if isinstance(network, PlacedNodes):
            return network.places
        nodes = network.bind(self.scene.area)
        places = nodes.positions_m.tolist()
        return tuple(NamedPlace(name=name, x_m=x, y_m=y) for name, (x, y) in zip(nodes.names, places, strict=True))

    def simulate(self, **changes: Any) -> LinkScene:
        """Take a changed simulation; return the scene as it is kept."""
        return self.take(self.scene.replace(simulation=self.scene.simulation.replace(**changes)))

    def within(self, area: Area) -> None:
        """Take another area."""
        self.simulate(walks=self.scene.simulation.walks.replace(area=area))

    def add_path(self, places: Array, start: int) -> None:
        """Add a path that was drawn; paths that were made by rule stay as they are, one by one."""
        steps = self.scene.simulation.walks.total_positions
        drawn = DrawnPath(start=start, places_m=tuple(map(tuple, places[: max(1, steps - start)].tolist())))
        made = self.scene.simulation.paths if self.truth is None else _one_by_one(self.truth)
        self.truth = self.simulate(paths=(*made, drawn)).simulation.truth()

    def _forget_radiation(self) -> None:
        self.radiated = None
        self.radiation_spec = None


def _one_by_one(truth: Array) -> tuple[DrawnPath, ...]:
    paths = []
    for person in range(truth.shape[1]):
        there = np.flatnonzero(np.isfinite(truth[:, person, 0]))
        if len(there):
            paths.append(DrawnPath(start=int(there[0]), places_m=tuple(map(tuple, truth[there, person].tolist()))))
    return tuple(paths)


def _paths_of(scene: LinkScene) -> list[Any]:
    return [*scene.simulation.paths, scene.simulation.walks, scene.simulation.seed]


def _radiation_of(scene: LinkScene) -> list[Any]:
    simulation = scene.simulation
    return [simulation.radiation, simulation.weights.voxel_m, simulation.calibration_steps]
