"""Presets of the thesis: its first simulation (tables 4.1 to 4.3), and each column of tables 4.4 to 4.7.

Mendieta (2017), chapter 4. The thesis does not say how long people stand still. Its ten people were there for 479
steps together. Whoever enters a convex area from any side and only walks leaves after ``pi A / P`` metres on average,
however they turn (Blanco and Fournier, 2003, Europhys. Lett. 61(2), 168-173): 22 steps here. So a turn is as often a
stand as not, a stand lasts 25 steps on average, and everybody comes in during the first half: 48.7 steps a person,
over 600 of them.
"""

from __future__ import annotations

from elusive.geometry.areas import Area
from elusive.motion.walk import Walk
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.fade_level import RssChange
from elusive.preprocess.threshold import Threshold
from elusive.preprocess.tomography import RegularisedImage
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.networks import BorderNodes
from elusive.systems.links.radiation import VoxelRadiation
from elusive.systems.links.scene import LinkScene
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.track import LinkTracking
from elusive.systems.links.walks import Walks
from elusive.tracking.people import Entrance
from elusive.tracking.people_radius import RadiusTracker

FIRST_SIMULATION = "First simulation (tables 4.1 to 4.3)"
DEFAULT_TRACKER = "First simulation, this package's default tracker"
LINKS_TRACKER = "First simulation, straight on the links"
AREA = Area.rectangle(-12.0, 12.0, -12.0, 12.0)
WALKS = Walks(
    users=3, area=AREA, total_positions=150, standing_probability=0.5, mean_standing_steps=25.0, latest_entrance=74
)
FIRST = LinkSimulation(walks=WALKS)


def thesis_method(memory_frames: int = 5, radius_m: float = 2.5) -> ImageMethod:
    """Return the thesis's algorithm (table 4.3) with its tracking memory and its radius about a target."""
    entrance = Entrance(area=AREA, width_m=2.0)
    return ImageMethod(
        image=RegularisedImage(equalised="none"),
        threshold=Threshold(beta=0.8, least=0.0),
        clusters=Clusters(cluster_width_m=2.0, sidelobe=0.0, apart_m=0.0, subvoxel="none"),
        tracker=RadiusTracker(entrance=entrance, memory_frames=memory_frames, radius_m=radius_m),
    )


def links_method(simulation: LinkSimulation) -> LinksMethod:
    """Return the filter on the links; it knows what a person attenuates and the voxels' noise.

    A person turns once in ten seconds, and begins or ends a stand once in ten.
    """
    radiation, interval_s = simulation.radiation, simulation.interval_s
    person = VoxelRadiation(
        amplitude_db=radiation.amplitude_db, width_x_m=radiation.width_x_m / 2, width_y_m=radiation.width_y_m / 2,
        voxel_sd_db=radiation.voxel_noise_db, weights=simulation.weights,
    )  # fmt: skip
    walk = Walk(
        speeds_mps=(simulation.walks.step_distance_m / interval_s / 2**0.5,), turn_rate_hz=0.22, straight_q=0.0025,
        long_rate_hz=0.005,
    )  # fmt: skip
    people = LinksMethod().people.replace(particles=200, death_probability=0.01)
    return LinksMethod(
        effect=person, walk=walk, people=people, birth_probability=0.01, birth_pitch_m=simulation.weights.voxel_m
    )


def first_simulation() -> LinkScene:
    """Return the scene of tables 4.1 to 4.3."""
    return LinkScene(simulation=FIRST, tracking=_by(thesis_method())).bound


def _by(method: LinksMethod | ImageMethod) -> LinkTracking:
    """Track by a method what the thesis's centre receives: signed changes, from a room that stays as it was."""
    change = RssChange(measure="loss", empty_s=None, occupied_s=None)
    return LinkTracking(method=method, change=change, calibration_frames=FIRST.calibration_steps)


def presets() -> dict[str, LinkScene]:
    """Return each preset's scene under its title."""
    first = first_simulation()
    found = {FIRST_SIMULATION: first}
    for level in (5.0, 10.0, 20.0):
        radiation = FIRST.radiation.replace(amplitude_db=level)
        found[f"Table 4.4: fade level {level:g} dB"] = first.replace(simulation=FIRST.replace(radiation=radiation))
    for memory in (1, 3, 5):
        found[f"Table 4.5: memory of {memory} steps"] = first.replace(tracking=_by(thesis_method(memory_frames=memory)))
    for radius in (1.0, 2.0, 3.0):
        found[f"Table 4.6: radius of {radius:g} m"] = first.replace(tracking=_by(thesis_method(radius_m=radius)))
    for nodes in (41, 32, 9):
        simulation = FIRST.replace(network=BorderNodes(nodes=nodes))
        found[f"Table 4.7: {nodes} sensors"] = first.replace(simulation=simulation)
    found[DEFAULT_TRACKER] = first.replace(tracking=_by(ImageMethod()))
    found[LINKS_TRACKER] = first.replace(tracking=_by(links_method(FIRST)))
    return {title: scene.bound for title, scene in found.items()}
