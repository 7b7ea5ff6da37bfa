"""From one decision a link to tracks of people: the image chain on fused decisions instead of changes.

Neyman and Pearson's test at each link, Chair and Varshney's (1986) fusion at the centre: see
:mod:`elusive.preprocess.binary_links`. Heads are taken one by one, as matching pursuit takes atoms (Mallat and Zhang,
1993, IEEE Trans. Signal Process. 41(12), 3397-3415): what the links near the likeliest place say is explained by who
is there, and the next is looked for in what the others say. Clusters of the image would also be the places where
links crossed that different people obstruct.
"""

from __future__ import annotations

import math
from typing import Any, Literal, cast

import numpy as np
from pydantic import Field
from scipy import sparse

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Model, Positive
from elusive.preprocess.binary_links import BinaryLinks, LinkTests
from elusive.preprocess.blobs import Clusters, Heads
from elusive.preprocess.link_weights import EllipseWeights
from elusive.preprocess.projectors import Projector
from elusive.preprocess.threshold import Threshold
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.by_image import AnyTracker, ImageChain, ImageChainState, ImageMethod
from elusive.systems.links.smoothing import KalmanSmoothing, TrackSmoothing
from elusive.tracking.people_hungarian import HungarianTracker

MOST_HEADS = 100


class DecisionImages:
    """Images of log likelihood ratios: what stands in a projector's place."""

    def __init__(self, links: BinaryLinks, tests: LinkTests, weights: Any) -> None:
        self.links, self.tests = links, tests
        self.held = sparse.csc_array(weights != 0, dtype=np.float64)  # whether a link's ellipse holds a voxel
        self.gain = np.ones(weights.shape[1])

    def image(self, decisions: Array) -> Array:
        """Return the image of ``(L,)`` decisions, ``(V,)``; of ``(T, L)``, ``(T, V)``."""
        return self.links.image(self.links.fuse(decisions, self.tests), self.held)

    images = image


class DecisionChain(ImageChain):
    """Stages 6 to 8 on decisions: 1 where somebody is in a link's way, else 0, NaN where none came."""

    def __init__(
        self,
        method: ImageMethod,
        nodes: RadioNodes,
        area: Area,
        links: BinaryLinks,
        tests: LinkTests,
        interval_s: float = 1.0,
    ) -> None:
        super().__init__(method, nodes, area, interval_s)
        weights = method.weights.sparse(nodes, self.grid)
        if len(tests.threshold) != weights.shape[0]:
            raise DataError(f"links: {len(tests.threshold)} have a test, the network {weights.shape[0]} links.")
        self._images = DecisionImages(links, tests, weights)
        self.projector = cast(Projector, self._images)

    def init(self, empty: Array) -> ImageChainState:
        """Return the state before the first frame.

        An empty room's ratios are below nought nearly everywhere. So its intensity is at least the logarithm of the
        number of voxels: of a ratio as great, less than one voxel is expected by chance.

        Parameters
        ----------
        empty
            ``(T, L)`` decisions while nobody was there.

        Raises
        ------
        DataError
            If there is none.
        """
        if not len(empty):
            raise DataError("calibration: has no frame; give at least one in which nobody is there.")
        images = self.projector.images(empty)
        start = self._threshold.init(np.maximum(images, math.log(images.shape[1])))
        return ImageChainState(images[-1], Heads(np.empty((0, 2)), np.empty(0)), start, self._tracker.init(), {})

    def _heads(self, change: Array, image: Array, level: float) -> Heads:
        """Take the likeliest place, what the links near it say away, and so on."""
        ratios = np.nan_to_num(self._images.links.fuse(change, self._images.tests))
        held, centres = self._images.held, self.grid.centres
        left = image.copy()
        places: list[Array] = []
        heights: list[float] = []
        while len(places) < MOST_HEADS:
            best = int(left.argmax())
            if left[best] <= level:
                break
            near = np.flatnonzero(((centres - centres[best]) ** 2).sum(axis=1) <= self._clusters.apart_m**2)
            likely = np.exp(left[near] - left[best])
            places.append(likely @ centres[near] / likely.sum())
            heights.append(float(left[best]))
            explained = np.unique(held[:, near].indices)
            taken = np.zeros(len(ratios))
            taken[explained] = ratios[explained]
            ratios[explained] = 0.0
            left -= held.T @ taken
        return Heads(np.array(places).reshape(-1, 2), np.array(heights))


class DecisionMethod(Model):
    """Tracks from one decision a link."""

    kind: Literal["binary"] = "binary"
    voxel_m: Positive = Field(0.5, description="Side of a voxel, 'precision' (table 3.2) [m]")
    weights: EllipseWeights = Field(EllipseWeights(), description="How voxels weigh on links")
    decisions: BinaryLinks = Field(BinaryLinks(), description="How a link decides that somebody is in its way")
    threshold: Threshold = Field(Threshold(), description="Which ratios are high")
    apart_m: Positive = Field(1.5, description="Links through a circle of this radius speak for one person [m]")
    tracker: AnyTracker = Field(HungarianTracker(), description="How heads become tracks")
    smoothing: TrackSmoothing = Field(KalmanSmoothing(), description="Filter behind each track")

    def on(self, nodes: RadioNodes, area: Area, tests: LinkTests, interval_s: float = 1.0) -> DecisionChain:
        """Prepare for a network whose links have been calibrated.

        Parameters
        ----------
        nodes
            The network.
        area
            Where people can be.
        tests
            Of each undirected link, from :meth:`BinaryLinks.calibrate` of ``decisions``.
        interval_s
            Time from frame to frame.

        Raises
        ------
        DataError
            If there are not as many tests as links, or no link passes the area.
        """
        method = ImageMethod(
            voxel_m=self.voxel_m, weights=self.weights, threshold=self.threshold,
            clusters=Clusters(apart_m=self.apart_m), tracker=self.tracker, smoothing=self.smoothing,
        )  # fmt: skip
        return DecisionChain(method, nodes, area, self.decisions, tests, interval_s)
