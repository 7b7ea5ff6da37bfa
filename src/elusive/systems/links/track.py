"""From the log of a radio network to the tracks of the people who walk through it; a live stream and a file alike.

Mendieta (2017), chapter 3: calibrate on an empty room, then track by way of an image, of one decision a link, or
straight on the links.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import Annotated, ClassVar, NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from elusive.contracts import Array, X, Y
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, NonNegative
from elusive.preprocess.fade_level import RssChange, RssState
from elusive.preprocess.link_calibration import Calibrate, Calibration
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.by_links import LinksMethod, VoxelRadiation
from elusive.systems.links.decisions import DecisionMethod
from elusive.systems.links.link_tracks import LinkTrack
from elusive.tracking.people import Event

__all__ = ["DecisionMethod", "ImageMethod", "LinkResult", "LinkTracking", "LinksMethod", "track_links"]

EMPTY_BELOW = 0.1  # existence of everybody below which the room is taken for empty
AnyMethod = Annotated[LinksMethod | ImageMethod | DecisionMethod, Field(discriminator="kind")]


class LinkResult(NamedTuple):
    """What is known after a frame."""

    time_s: float
    tracks: list[LinkTrack]
    events: tuple[Event, ...]
    grid: VoxelGrid | None  # of the image; None straight on the links
    image: Array | None  # (V,) dB
    clouds: dict[int, Array]  # by track, (N, 2) places of equal weight; straight on the links only
    remarks: tuple[str, ...]  # of the calibration, with its frames only


class LinkTracking(Model):
    """How people are tracked through a radio network."""

    main_options: ClassVar[tuple[str, ...]] = (
        "method", "effect", "calibration_frames", "voxel_m", "particles", "most_people", "birth_probability",
        "confirm_frames", "q", "seed",
    )  # fmt: skip

    method: AnyMethod = Field(
        LinksMethod(), description="Straight on the links, by way of an image, or of one decision a link"
    )
    calibration_frames: int = Field(
        20, ge=2, description="First frames, in which nobody is there: the links are calibrated on them"
    )
    calibrate: Calibrate = Field(Calibrate(), description="What is said of a calibration")
    change: RssChange = Field(RssChange(), description="How readings become changes, and how the calibration follows")
    margin_m: NonNegative = Field(
        0.5, description="How far people can be outside of the nodes, where no area is given [m]"
    )
    area: Area | None = Field(
        None, description="Where people can be; none: between the nodes", json_schema_extra=FROM_RECORDING
    )
    seed: int = Field(1, ge=0, description="Root of all random numbers")

    def area_of(self, nodes: RadioNodes) -> Area:
        """Return where people can be."""
        if self.area is not None:
            return self.area
        (x0, y0), (x1, y1) = (
            nodes.positions_m.min(axis=0) - self.margin_m,
            nodes.positions_m.max(axis=0) + self.margin_m,
        )
        return Area.rectangle(float(x0), float(x1), float(y0), float(y1))

    def described(self, nodes: RadioNodes) -> list[tuple[str, str]]:
        """Return what the report says of the parameters."""
        links = len(nodes.names) * (len(nodes.names) - 1) // 2
        rows = [("Network", f"{len(nodes.names)} nodes, {links} links")]
        method = self.method
        if not isinstance(method, LinksMethod):
            seen = "image" if isinstance(method, ImageMethod) else "one decision a link, ratios"
            return [
                *rows,
                ("Method", f"{seen} of {method.voxel_m:g} m voxels, tracker {method.tracker.kind!r}"),
                ("Smoothing", method.smoothing.kind),
            ]
        return [*rows, ("Method", f"particle filter on the links, {method.people.particles} particles a person")]


def track_links(frames: Iterable[RssFrame], nodes: RadioNodes, parameters: LinkTracking) -> Iterator[LinkResult]:
    """Track people through a radio network's frames, lazily.

    The results of the calibration's frames come together, once the last of them has been seen.

    Parameters
    ----------
    frames
        In the order of time.
    nodes
        The network.
    parameters
        What to do.

    Yields
    ------
    LinkResult
        One a frame.

    Raises
    ------
    DataError
        If a frame cannot be used, or the calibration takes all frames.
    """
    stream = iter(frames)
    empty = list(islice(stream, parameters.calibration_frames))
    calibration = parameters.calibrate.over(empty)
    interval_s = float(np.median(np.diff([frame.time_s for frame in empty])))
    rng = np.random.default_rng(parameters.seed)
    first = next(stream, None)
    if first is None:
        raise DataError(
            f"calibration_frames: the log has {len(empty)} frames, all of them taken for calibration; take fewer."
        )
    network = _Network(nodes, parameters.area_of(nodes), calibration, empty, interval_s)
    method = parameters.method
    after = chain([first], stream)
    if isinstance(method, ImageMethod):
        results = _by_image(after, method, network, parameters.change, rng)
    elif isinstance(method, DecisionMethod):
        results = _by_decisions(after, method, network, parameters.change, rng)
    else:
        results = _by_links(after, method, network, parameters.change, rng)
    started = next(results)  # what cannot be used is refused before anything is given out
    for frame in empty:
        yield LinkResult(frame.time_s, [], (), None, None, {}, calibration.remarks)
    yield started
    yield from results


class _Network(NamedTuple):
    """A network that has been calibrated."""

    nodes: RadioNodes
    area: Area
    calibration: Calibration
    empty: list[RssFrame]  # frames that it was calibrated on
    interval_s: float


def _by_image(
    frames: Iterable[RssFrame], method: ImageMethod, network: _Network, changing: RssChange, rng: Generator
) -> Iterator[LinkResult]:
    """Yield what an image of each frame leads to."""
    stages = method.on(network.nodes, network.area, network.interval_s, network.calibration.mean_dbm)
    rss, empty = _calibrated(network, changing)
    state = stages.init(empty)
    for frame in frames:
        rss = changing.step(rss, frame, empty=not state.people.tracks)
        state = stages.step(state, rss.change, rng)
        yield LinkResult(frame.time_s, state.tracks, state.events, stages.grid, state.image, {}, ())


def _by_decisions(
    frames: Iterable[RssFrame], method: DecisionMethod, network: _Network, changing: RssChange, rng: Generator
) -> Iterator[LinkResult]:
    """Yield what the fused decisions of each frame lead to; the image is one of log likelihood ratios."""
    rss, empty = _calibrated(network, changing)
    tests = method.decisions.calibrate(empty)
    stages = method.on(network.nodes, network.area, tests, network.interval_s)
    state = stages.init(method.decisions.decide(empty, tests, rng))
    for frame in frames:
        rss = changing.step(rss, frame, empty=not state.people.tracks)
        state = stages.step(state, method.decisions.decide(rss.change, tests, rng), rng)
        yield LinkResult(frame.time_s, state.tracks, state.events, stages.grid, state.image, {}, ())


def _calibrated(network: _Network, changing: RssChange) -> tuple[RssState, Array]:
    """Return the state before the first frame, and the changes ``(T, L)`` of the calibration's own frames."""
    rss = changing.init(network.calibration)
    before, changes = rss, []
    for frame in network.empty:
        before = changing.step(before, frame, empty=True)
        changes.append(before.change)
    return rss, np.array(changes)


def _by_links(
    frames: Iterable[RssFrame], method: LinksMethod, network: _Network, changing: RssChange, rng: Generator
) -> Iterator[LinkResult]:
    """Yield what the filter on the links says after each frame."""
    stages = method.on(network.nodes, network.area, network.calibration, network.interval_s)
    rss = changing.init(network.calibration)
    state = stages.init(rng)
    summed = isinstance(method.effect, VoxelRadiation)  # over undirected links, with a sign
    loss = changing.replace(measure="loss")
    for frame in frames:
        change = loss.step(rss, frame).change if summed else frame.rss_dbm - rss.calibration.mean_dbm
        state = stages.step(state, change, rng)
        clouds = {one.track: one.particles[:, [X, Y]] for one in state.belief.tracks}
        yield LinkResult(frame.time_s, state.tracks, state.events, None, None, clouds, ())
        nobody = all(one.existence < EMPTY_BELOW for one in state.belief.people)
        rss = changing.step(rss, frame, empty=nobody)
