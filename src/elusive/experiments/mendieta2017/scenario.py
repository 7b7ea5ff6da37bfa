"""The trackers that see the runs of Mendieta (2017), tables 4.1 to 4.3, and what each is called."""

from __future__ import annotations

from typing import Literal

from elusive.preprocess.binary_links import BinaryLinks
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.decisions import DecisionMethod
from elusive.systems.links.presets import links_method, thesis_method
from elusive.systems.links.simulate import LinkSimulation
from elusive.tracking.people_hungarian import HungarianTracker

MethodName = Literal["thesis", "image", "links", "binary"]
METHODS: dict[MethodName, str] = {
    "thesis": "the thesis's algorithm",
    "image": "image tracker",
    "links": "straight on the links",
    "binary": "image tracker, one bit a link",
}


def method_of(
    name: MethodName, simulation: LinkSimulation, memory_frames: int | None = None, radius_m: float | None = None
) -> LinksMethod | ImageMethod | DecisionMethod:
    """Return a tracker of a simulation's people.

    Parameters
    ----------
    name
        ``thesis``: its algorithm (table 4.3); else this package's, with the nearest parameters.
    simulation
        What it tracks.
    memory_frames
        Tracking memory; of the default tracker, frames without a head that delete a track. None: as usual.
    radius_m
        Radius about a target; of the default tracker, its gate. None: as usual.
    """
    if name == "links":
        return links_method(simulation)
    if name == "thesis":
        return thesis_method(memory_frames or 5, radius_m or 2.5).replace(weights=simulation.weights)
    usual = HungarianTracker()
    life = usual.life if memory_frames is None else usual.life.replace(delete_frames=memory_frames)
    tracker = usual.replace(life=life, gate_m=radius_m or usual.gate_m)
    if name == "image":
        return ImageMethod(tracker=tracker, weights=simulation.weights)
    bits = BinaryLinks(bit_error_rate=simulation.quantiser.bit_error_rate)
    return DecisionMethod(tracker=tracker, weights=simulation.weights, decisions=bits)
