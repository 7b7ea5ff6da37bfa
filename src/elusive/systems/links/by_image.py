"""From changes of links to tracks of people by way of an image: estimate, threshold, cluster, track, smooth.

Mendieta (2017), sections 3.8 to 3.12: stages 5 to 8 of the chain. New is what is done about multipath fading. Where
links fade, people change them from anywhere, by as much as the channels of a link differ in the empty room (Patwari and
Wilson, 2010, Proc. IEEE 98(11), 1961-1973; Rayleigh's fading: 5.6 dB). To an image of what stands on the line that is
noise of the links, and is counted as such: it is measured on the calibration, without any label. Where links fade,
fainter heads are left out and places are trusted less; by how much was chosen on simulated logs with fading.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Annotated, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, Flags
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess.binary_links import LinkTests
from elusive.preprocess.blobs import Clusters, Heads
from elusive.preprocess.fade_level import RssChange, RssState
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_settled import away_from
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.projectors import Projector
from elusive.preprocess.threshold import Threshold, ThresholdState
from elusive.preprocess.tomography import RegularisedImage
from elusive.sensors.link_shadowing import ROUNDING_SD_DB
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.smoothing import Beliefs, KalmanSmoothing, TrackSmoothing
from elusive.tracking.people import Entrance, PeopleState, TrackEvent, events_between
from elusive.tracking.people_hungarian import HungarianTracker
from elusive.tracking.people_radius import RadiusTracker
from elusive.tracking.track import Track

FADED_DB = 2.8  # deviation between channels above which links fade: half of Rayleigh's
GATE_SD = 4.0  # deviations of a place that a track's gate is wide at least, where links fade
NO_HEADS = Heads(np.empty((0, 2)), np.empty(0))

AnyTracker = Annotated[HungarianTracker | RadiusTracker, Field(discriminator="kind")]


class ImageState(NamedTuple):
    """After a frame: what was seen, and who is where."""

    image: Array  # (V,) dB, or log likelihood ratios
    level: float  # that its voxels had to exceed
    heads: Heads
    threshold: ThresholdState  # for the next frame
    people: PeopleState
    smoothed: Beliefs
    tracks: tuple[Track, ...]
    events: tuple[TrackEvent, ...]
    tests: LinkTests | None = None  # of links that decide by themselves

    @property
    def nobody(self) -> bool:
        """Whether nobody is tracked."""
        return not self.people.tracks


class Stages(Model):
    """The stages that a chain by way of an image has, however the image is made."""

    added: ClassVar[tuple[str, ...]] = ("score", "missed_frames")  # to a track

    weights: EllipseWeights = Field(EllipseWeights(), description="Voxels, and how they weigh on links")
    threshold: Threshold = Field(Threshold(), description="Which voxels are bright")
    tracker: AnyTracker = Field(HungarianTracker(), description="How heads become tracks")
    smoothing: TrackSmoothing = Field(KalmanSmoothing(), description="Filter behind each track")

    def measured(self, change: RssChange) -> RssChange:
        """Return how readings become the changes that the chain takes."""
        return change


class ImageMethod(Stages):
    """Tracks by way of an image of the area."""

    kind: Literal["image"] = "image"
    image: RegularisedImage = Field(RegularisedImage(), description="How the image is estimated")
    clusters: Clusters = Field(Clusters(), description="How bright voxels become heads")
    fading_db: NonNegative | None = Field(
        None,
        description="Deviation of a link's levels by multipath, further noise of the image; none: between the channels "
        "of the empty room's links, 0 with a single channel [dB]",
    )
    faded_sidelobe: float = Field(
        0.8, ge=0, lt=1, description="Share of the brightest voxel's value that a head must have where links fade"
    )
    faded_place_sd_m: Positive = Field(
        1.0, description="Least deviation of a place that the smoothing takes, where links fade [m]"
    )

    @property
    def described(self) -> str:
        """What the report says of the method."""
        return f"image of {self.weights.voxel_m:g} m voxels, tracker {self.tracker.kind!r}, {self.smoothing.kind}"

    def bind(self, nodes: RadioNodes, area: Area, empty: Calibration | None = None) -> ImageChain:
        """Prepare for a network: what costs much is done once, here.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        empty
            Levels of the empty room, which say how much links fade; none: they do not.

        Raises
        ------
        ParameterError
            If the system of the image is too large.
        DataError
            If no link passes the area.
        """
        fading = self.fading_db
        if fading is None:
            fading = 0.0 if empty is None else channel_deviation(empty.mean_dbm)
        image = self.image.replace(prior=self.image.prior.with_noise(fading))
        clusters, smoothing, tracker = self.clusters, self.smoothing, self.tracker
        if fading > FADED_DB:
            clusters = clusters.replace(sidelobe=max(clusters.sidelobe, self.faded_sidelobe))
            smoothing = smoothing.replace(place_sd_m=max(smoothing.place_sd_m, self.faded_place_sd_m))
            if isinstance(tracker, HungarianTracker):  # lest one person is many tracks
                tracker = tracker.replace(gate_m=max(tracker.gate_m, GATE_SD * self.faded_place_sd_m))
        bound = self.replace(image=image, clusters=clusters, smoothing=smoothing, tracker=tracker)
        return ImageChain(bound, nodes, area)


class StagesChain(ABC):
    """The stages on a network, from heads on."""

    def __init__(self, method: Stages, area: Area) -> None:
        self.grid = method.weights.grid(area)
        width = method.tracker.entrance.width_m
        self._tracker = method.tracker.replace(entrance=Entrance(area=area, width_m=width))
        self._smoothing, self._threshold = method.smoothing, method.threshold

    def seen(self, rss: RssState) -> Array:
        """Return what the chain takes of a frame, ``(L,)``: the change of each undirected link."""
        return rss.change

    def away(self, nodes: RadioNodes, places: Array) -> Flags:
        """Return which directed links ``(D,)`` run by nobody at places ``(P, 2)``."""
        return away_from(nodes, places)

    def shown(self, state: ImageState) -> tuple[Track, ...]:
        """Return the tracks that count; the thesis's tracker counts observations: those with a head, and the ended."""
        if isinstance(self._tracker, HungarianTracker):
            return state.tracks
        return tuple(one for one in state.tracks if one.status == "deleted" or not one.extra["missed_frames"])

    def init(self, empty: Array, rng: Generator) -> ImageState:
        """Return the state before the first frame.

        Parameters
        ----------
        empty
            ``(T, L)`` changes of the links while nobody was there [dB].
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If there is none, or they show no noise at all.
        """
        if not len(empty):
            raise DataError("calibration: has no frame; give at least one in which nobody is there.")
        images, tests = self._calibrated(empty, rng)
        threshold = self._threshold.init(images)
        return ImageState(images[-1], threshold.level, NO_HEADS, threshold, self._tracker.init(), {}, (), (), tests)

    def step(self, state: ImageState, time_s: float, change: Array, rng: Generator) -> ImageState:
        """Return the state after a frame.

        Parameters
        ----------
        state
            After the frame before.
        time_s
            Time of the frame.
        change
            ``(L,)`` change of each undirected link [dB], NaN where it was not heard.
        rng
            Source of randomness.

        Raises
        ------
        DataError
            If there are not as many changes as links, or time runs backwards.
        """
        image, heads = self._imaged(state, change, rng)
        people = self._tracker.step(state.people, time_s, heads.positions, heads.intensities)
        smoothed = self._smoothing.step(state.smoothed, people, rng)
        window = self._tracker.life.confirm_window or self._tracker.life.confirm_frames
        tracks = tuple(
            Track(
                person.track, person.life.status or "candidate", math.nan, smoothed[person.track].mean,
                smoothed[person.track].covariance, person.life.recent.bit_count() / min(person.frames, window),
                {"missed_frames": person.life.missed},
            )
            for person in people.tracks
        )  # fmt: skip
        events = events_between(time_s, state.tracks, tracks, self._tracker.entrance, self._tracker.near_within_m)
        confirmed = [person for person in people.tracks if person.life.status == "confirmed"]
        bright = [person.intensity for person in confirmed if not person.life.missed]
        threshold = self._threshold.step(state.threshold, bright, len(confirmed))
        return ImageState(
            image, state.threshold.level, heads, threshold, people, smoothed, tracks, tuple(events), state.tests
        )

    @abstractmethod
    def _calibrated(self, empty: Array, rng: Generator) -> tuple[Array, LinkTests | None]:
        """Images ``(T, V)`` of the empty room, and the tests of links that decide by themselves."""

    @abstractmethod
    def _imaged(self, state: ImageState, change: Array, rng: Generator) -> tuple[Array, Heads]:
        """Image ``(V,)`` of a frame, and the heads in it."""


