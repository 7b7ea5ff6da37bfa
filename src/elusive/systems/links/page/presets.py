"""Presets of the thesis: its first simulation (tables 4.1 to 4.3), and each column of tables 4.4 to 4.7.

Mendieta (2017), chapter 4.
"""

from __future__ import annotations

from elusive.experiments.mendieta2017.scenario import FIRST, image_method
from elusive.systems.links.networks import BorderNodes
from elusive.systems.links.scene import LinkScene
from elusive.systems.links.scene_results import outcome_of
from elusive.systems.links.scene_run import run_link_scene

FIRST_SIMULATION = "First simulation (tables 4.1 to 4.3)"
DEFAULT_TRACKER = "First simulation, this package's default tracker"


def first_simulation() -> LinkScene:
    """Return the scene of tables 4.1 to 4.3."""
    return LinkScene(simulation=FIRST, method=image_method("thesis", None, None)).with_entrance


def warm_up() -> None:
    """Run a small scene, so that what is compiled or loaded once is there when it is waited for."""
    first = first_simulation()
    walks = first.simulation.walks.replace(total_positions=30, latest_entrance=5)
    simulation = first.simulation.replace(walks=walks, network=BorderNodes(nodes=12))
    outcome_of(run_link_scene(first.replace(simulation=simulation)))


def presets() -> dict[str, LinkScene]:
    """Return each preset's scene under its title."""
    first = first_simulation()
    found = {FIRST_SIMULATION: first}
    for level in (5.0, 10.0, 20.0):
        radiation = FIRST.radiation.replace(amplitude_db=level)
        found[f"Table 4.4: fade level {level:g} dB"] = first.replace(simulation=FIRST.replace(radiation=radiation))
    for memory in (1, 3, 5):
        method = image_method("thesis", memory, None)
        found[f"Table 4.5: memory of {memory} steps"] = first.replace(method=method)
    for radius in (1.0, 2.0, 3.0):
        method = image_method("thesis", None, radius)
        found[f"Table 4.6: radius of {radius:g} m"] = first.replace(method=method)
    for nodes in (41, 32, 9):
        simulation = FIRST.replace(network=BorderNodes(nodes=nodes))
        found[f"Table 4.7: {nodes} sensors"] = first.replace(simulation=simulation)
    found[DEFAULT_TRACKER] = first.replace(method=image_method("image", None, None))
    return {title: scene.with_entrance for title, scene in found.items()}
