"""From changes of links to tracks of people by way of an image: estimate, threshold, cluster, track, smooth.

Mendieta (2017), sections 3.8 to 3.12: stages 5 to 8 of the chain. New is what is done about multipath fading. Where
links fade, people change them from anywhere, by as much as the channels of a link differ in the empty room (Patwari and
Wilson, 2010, Proc. IEEE 98(11), 1961-1973; Rayleigh's fading: 5.6 dB). To an image of what stands on the line that is
noise of the links, and is counted as such: it is measured on the calibration, without any label. Where links fade,
fainter heads are left out and places are trusted less; by how much was chosen on simulated logs with fading.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, NonNegative, Positive
from elusive.preprocess.blobs import Clusters, Heads
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.projectors import Projector
from elusive.preprocess.threshold import Threshold, ThresholdState
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.link_tracks import LinkTrack
from elusive.systems.links.smoothing import KalmanSmoothing, SmoothedTrack, TrackSmoothing
from elusive.tracking.people import Entrance, Event
from elusive.tracking.people_hungarian import HungarianTracker, PeopleState
from elusive.tracking.people_radius import RadiusState, RadiusTracker

FADED_DB = 2.8  # deviation between channels above which links fade: half of Rayleigh's

AnyTracker = Annotated[HungarianTracker | RadiusTracker, Field(discriminator="kind")]


class ImageChainState(NamedTuple):
    """After a frame: what was seen, and who is where."""

    image: Array  # (V,) dB
    heads: Heads
    threshold: ThresholdState
    people: PeopleState | RadiusState
    smoothed: dict[int, SmoothedTrack]

    @property
    def events(self) -> tuple[Event, ...]:
        """What befell tracks in this frame."""
        return self.people.events

    @property
    def tracks(self) -> list[LinkTrack]:
        """The tracks; a deleted one is shown once as such. Existence is the share of latest frames with a head."""
        return [
            LinkTrack(
                one.track, one.status, sum(one.hits) / len(one.hits),
                *self.smoothed[one.track].position, *self.smoothed[one.track].velocity,
                *self.smoothed[one.track].deviation,
            )
            for one in self.people.tracks
        ]  # fmt: skip


class ImageMethod(Model):
    """Tracks by way of an image of the area."""

    kind: Literal["image"] = "image"
    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    weights: EllipseWeights = Field(EllipseWeights(), description="How voxels weigh on links")
    image: RegularisedImage = Field(RegularisedImage(), description="How the image is estimated")
    threshold: Threshold = Field(Threshold(), description="Which voxels are bright")
    clusters: Clusters = Field(Clusters(), description="How bright voxels become heads")
    tracker: AnyTracker = Field(HungarianTracker(), description="How heads become tracks")
    smoothing: TrackSmoothing = Field(KalmanSmoothing(), description="Filter behind each track")
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

    def on(self, nodes: RadioNodes, area: Area, interval_s: float = 1.0, empty_dbm: Array | None = None) -> ImageChain:
        """Prepare for a network: what costs much is done once, here.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        interval_s
            Time from frame to frame.
        empty_dbm
            ``(D, C)`` levels of the empty room, which say how much links fade; none: they do not.

        Raises
        ------
        ParameterError
            If the system of the image is too large.
        DataError
            If no link passes the area.
        """
        fading = self.fading_db
        if fading is None:
            fading = 0.0 if empty_dbm is None else channel_deviation(empty_dbm)
        image = self.image.replace(prior=self.image.prior.with_noise(fading))
        clusters, smoothing = self.clusters, self.smoothing
        if fading > FADED_DB:
            clusters = clusters.replace(sidelobe=max(clusters.sidelobe, self.faded_sidelobe))
            smoothing = smoothing.replace(place_sd_m=max(smoothing.place_sd_m, self.faded_place_sd_m))
        method = self.replace(image=image, clusters=clusters, smoothing=smoothing)
        return ImageChain(method, nodes, area, interval_s)


class ImageChain:
    """The stages on one network."""

    def __init__(self, method: ImageMethod, nodes: RadioNodes, area: Area, interval_s: float) -> None:
        self.grid = VoxelGrid.over(area, method.voxel_m)
        self.projector: Projector = method.image.projection(method.weights.sparse(nodes, self.grid), self.grid)
        width = method.tracker.entrance.width_m
        self._tracker = method.tracker.replace(entrance=Entrance(area=area, width_m=width))
        self._smoothing = method.smoothing.replace(interval_s=interval_s)
        self._threshold, self._clusters = method.threshold, method.clusters

    def init(self, empty: Array) -> ImageChainState:
        """Return the state before the first frame.

        Parameters
        ----------
        empty
            ``(T, L)`` changes of the links while nobody was there [dB].

        Raises
        ------
        DataError
            If there is none, or they show no noise at all.
        """
        if not len(empty):
            raise DataError("calibration: has no frame; give at least one in which nobody is there.")
        images = self.projector.images(empty)
        nothing = Heads(np.empty((0, 2)), np.empty(0))
        return ImageChainState(images[-1], nothing, self._threshold.init(images), self._tracker.init(), {})

    def step(self, state: ImageChainState, change: Array, rng: Generator) -> ImageChainState:
        """Return the state after a frame.

        Parameters
        ----------
        state
            After the frame before.
        change
            ``(L,)`` change of each undirected link [dB], NaN where it was not heard.
        rng
            Source of randomness of the smoothing.

        Raises
        ------
        DataError
            If there are not as many changes as links.
        """
        image = self.projector.image(change)
        heads = self._heads(change, image, state.threshold.level)
        people = self._tracker.step(state.people, heads.positions, heads.intensities)  # type: ignore[arg-type]
        places = {one.track: None if one.missed else np.array(one.position) for one in people.tracks}
        smoothed = self._smoothing.step(state.smoothed, places, rng)
        confirmed = [one for one in people.tracks if one.status == "confirmed"]
        seen = [one.intensity for one in confirmed if not one.missed]
        threshold = self._threshold.step(state.threshold, seen, len(confirmed))
        return ImageChainState(image, heads, threshold, people, smoothed)

    def _heads(self, change: Array, image: Array, level: float) -> Heads:
        """Where people may be, by the image of the changes."""
        return self._clusters.heads(image, self.grid, level, self.projector.gain)


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