class ImageChain(StagesChain):
    """The stages on a network, with its projection onto images."""

    def __init__(self, method: ImageMethod, nodes: RadioNodes, area: Area) -> None:
        super().__init__(method, area)
        self.projector: Projector = method.image.projection(method.weights.sparse(nodes, self.grid), self.grid)
        self._clusters = method.clusters

    def _calibrated(self, empty: Array, rng: Generator) -> tuple[Array, None]:
        heard, changes = np.isfinite(empty).any(axis=0), empty
        still = heard & (np.nan_to_num(empty).std(axis=0) == 0)
        if still.any() and (heard & ~still).any():  # what rounding alone makes of a link, lest any noise is a person
            floor = np.sqrt(3) * ROUNDING_SD_DB * rng.uniform(-1.0, 1.0, empty.shape)
            changes = empty + np.where(still, floor, 0.0)
        return self.projector.images(changes), None

    def _imaged(self, state: ImageState, change: Array, rng: Generator) -> tuple[Array, Heads]:
        image = self.projector.image(change)
        return image, self._clusters.heads(image, self.grid, state.threshold.level, self.projector.gain)


def channel_deviation(levels_dbm: Array) -> float:
    """Return the deviation of levels ``(D, C)`` between the channels of a link, over all links [dB].

    It is zero where no link was heard on two channels.
    """
    heard = np.isfinite(levels_dbm)
    count = heard.sum(axis=1, keepdims=True)
    mean = np.where(heard, levels_dbm, 0.0).sum(axis=1, keepdims=True) / np.maximum(count, 1)
    squares = (np.where(heard, levels_dbm - mean, 0.0) ** 2).sum()
    freedom = np.maximum(count - 1, 0).sum()
    return math.sqrt(squares / freedom) if freedom else 0.0
