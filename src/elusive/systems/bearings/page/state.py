"""What one tab holds of bearings: the scene, its run, the run kept beside it, and where the still emitter was found."""

from __future__ import annotations

from elusive.systems.bearings.scene import BearingScene, Flown, Found
from elusive.workbench.side_by_side import TrackedState


class BearingsState(TrackedState[BearingScene, Flown]):
    """A change of the scene throws away where a still emitter was found; a run stays, with its scene."""

    def __init__(self) -> None:
        super().__init__(BearingScene())
        self.found: Found | None = None
        self.selected: set[str] = set()  # names of sensors

    def take(self, scene: BearingScene) -> BearingScene:
        """Take a changed scene; return it as it is kept.

        What is assumed of the bearings' noise follows what is set of it, until the two are told apart.
        """
        before = self.scene
        was, sigma = before.simulation.sensors.sigma_deg, scene.simulation.sensors.sigma_deg
        if before.tracking.sigma_deg == was != sigma:
            scene = scene.replace(tracking=scene.tracking.replace(sigma_deg=sigma))
        self.scene = scene
        if scene != before:
            self.found = None
        return scene
