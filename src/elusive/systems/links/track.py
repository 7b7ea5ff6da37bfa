"""From the log of a radio network to the tracks of the people who walk through it; a live stream and a file alike.

Mendieta (2017), chapter 3: calibrate on an empty room, then track by way of an image, of one decision a link, or
straight on the links.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from elusive.contracts import Flags, X, Y
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.model import FROM_RECORDING, Model, NonNegative
from elusive.preprocess.fade_level import RssChange, RssState
from elusive.preprocess.link_calibration import Calibrate
from elusive.preprocess.voxels import VoxelGrid
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_image import ImageMethod, ImageState
from elusive.systems.links.by_links import LinksMethod, LinksState
from elusive.systems.links.decisions import DecisionMethod
from elusive.systems.links.live_site import LiveSite, Look
from elusive.systems.links.network import refuse_impossible
from elusive.systems.links.site import Voxels
from elusive.tracking.memory import Memory
from elusive.tracking.people import TrackEvent
from elusive.tracking.track import Step

__all__ = ["DecisionMethod", "ImageMethod", "LinkTracking", "LinksMethod", "RoomState", "track"]

AnyMethod = Annotated[LinksMethod | ImageMethod | DecisionMethod, Field(discriminator="kind")]


class RoomState(NamedTuple):
    """After a frame: what is known of the room, and of who is in it."""

    rss: RssState
    people: ImageState | LinksState
    calibrating: bool  # whether the frame is one in which nobody was there
    site: str = ""  # what the frames have said of the site

    @property
    def events(self) -> tuple[TrackEvent, ...]:
        """What befell tracks in this frame."""
        return self.people.events

    @property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say of the calibration and the site."""
        return (*self.rss.calibration.remarks, *([self.site] if self.site else []))


