"""The panels of radio tomography: of the radiation alone, and the eight stages of tracking side by side.

Mendieta (2017), section 5.6, figure 5.6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.voxels import VoxelGrid
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.scene import LinkScene, Radiated, SceneRun
from elusive.tracking.people_radius import RadiusTracker
from elusive.tracking.track import Track
from elusive.workbench.blocks import Panel, player_spec, scaled

Mark = list[Any]
PARTICLES_SHOWN = 60  # of a person
LEGEND = (
    "+ a person's true place", "red: candidate", "green: confirmed", "dots: remembered places",
    "rings: reach of the pairing",
)  # fmt: skip


def radiation_spec(scene: LinkScene, radiated: Radiated) -> dict[str, Any]:
    """Return a player of the radiation, seen from above or as a surface."""
    images = radiated.images[scene.simulation.calibration_steps :]
    panel = scaled("Radiation", _frames(scene.grid, images), "dB", low=0.0)
    return player_spec(
        "Radiation", [panel], _extent(scene.grid), marks=[_truth(radiated.truth)], corners=_corners(scene),
        interval_s=scene.simulation.interval_s, turnable=True, legend=["+ a person's true place"],
    )  # fmt: skip


def tracking_spec(run: SceneRun) -> dict[str, Any]:
    """Return a player of the stages: eight by way of an image, three straight on the links."""
    grid, times_s = run.scene.grid, [step.time_s for step in run.steps]
    places = np.empty((len(times_s), 0, 2)) if run.truth is None else run.truth.interpolated(times_s)
    truth = _truth(places)
    radiation = np.zeros((len(times_s), len(grid.centres))) if run.images is None else run.images
    panels = [scaled("Radiation", _frames(grid, radiation), "dB", low=0.0)]
    marks: list[Any] = [truth]
    stages = _image_stages if isinstance(run.steps[0].state, ImageState) else _link_stages
    more, of_more = stages(run, truth)
    interval_s = float(np.median(np.diff(times_s))) if len(times_s) > 1 else run.scene.simulation.interval_s
    return player_spec(
        "The stages of tracking", [*panels, *more], _extent(grid), marks=[one or None for one in (*marks, *of_more)],
        corners=_corners(run.scene), nodes=_round(run.scene.simulation.network.bind(run.scene.area).positions_m),
        interval_s=interval_s, legend=list(LEGEND),
    )  # fmt: skip


def _image_stages(run: SceneRun, truth: list[list[Mark]]) -> tuple[list[Panel], list[Any]]:
    grid, clusters = run.scene.grid, getattr(run.tracking.method, "clusters", Clusters())
    images = np.array([step.state.image for step in run.steps])
    labels = np.array([clusters.labels(step.state.image, grid, step.state.level) for step in run.steps])
    most = float(images.max())
    numbered = np.where(labels > 0, 1 + (labels - 1) % 254, 0).astype(np.uint8)
    # grey and dim beneath marks, so that these are seen
    ground = scaled("", _frames(grid, images), "dB", low=0.0, high=1.3 * most, colours="grey").values
    panels = [
        scaled("Estimate", _frames(grid, images), "dB", low=0.0, high=most),
        scaled("Filtered", _frames(grid, np.where(labels > 0, images, 0.0)), "dB", low=0.0, high=most),
        Panel("Clusters", _frames(grid, numbered), colours="labels"),
        *(Panel(title, ground, colours="grey") for title in ("Association", "Identities", "Kalman", "Particle filter")),
    ]
    heads = [[["head", x, y, "#ffffff", "", 0] for x, y in _round(step.state.heads.positions)] for step in run.steps]
    identities, smoothed, filtered = [], [], []
    for step, particles, there in zip(run.steps, run.particles, truth, strict=True):
        living = step.state.people.living
        tracks = [one for one in step.tracks if one.track in living]
        identities.append([_mark("mark", one, living[one.track].position) for one in tracks])
        smoothed.append([*there, *(_mark("track", one, one.mean[[X, Y]]) for one in tracks)])
        filtered.append([*there, *(_mark("track", one, particles[one.track].mean[[X, Y]]) for one in tracks)])
    return panels, [[], [], heads, _association(run), identities, smoothed, filtered]


def _link_stages(run: SceneRun, truth: list[list[Mark]]) -> tuple[list[Panel], list[Any]]:
    ground = _frames(run.scene.grid, np.zeros((len(run.steps), len(run.scene.grid.centres)), np.uint8))
    clouds, identities = [], []
    for step, there in zip(run.steps, truth, strict=True):
        targets = [one for one in step.state.belief.targets if one.life.lives]
        shown = [one.particles[:: max(1, len(one.particles) // PARTICLES_SHOWN)][:, [X, Y]] for one in targets]
        clouds.append([*there, *(["old", x, y, "", "", 0] for cloud in shown for x, y in _round(cloud))])
        tracks = [one for one in step.tracks if one.status != "deleted"]
        identities.append([*there, *(_mark("track", one, one.mean[[X, Y]]) for one in tracks)])
    return [Panel(title, ground, colours="grey") for title in ("Particles", "Identities")], [clouds, identities]


def _association(run: SceneRun) -> list[list[Mark]]:
    """Mark what each head is compared with: remembered places, and the radius round each head."""
    tracker: Any = getattr(run.tracking.method, "tracker", None)
    radius = tracker.radius_m if isinstance(tracker, RadiusTracker) else tracker.gate_m
    marks = []
    before: Any = tracker.init()
    for step in run.steps:
        known = [place for seen in before.memory for place in seen.values()]
        known = known or [person.position for person in before.living.values()]
        heads = _round(step.state.heads.positions)
        marks.append(
            [
                *(["old", x, y, "", "", 0] for x, y in _round(np.array(known).reshape(-1, 2))),
                *(["ring", x, y, "", "", radius] for x, y in heads),
                *(["head", x, y, "#ffffff", "", 0] for x, y in heads),
            ]
        )
        before = step.state.people
    return marks


def _mark(kind: str, track: Track, place: Any) -> Mark:
    return [kind, *np.round(place, 3).tolist(), track.status.upper(), str(track.track), 0]


def _truth(truth: Array) -> list[list[Mark]]:
    return [[["truth", x, y, "", "", 0] for x, y in _round(people[np.isfinite(people[:, 0])])] for people in truth]


def _frames(grid: VoxelGrid, images: Any) -> Any:
    return images.reshape(-1, *grid.shape)


def _extent(grid: VoxelGrid) -> tuple[float, float, float, float]:
    rows, columns = grid.shape
    return grid.x0, grid.x0 + columns * grid.voxel_m, grid.y0, grid.y0 + rows * grid.voxel_m


def _corners(scene: LinkScene) -> list[list[float]]:
    return _round(np.array(scene.area.corners_m))


def _round(places: Array) -> list[list[float]]:
    rounded: list[list[float]] = np.round(places, 3).tolist()
    return rounded
