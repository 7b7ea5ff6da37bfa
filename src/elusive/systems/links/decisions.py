"""From one decision a link to tracks of people: the image chain on fused decisions instead of changes.

Neyman and Pearson's test at each link, Chair and Varshney's (1986) fusion at the centre: see
:mod:`elusive.preprocess.binary_links`. Heads are taken one by one, as matching pursuit takes atoms (Mallat and Zhang,
1993, IEEE Trans. Signal Process. 41(12), 3397-3415): what the links near the likeliest place say is explained by who
is there, and the next is looked for in what the others say. Clusters of the image would also be the places where
links crossed that different people obstruct.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.random import Generator
from pydantic import Field
from scipy import sparse

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import Positive
from elusive.preprocess.binary_links import BinaryLinks, LinkTests
from elusive.preprocess.blobs import Heads
from elusive.preprocess.link_calibration import Calibration
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.by_image import ImageState, Stages, StagesChain

MOST_HEADS = 100


class DecisionMethod(Stages):
    """Tracks from one decision a link."""

    kind: Literal["binary"] = "binary"
    decisions: BinaryLinks = Field(BinaryLinks(), description="How a link decides that somebody is in its way")
    apart_m: Positive = Field(1.5, description="Links through a circle of this radius speak for one person [m]")

    @property
    def described(self) -> str:
        """What the report says of the method."""
        ratios = f"one decision a link, ratios of {self.weights.voxel_m:g} m voxels"
        return f"{ratios}, tracker {self.tracker.kind!r}, {self.smoothing.kind}"

    def bind(self, nodes: RadioNodes, area: Area, empty: Calibration | None = None) -> DecisionChain:
        """Prepare for a network and an area, as :meth:`ImageMethod.bind`; levels of the empty room have no part in it.

        Raises
        ------
        DataError
            If no link passes the area.
        """
        return DecisionChain(self, nodes, area)


class DecisionChain(StagesChain):
    """The stages on a network whose links send 1 where somebody is in their way, else 0."""

    def __init__(self, method: DecisionMethod, nodes: RadioNodes, area: Area) -> None:
        super().__init__(method, area)
        self._links, self._apart_m = method.decisions, method.apart_m
        # whether a link's ellipse holds a voxel
        self._held = sparse.csc_array(method.weights.sparse(nodes, self.grid) != 0, dtype=np.float64)

    def _calibrated(self, empty: Array, rng: Generator) -> tuple[Array, LinkTests]:
        """Return the images of the empty room, and the links' tests.

        Its ratios are below nought nearly everywhere. So its intensity is at least the logarithm of the number of
        voxels: of a ratio as great, less than one voxel is expected by chance.
        """
        tests = self._links.calibrate(empty)
        ratios = self._links.fuse(self._links.decide(empty, tests, rng), tests)
        images = self._links.image(ratios, self._held)
        return np.maximum(images, math.log(images.shape[1])), tests

    def _imaged(self, state: ImageState, change: Array, rng: Generator) -> tuple[Array, Heads]:
        if state.tests is None:
            raise DataError("links: have no tests; begin with what init returns.")
        ratios = self._links.fuse(self._links.decide(change, state.tests, rng), state.tests)
        image = self._links.image(ratios, self._held)
        return image, self._heads(ratios, image, state.threshold.level)

    def _heads(self, ratios: Array, image: Array, level: float) -> Heads:
        """Take the likeliest place, what the links near it say away, and so on."""
        ratios, left, centres = np.nan_to_num(ratios), image.copy(), self.grid.centres
        places: list[Array] = []
        heights: list[float] = []
        while len(places) < MOST_HEADS:
            best = int(left.argmax())
            if left[best] <= level:
                break
            near = np.flatnonzero(((centres - centres[best]) ** 2).sum(axis=1) <= self._apart_m**2)
            likely = np.exp(left[near] - left[best])
            places.append(likely @ centres[near] / likely.sum())
            heights.append(float(left[best]))
            explained = np.unique(self._held[:, near].indices)
            taken = np.zeros(len(ratios))
            taken[explained] = ratios[explained]
            ratios[explained] = 0.0
            left -= self._held.T @ taken
        return Heads(np.array(places).reshape(-1, 2), np.array(heights))
