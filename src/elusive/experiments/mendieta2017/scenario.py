"""The first simulation of Mendieta (2017), tables 4.1 to 4.3, and the trackers that see it.

The thesis does not say how long people stand still. Its ten people were there for 479 steps together. Whoever enters
a convex area from any side and only walks leaves after ``pi A / P`` metres on average, however they turn (Blanco and
Fournier, 2003, Europhys. Lett. 61(2), 168-173): 22 steps here. So a turn is as often a stand as not, a stand lasts 25
steps on average, and everybody comes in during the first half: 48.7 steps a person, over 600 of them.
"""

from __future__ import annotations

from typing import Literal

from elusive.filters.particle.link_people import LinkPeople
from elusive.geometry.areas import Area
from elusive.motion.walk import Walk
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.threshold import Threshold
from elusive.preprocess.tomography import RegularisedImage
from elusive.sensors.linear_links import LinkRadiation
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.simulate import LinkSimulation, SimulatedNetwork
from elusive.systems.links.walks import Walks
from elusive.tracking.people import Entrance
from elusive.tracking.people_hungarian import HungarianTracker
from elusive.tracking.people_radius import RadiusTracker

MethodName = Literal["thesis", "image", "links", "binary"]
METHODS: dict[MethodName, str] = {
    "thesis": "the thesis's algorithm",
    "image": "image tracker",
    "links": "straight on the links",
    "binary": "image tracker, one bit a link",
}
AREA = Area.rectangle(-12.0, 12.0, -12.0, 12.0)
WALKS = Walks(
    users=3, area=AREA, total_positions=150, standing_probability=0.5, mean_standing_steps=25.0, latest_entrance=74
)
FIRST = LinkSimulation(walks=WALKS)


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
    if name != "thesis":
        changes = {"delete_frames": memory_frames, "gate_m": radius_m}
        given = {key: value for key, value in changes.items() if value is not None}
        return ImageMethod(tracker=HungarianTracker(**given))
    changes = {"memory_frames": memory_frames, "radius_m": radius_m}
    given = {key: value for key, value in changes.items() if value is not None}
    return ImageMethod(
        image=RegularisedImage(equalised="none"),
        threshold=Threshold(beta=0.8, least=0.0),
        clusters=Clusters(cluster_width_m=2.0, sidelobe=0.0, apart_m=0.0, subvoxel="none"),
        tracker=RadiusTracker(entrance=Entrance(area=AREA, width_m=2.0), **given),
    )


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
