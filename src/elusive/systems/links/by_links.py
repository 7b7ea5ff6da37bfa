"""From readings of links to tracks of people with a particle filter straight on the links, without an image."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.filters.particle.link_belief import LinkPeopleState
from elusive.filters.particle.link_people import LinkPeople
from elusive.geometry.areas import Area
from elusive.model import Model, Positive
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.linear_links import LinkRadiation
from elusive.sensors.link_effects import AdditiveSensor
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.link_tracks import LinkTrack
from elusive.tracking.people import Entrance, Event, PersonTrack, Status, happened


class LinksChainState(NamedTuple):
    """After a frame: the belief, and who is shown; somebody no longer there is shown once as deleted."""

    frames: int
    belief: LinkPeopleState
    tracks: list[LinkTrack]
    shown: tuple[PersonTrack, ...]
    events: tuple[Event, ...]


class VoxelRadiation(LinkRadiation):
    """What a person does to voxels that links add up: the model of the thesis, and of simulated logs."""

    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    weights: EllipseWeights = Field(EllipseWeights(), description="How voxels weigh on links")


Effects = Annotated[LinkShadowing | VoxelRadiation, Field(discriminator="kind")]


class LinksMethod(Model):
    """Tracks straight on the links."""

    kind: Literal["links"] = "links"
    effect: Effects = Field(
        LinkShadowing(), description="How a person changes the readings: shadowing of real links, or radiation added up"
    )
    people: LinkPeople = Field(LinkPeople(), description="The filter")
    near_m: Positive = Field(1.0, description="Distance at which two people are said to be near [m]")

    def on(self, nodes: RadioNodes, area: Area, calibration: Calibration, interval_s: float) -> LinksChain:
        """Prepare for a network that has been calibrated.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        calibration
            What its links read while nobody was there.
        interval_s
            Time from frame to frame.

        Raises
        ------
        DataError
            If the calibration is not this network's, or no link passes the area.
        """
        effect = self.effect
        if isinstance(effect, VoxelRadiation):
            weights = effect.weights.sparse(nodes, VoxelGrid.over(area, effect.voxel_m))
            sensor: AdditiveSensor = effect.links(weights, area.bounds_m, effect.voxel_m)
        else:
            sensor = effect.links(nodes, calibration.mean_dbm, calibration.variance_db2, area.bounds_m)
        return LinksChain(self.people.replace(sensor=sensor, area=area), area, self.near_m, interval_s)


class LinksChain:
    """The filter on one network."""

    def __init__(self, people: LinkPeople, area: Area, near_m: float, interval_s: float) -> None:
        self._filter, self._near_m, self._interval_s = people, near_m, interval_s
        self._entrance = Entrance(area=area, width_m=near_m)

    def init(self, rng: Generator) -> LinksChainState:
        """Return the state before the first frame: nobody."""
        return LinksChainState(0, self._filter.init(rng), [], (), ())

    def step(self, state: LinksChainState, change: Array | None, rng: Generator) -> LinksChainState:
        """Return the state after a frame.

        Parameters
        ----------
        state
            After the frame before.
        change
            Change from the empty room [dB], NaN where missing: of each reading ``(D, C)``, or by radiation of each
            undirected link ``(L,)``; None: no frame came.
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If the frame is not of the calibration's links and channels.
        """
        belief = self._filter.step(state.belief, state.frames * self._interval_s, change, rng)
        now = {one.track: one for one in belief.tracks}
        before = {one.track: one for one in state.shown if one.status != "deleted"}
        shown, tracks = [], []
        for number in sorted({*now, *before}):
            if number in now:
                one = now[number]
                status: Status = one.status
                person = PersonTrack(number, status, one.position, one.velocity, (True,), 0, one.existence)
                sd = one.sd
            else:
                person, sd = before[number]._replace(status="deleted", intensity=0.0), (np.nan, np.nan)
            shown.append(person)
            (x, y), (vx, vy) = person.position, (part / self._interval_s for part in person.velocity)
            tracks.append(LinkTrack(number, person.status, person.intensity, x, y, vx, vy, *sd))
        events = happened(state.frames, before.values(), shown, self._entrance, self._near_m)
        return LinksChainState(state.frames + 1, belief, tracks, tuple(shown), tuple(events))
