"""From readings of links to tracks of people with a particle filter straight on the links, without an image."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import AdditiveSensor, Array, Flags, X, Y, interval_since
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, Positive, Probability
from elusive.motion.walk import Walk
from elusive.preprocess.fade_level import RssChange, RssState
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_settled import away_from
from elusive.sensors.field_of_view import FieldOfView
from elusive.sensors.linear_links import LinearLinks
from elusive.sensors.link_likeness import Likeness
from elusive.sensors.link_shadowing import LinkShadowing, ShadowedLinks
from elusive.sensors.radio_network import RadioNodes, undirected_of
from elusive.systems.links.radiation import VoxelRadiation
from elusive.systems.links.resting import NO_RESTS, Changed, Rests, after_frame, anew
from elusive.systems.links.unexplained import NOTHING, SOMEBODY, OneMore, Unexplained
from elusive.tracking.birth_density import AreaBirths
from elusive.tracking.people import Entrance, TrackEvent, events_between
from elusive.tracking.sought import LOUD
from elusive.tracking.superposed import FIRST_S, SuperposedTracker
from elusive.tracking.superposed_settings import SuperposedSettings
from elusive.tracking.superposed_state import SuperposedState
from elusive.tracking.track import Track

KEPT = 0.5  # share of the error of a place that is kept from frame to frame, while nobody is known
# while nobody is tracked: existence below which somebody is forgotten, of whom one frame of noisy radios tells little;
# and side of the cells in which such guesses come together, over that of those in which newcomers are looked for
FAINT, UNSEEN_CELLS = 1e-3, 2.0
NOBODY = 1e-6  # existence of whom the room was taken for
EMPTY_BELOW = 0.1  # existence of everybody below which the room is taken for empty


class LinksState(NamedTuple):
    """After a frame: the belief, and what befell the tracks."""

    belief: SuperposedState
    events: tuple[TrackEvent, ...]
    likeness: Likeness
    bias_m2: float  # variance on each axis of the site's bias of places
    learns: bool = True  # whether the likeness is learned: of shadowed links
    unexplained: Unexplained = NOTHING  # what the tracked people leave over
    by_chance: float = 0.0  # log likelihood, not tempered, that somebody gains where nobody is
    rests: Rests = NO_RESTS  # what is known of tracks, by their numbers, as far as the room may be what has changed
    changed: Changed | None = None  # that the room is
    second: float = math.nan  # log likelihood ratio, not tempered, of a second person in a frame, on average
    tells: float = math.nan  # the same of this frame's readings: tempered, less what errors that last bring

    @property
    def tracks(self) -> tuple[Track, ...]:
        """The tracks; their covariance holds what the site bends places by, their existence that of the room itself."""
        bias = np.zeros((4, 4))
        bias[X, X] = bias[Y, Y] = self.bias_m2
        nobody = {number: rest.nobody for number, rest in self.rests.items()}
        return tuple(
            track._replace(
                covariance=track.covariance + bias, existence=track.existence * (1 - nobody.get(track.track, 0.0))
            )
            for track in self.belief.tracks
        )

    @property
    def nobody(self) -> bool:
        """Whether nobody is there."""
        return all(target.existence < EMPTY_BELOW for target in self.belief.targets)


Effects = Annotated[LinkShadowing | VoxelRadiation, Field(discriminator="kind")]


class LinksMethod(Model):
    """Tracks straight on the links."""

    added: ClassVar[tuple[str, ...]] = ()  # to a track

    kind: Literal["links"] = "links"
    effect: Effects = Field(
        LinkShadowing(), description="How a person changes the readings: shadowing of real links, or radiation added up"
    )
    walk: Walk = Field(Walk(), description="How people walk")
    birth_probability: Probability = Field(0.016, description="Probability that somebody comes, in a second")
    birth_pitch_m: Positive = Field(0.4, description="Side of a cell in which newcomers are looked for [m]")
    people: SuperposedSettings = Field(
        SuperposedSettings(particles=500, death_probability=0.016, forget_below=0.02, separation=0.5),
        description="The filter; fainter guesses are kept while nobody is tracked",
    )
    near_m: Positive = Field(1.0, description="Distance at which two people are said to be near [m]")
    smooth: bool = Field(False, description="Places given what came later too; of a recorded log, which is read twice")

    @property
    def described(self) -> str:
        """What the report says of the method."""
        return f"particle filter on the links, {self.people.particles} particles a person"

    def measured(self, change: RssChange) -> RssChange:
        """Return how readings become the changes that the chain takes: of radiation, over undirected links, signed."""
        return change.replace(measure="loss") if isinstance(self.effect, VoxelRadiation) else change

    def bind(self, nodes: RadioNodes, area: Area, empty: Calibration | None = None) -> LinksChain:
        """Prepare for a network that has been calibrated.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        empty
            What its links read while nobody was there; radiation does without.

        Raises
        ------
        DataError
            If there is no calibration, it is not this network's, or no link passes the area.
        """
        effect = self.effect
        if isinstance(effect, VoxelRadiation):
            area = effect.within(nodes, area)
            sensor: AdditiveSensor = effect.on(nodes, area)
        elif empty is None:
            raise DataError("calibration: shadowing needs the levels of the empty room; calibrate on a log.")
        else:
            sensor = effect.links(nodes, empty.mean_dbm, empty.variance_db2)
        outside_m = float(area.depth_m(nodes.positions_m).min())
        return LinksChain(self.tracker(sensor, area), area, self.near_m, isinstance(effect, LinkShadowing), outside_m)

    def tracker(self, sensor: AdditiveSensor, area: Area) -> SuperposedTracker:
        """Return the tracker of people in an area through a sensor."""
        births = AreaBirths(
            area=area.bounds_m, speed_sd=self.walk.speed_sd_mps, birth_probability=self.birth_probability,
            pitch=self.birth_pitch_m, most=self.people.most_targets,
        )  # fmt: skip
        view = (FieldOfView(area=area),)
        return SuperposedTracker.of(self.people, motion=self.walk, sensor=sensor, birth=births, knowledge=view)


class LinksChain:
    """The filter on a network, whose outermost node is so deep in the area; people come in where they pass it."""

    def __init__(
        self, people: SuperposedTracker, area: Area, near_m: float, by_reading: bool, outside_m: float = 0.0
    ) -> None:
        self._filter, self._near_m, self._by_reading = people, near_m, by_reading
        self._entrance = Entrance(area=area, width_m=max(near_m, outside_m + near_m / 2))
        self._first = people  # while nobody is tracked
        self._one_more: OneMore | None = None
        if isinstance(people.sensor, ShadowedLinks) and isinstance(people.birth, AreaBirths):
            within_m = UNSEEN_CELLS * (people.birth.pitch or 0.0)
            self._first = people.replace(forget_below=min(people.forget_below, FAINT), unseen_within=within_m)
            self._one_more = OneMore(people.sensor, people.birth.components[0], area, people.separation)

    def seen(self, rss: RssState) -> Array:
        """Return what the chain takes of a frame: the rise of each reading ``(D, C)``, or each undirected loss."""
        return rss.rise_db if self._by_reading else rss.change

    def away(self, nodes: RadioNodes, places: Array) -> Flags:
        """Return which directed links ``(D,)`` people at places ``(P, 2)`` do not change."""
        sensor = self._filter.sensor
        if isinstance(sensor, LinearLinks):
            return sensor.spared(places)[undirected_of(len(nodes.names))]
        return away_from(nodes, places)

    def shown(self, state: LinksState) -> tuple[Track, ...]:
        """Return the tracks that count: all."""
        return state.tracks

    def init(self, empty: Array, rng: Generator) -> LinksState:
        """Return the state before the first frame: nobody.

        Parameters
        ----------
        empty
            ``(K, ...)`` changes of the frames in which nobody was there [dB], as :meth:`seen` gives them.
        rng
            Source of randomness.
        """
        state = LinksState(self._filter.init(rng), (), Likeness(), 0.0, isinstance(self._filter.sensor, ShadowedLinks))
        if self._one_more is None:
            return state
        return state._replace(by_chance=self._one_more.by_chance(empty), second=self._one_more.second())

    def anew(self, state: LinksState) -> LinksState:
        """Return the state once changes are told from the levels of the room as it is now."""
        assert isinstance(self._filter.sensor, ShadowedLinks)
        assert state.changed is not None
        nobody = [
            target._replace(existence=NOBODY) if target.life.track in state.changed.tracks else target
            for target in state.belief.targets
        ]
        state = state._replace(belief=state.belief._replace(targets=tuple(nobody)))
        return state._replace(rests=anew(state.rests, state.belief.time_s, self._filter.sensor.unheard.shape))

    def init_from(self, state: LinksState) -> LinksState:
        """Return the state of another effect's chain as one of this chain: who is there stays."""
        return LinksState(state.belief, (), Likeness(), 0.0, isinstance(self._filter.sensor, ShadowedLinks))

    def step(self, state: LinksState, time_s: float, change: Array | None, rng: Generator) -> LinksState:
        """Return the state after a frame.

        Parameters
        ----------
        state
            After the frame before.
        time_s
            Time of the frame.
        change
            Change from the empty room [dB], NaN where missing, as :meth:`seen` gives it; None: no frame came.
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If the frame is not of the calibration's links and channels, or time runs backwards.
        """
        sensor, likeness, bias_m2, unexplained = self._filter.sensor, state.likeness, 0.0, NOTHING
        # beside somebody a site's errors last, and would add up to one more: OneMore looks for those
        alone = all(target.existence <= LOUD for target in state.belief.targets)
        people = self._first if alone else self._filter
        rests, changed, tells = state.rests, None, math.nan
        if not isinstance(sensor, ShadowedLinks) or change is None:
            belief = people.step(state.belief, time_s, change, rng)
        else:
            interval_s = FIRST_S if math.isnan(state.belief.time_s) else interval_since(state.belief.time_s, time_s)
            kept = self._kept(state.belief, interval_s)
            tempered = sensor.tempered(change, likeness, kept, state.by_chance)
            belief = people.step(state.belief, time_s, tempered, rng)
            sure = [track.mean for track in belief.tracks if track.status == "confirmed"]
            if sure and self._one_more is not None:
                unexplained = self._one_more.sought(state.unexplained, belief, tempered)
                if unexplained.likely:  # lest somebody who is not tracked is taken for an odd site
                    sure.append(np.array([unexplained.place[0], 0.0, unexplained.place[1], 0.0]))
                likeness = sensor.likeness_after(likeness, change, np.array(sure))
                if unexplained.summed > SOMEBODY and len(belief.targets) < self._filter.most_targets:
                    n = self._filter.particles
                    belief = self._one_more.joined(belief, unexplained, tempered.temper, n, rng)
                    unexplained = unexplained._replace(summed=0.0)
            else:
                likeness = likeness._replace(last=None)
            tells = tempered.temper * (state.second - tempered.optimism)
            rests, changed = after_frame(state.rests, belief.targets, sensor, change, time_s)
        if isinstance(sensor, ShadowedLinks):
            bias_m2 = sensor.bias_variance(likeness)
        events = events_between(time_s, state.belief.tracks, belief.tracks, self._entrance, self._near_m)
        return state._replace(
            belief=belief, events=tuple(events), likeness=likeness, bias_m2=bias_m2, unexplained=unexplained,
            rests=rests, changed=changed, tells=tells,
        )  # fmt: skip

    def _kept(self, belief: SuperposedState, interval_s: float) -> float:
        """Return the share of readings' errors in places that the filter keeps until the next frame.

        What it has not lost, as far as people are there: a place where hardly anybody is has no error of theirs.
        """
        known = [target for target in belief.targets if target.existence > LOUD]
        walk = self._filter.motion
        if not known or not isinstance(walk, Walk):
            return KEPT
        F, Q = walk.moments(interval_s)
        shares = np.array([target.existence for target in known])
        before = np.tensordot(shares, [target.covariance for target in known], 1)
        ahead = F @ before @ F.T + shares.sum() * Q
        there = float(shares @ shares / shares.sum())
        return there * float((before[X, X] + before[Y, Y]) / (ahead[X, X] + ahead[Y, Y]))
