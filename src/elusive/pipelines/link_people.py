"""From readings of links to tracks of people with a particle filter straight on the links, without an image."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.filters.link_belief import LinkPeopleState
from elusive.filters.link_people import LinkPeople
from elusive.io.areas import Area
from elusive.io.radio_network import RadioNodes
from elusive.model import Model, Positive
from elusive.pipelines.link_tracks import LinkTrack
from elusive.preprocess.link_calibration import Calibration
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.tracking.people import Entrance, Event, PersonTrack, Status, happened


class LinksChainState(NamedTuple):
    """After a frame: the belief, and who is shown; somebody no longer there is shown once as deleted."""

    frames: int
    belief: LinkPeopleState
    tracks: list[LinkTrack]
    shown: tuple[PersonTrack, ...]
    events: tuple[Event, ...]


class LinksMethod(Model):
    """Tracks straight on the links."""

    kind: Literal["links"] = "links"
    shadowing: LinkShadowing = Field(LinkShadowing(), description="How a person changes the readings")
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
            If the calibration is not this network's.
        """
        sensor = self.shadowing.links(nodes, calibration.mean_dbm, calibration.variance_db2, area.bounds_m)
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
            ``(D, C)`` change of each reading from the empty room [dB], NaN where missing; None: no frame came.
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If the frame is not of the calibration's links and channels.
        """
        belief = self._filter.step(state.belief, change, rng)
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
