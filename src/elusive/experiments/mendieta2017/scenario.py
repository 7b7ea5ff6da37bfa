"""The trackers that see the runs of Mendieta (2017), tables 4.1 to 4.3, and what each is called."""

from __future__ import annotations

from typing import Literal

from elusive.filters.particle.link_people import LinkPeople
from elusive.motion.walk import Walk
from elusive.sensors.linear_links import LinkRadiation
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.presets import thesis_method
from elusive.systems.links.simulate import LinkSimulation, SimulatedNetwork
from elusive.tracking.people_hungarian import HungarianTracker

MethodName = Literal["thesis", "image", "links", "binary"]
METHODS: dict[MethodName, str] = {
    "thesis": "the thesis's algorithm",
    "image": "image tracker",
    "links": "straight on the links",
    "binary": "image tracker, one bit a link",
}


def image_method(name: MethodName, memory_frames: int | None, radius_m: float | None) -> ImageMethod:
    """Return the thesis's algorithm (table 4.3), or the default with its nearest parameters.

    Parameters
    ----------
    name
        ``thesis``, else the default.
    memory_frames
        Tracking memory; of the default tracker, frames without a head that delete a track. None: as usual.
    radius_m
        Radius about a target; of the default tracker, its gate. None: as usual.
    """
    if name == "thesis":
        return thesis_method(memory_frames or 5, radius_m or 2.5)
    changes = {"delete_frames": memory_frames, "gate_m": radius_m}
    return ImageMethod(tracker=HungarianTracker(**{key: value for key, value in changes.items() if value is not None}))


def links_filter(simulation: LinkSimulation, network: SimulatedNetwork) -> LinkPeople:
    """Return the filter on the links; it knows what a person attenuates and the voxels' noise.

    A step is a new one once in ten for a turn, and once in ten for the beginning or end of a stand.
    """
    radiation = simulation.radiation
    person = LinkRadiation(
        amplitude_db=radiation.amplitude_db, width_x_m=radiation.width_x_m / 2, width_y_m=radiation.width_y_m / 2,
        voxel_sd_db=radiation.voxel_noise_db,
    )  # fmt: skip
    area = simulation.walks.area
    return LinkPeople(
        sensor=person.links(network.weights, area.bounds_m, simulation.voxel_m), area=area,
        walk=Walk(step_m=simulation.walks.step_distance_m / 2**0.5, turn_probability=0.2),
        particles=200, birth_pitch_m=simulation.voxel_m,
    )  # fmt: skip