class LinkTracking(Model):
    """How people are tracked through a radio network."""

    main_options: ClassVar[tuple[str, ...]] = (
        "method", "effect", "calibration_frames", "voxel_m", "particles", "most_targets", "birth_probability",
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
    fit_frames: int = Field(
        200,
        ge=0,
        le=10_000,
        description="Frames of a recorded log that the effect is fitted to before it is tracked, where none is given; "
        "0: none",
    )
    margin_m: NonNegative = Field(
        1.5, description="How far people can be outside of the nodes, where no area is given [m]"
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

    def grid_of(self, nodes: RadioNodes) -> VoxelGrid | None:
        """Return the voxels of the images; None straight on the links."""
        return None if isinstance(self.method, LinksMethod) else self.method.weights.grid(self.area_of(nodes))

    def described(self, nodes: RadioNodes) -> list[tuple[str, str]]:
        """Return what the report says of the parameters."""
        links = len(nodes.names) * (len(nodes.names) - 1) // 2
        return [("Network", f"{len(nodes.names)} nodes, {links} links"), ("Method", self.method.described)]


def track(
    frames: Iterable[RssFrame], nodes: RadioNodes, parameters: LinkTracking, memory: Memory | None = None
) -> Iterator[Step]:
    """Track people through a radio network's frames, lazily.

    The steps of the calibration's frames come together, once a further frame has been seen.

    Parameters
    ----------
    frames
        In the order of time.
    nodes
        The network.
    parameters
        What to do.
    memory
        Where the state is kept, and gone on from.

    Yields
    ------
    Step
        One a frame; its state is a :class:`RoomState`.

    Raises
    ------
    DataError
        If a frame cannot be used, or the calibration takes all frames.
    """
    memory = memory or Memory()
    stream = memory.new(frames)
    if memory.held is not None:
        yield from _followed(stream, nodes, parameters, memory)
        return
    empty = list(islice(stream, parameters.calibration_frames))
    changing = parameters.method.measured(parameters.change)
    rss = calibrated = changing.init(parameters.calibrate.over(empty))
    refuse_impossible(nodes, rss.calibration.mean_dbm, [frame.time_s for frame in empty])
    stages: Any = parameters.method.bind(nodes, parameters.area_of(nodes), rss.calibration)
    changes = []
    alone = rss.calibration.alone(empty)
    for frame in alone:
        calibrated = changing.step(calibrated, frame, empty=True)
        changes.append(stages.seen(calibrated))
    first = next(stream, None)
    if first is None:
        raise DataError(
            f"calibration_frames: the log has {len(empty)} frames, all of them taken for calibration; take fewer."
        )
    rng = np.random.default_rng(parameters.seed)
    people = stages.init(np.array(changes), rng)
    before = [Step(frame.time_s, frame, RoomState(rss, people, True), ()) for frame in empty]
    look = None
    if _looks(parameters):
        losing = parameters.change.replace(measure="loss")
        look = Look(np.array([losing.step(rss, frame).change for frame in alone]))
    memory.held = rss.calibration, rss, people, rng, look, None
    memory.first = 0  # no frame is kept
    for step in _followed(chain([first], stream), nodes, parameters, memory, stages):
        yield from before  # what cannot be used is refused before anything is given out
        before = []
        yield step


def _followed(
    frames: Iterable[RssFrame], nodes: RadioNodes, parameters: LinkTracking, memory: Memory, stages: Any = None
) -> Iterator[Step]:
    """Track through the frames after the calibration, from what is remembered."""
    calibration, rss, people, rng, look, voxels = memory.held
    if voxels is not None:
        parameters, stages = _radiating(parameters, voxels), None
    if stages is None:
        stages = parameters.method.bind(nodes, parameters.area_of(nodes), calibration)
    changing, losing = parameters.method.measured(parameters.change), parameters.change.replace(measure="loss")
    site = None if look is None else LiveSite(nodes, parameters.area_of(nodes), given=parameters.area is not None)
    for frame in frames:
        if site is not None and look is not None:
            look = site.after(look, losing.step(rss, frame).change)
            found = None if look is None else site.found(look, voxels)
            if found is not None:
                voxels, parameters = found, _radiating(parameters, found)
                stages = parameters.method.bind(nodes, parameters.area_of(nodes), calibration)
                changing, people = losing, stages.init_from(people)
        if isinstance(people, LinksState) and people.changed is not None:
            room = people.changed
            rss = rss.changed(room.level_db, room.variance_db2, _away(stages, nodes, people, room.tracks))
            calibration = rss.calibration
            stages = parameters.method.bind(nodes, parameters.area_of(nodes), calibration)
            people = stages.anew(people)
        rss = changing.step(rss, frame, empty=people.nobody, away=_away(stages, nodes, people))
        # nobody is looked for by an effect that hardly holds
        held = voxels is None and look is not None and look.likely
        people = stages.step(people, frame.time_s, None if held else stages.seen(rss), rng)
        memory.keep(frame.time_s, calibration, rss, people, rng, look, voxels)
        words = "" if voxels is None else _words(voxels)
        yield Step(frame.time_s, frame, RoomState(rss, people, False, words), stages.shown(people))


def _away(stages: Any, nodes: RadioNodes, people: ImageState | LinksState, but: tuple[int, ...] = ()) -> Flags:
    """Return which directed links run by nobody who is tracked, but for some of them."""
    sure = [track for track in people.tracks if track.status == "confirmed" and track.track not in but]
    places = np.array([track.mean[[X, Y]] for track in sure]).reshape(-1, 2)
    away: Flags = stages.away(nodes, places)
    return away


def _looks(parameters: LinkTracking) -> bool:
    """Whether the site is looked at while frames come: of shadowed links whose effect is neither given nor fitted."""
    method = parameters.method
    return parameters.fit_frames > 0 and isinstance(method, LinksMethod) and method.effect == LinkShadowing()


def _radiating(parameters: LinkTracking, voxels: Voxels) -> LinkTracking:
    """Return the parameters with the effect that was found."""
    return parameters.replace(method=parameters.method.replace(effect=voxels.model))


def _words(voxels: Voxels) -> str:
    covered = " --covered nodes" if voxels.model.covered == "nodes" else ""
    return (
        f"site: sums over voxels explain {voxels.explained:.0%} of the changes: people are tracked by radiation of "
        f"{voxels.model.amplitude_db:.2g} dB from then on (--effect radiation --amplitude-db "
        f"{voxels.model.amplitude_db:.3g}{covered} from the start)."
    )
