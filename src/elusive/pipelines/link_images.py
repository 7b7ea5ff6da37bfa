"""From changes of links to tracks of people by way of an image: estimate, threshold, cluster, track, smooth.

Mendieta (2017), sections 3.8 to 3.12: stages 5 to 8 of the chain.
"""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.areas import Area
from elusive.io.radio_network import RadioNodes
from elusive.model import Model, Positive
from elusive.pipelines.link_tracks import LinkTrack
from elusive.pipelines.track_smoothing import KalmanSmoothing, SmoothedTrack, TrackSmoothing
from elusive.preprocess.blobs import Clusters, Heads
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.projectors import Projector
from elusive.preprocess.threshold import Threshold, ThresholdState
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.tracking.people import Entrance, Event
from elusive.tracking.people_hungarian import HungarianTracker, PeopleState
from elusive.tracking.people_radius import RadiusState, RadiusTracker

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

    def on(self, nodes: RadioNodes, area: Area, interval_s: float = 1.0) -> ImageChain:
        """Prepare for a network: what costs much is done once, here.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        interval_s
            Time from frame to frame.

        Raises
        ------
        ParameterError
            If the system of the image is too large.
        DataError
            If no link passes the area.
        """
        return ImageChain(self, nodes, area, interval_s)


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
