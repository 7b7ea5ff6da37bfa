"""The systems, registered once: commands, pages of the workbench and the docs' table are made from this list."""

from __future__ import annotations

from typing import NamedTuple


class System(NamedTuple):
    """One kind of recording and what finds targets in it.

    Its commands are found by its name: ``track_<name>_command`` and, where it ``fits``, ``fit_<name>_command`` in
    ``elusive.cli.<name>``, ``simulate_command``, ``SCENE`` and ``run_scene`` in ``elusive.cli.scenes.<name>``.
    """

    name: str  # of its folder and of a scene's key ``system``
    noun: str  # of its commands: ``elusive track <noun>``
    recording: str  # what its users have
    targets: str  # what is found in that
    command: str  # the shortest that does it
    page: str  # module of its page in the workbench, which holds a PAGE
    fits: bool = False  # to a recording without labels: ``elusive fit <noun>``
    look: str = ""  # place of what tells what a recording is before it is tracked
    tries: tuple[tuple[str, str], ...] = ()  # where nothing is found: options, and what they become; x2: twice as much


SYSTEMS = (
    System(
        "links",
        "links",
        "levels of a radio network",
        "people without devices",
        "elusive track links log.csv --nodes nodes.csv --out result",
        "elusive.systems.links.page",
        fits=True,
        look="elusive.systems.links.look:look",
        tries=(("confirm_from", "x0.7"), ("confirm_frames", "x0.5"), ("birth_probability", "x5")),
    ),
    System(
        "images",
        "images",
        "a sequence of frames",
        "targets below the noise",
        "elusive track images frames/ --out result",
        "elusive.systems.images.page",
        fits=True,
        look="elusive.systems.images.look:look",
        tries=(("show", "all"), ("confirm_from", "x0.7"), ("confirm_frames", "x0.5")),
    ),
    System(
        "signals",
        "signal",
        "a signal over time",
        "objects that differ only in their noise",
        "elusive track signal signal.npy --out result",
        "elusive.systems.signals.page",
        fits=True,
        look="elusive.systems.signals.look:look",
        tries=(("probability", "x10"), ("object_size", "x2"), ("confirm_risk", "x10")),
    ),
    System(
        "radar",
        "radar",
        "a radar's plots, and charts",
        "ships near the coast",
        "elusive track radar plots.csv --chart coast.geojson --radar-lat-deg -0.03 --radar-lon-deg 0.004 --out result",
        "elusive.systems.radar.page",
        fits=True,
        tries=(("confirm_from", "x0.7"), ("detection_probability", "x0.6"), ("q", "x10")),
    ),
    System(
        "video",
        "video",
        "radar video, before any threshold",
        "ships too faint for plots",
        "elusive track video video.npz --out result",
        "elusive.systems.video.page",
        look="elusive.systems.video.look:look",
        tries=(("confirm_from", "x0.7"), ("births_per_h", "x5"), ("confirm_frames", "x0.5")),
    ),
    System(
        "bearings",
        "bearings",
        "bearings from a few places",
        "emitters",
        "elusive track bearings bearings.csv --sensors sensors.csv --out result",
        "elusive.systems.bearings.page",
        fits=True,
        tries=(("confirm_from", "x0.7"), ("sigma_deg", "2"), ("detection_probability", "x0.6")),
    ),
)
