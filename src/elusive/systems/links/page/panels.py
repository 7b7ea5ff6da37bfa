"""The panels of radio tomography: of the radiation alone, and the eight stages of tracking side by side.

Mendieta (2017), section 5.6, figure 5.6.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.preprocess.voxels import VoxelGrid
from elusive.systems.links.scene import LinkScene, Radiated
from elusive.systems.links.scene_run import SceneRun
from elusive.tracking.people_radius import RadiusTracker
from elusive.workbench.blocks import Panel, player_spec, scaled

Mark = list[Any]
LEGEND = (
    "+ a person's true place", "red: candidate", "green: confirmed", "dots: remembered places",
    "rings: reach of the pairing",
)  # fmt: skip


def radiation_spec(scene: LinkScene, radiated: Radiated) -> dict[str, Any]:
    """Return a player of the radiation, seen from above or as a surface."""
    panel = scaled("Radiation", _frames(scene.grid, radiated.images), "dB", low=0.0)
    return player_spec(
        "Radiation", [panel], _extent(scene.grid), marks=[_truth(radiated.truth)], corners=_corners(scene),
        interval_s=scene.simulation.interval_s, turnable=True, legend=["+ a person's true place"],
    )  # fmt: skip


def tracking_spec(run: SceneRun) -> dict[str, Any]:
    """Return a player of the eight stages."""
    scene, grid = run.scene, run.scene.grid
    images = np.array([frame.image for frame in run.frames])
    bright = np.array([np.where(frame.clusters > 0, frame.image, 0.0) for frame in run.frames])
    most = float(images.max())
    labels = np.array([frame.clusters for frame in run.frames])
    numbered = np.where(labels > 0, 1 + (labels - 1) % 254, 0).astype(np.uint8)
    filtered = scaled("Filtered", _frames(grid, bright), "dB", low=0.0, high=most)
    # grey and dim beneath marks, so that these are seen
    ground = scaled("", _frames(grid, images), "dB", low=0.0, high=1.3 * most, colours="grey").values
    panels = [
        scaled("Radiation", _frames(grid, run.radiated.images), "dB", low=0.0),
        scaled("Estimate", _frames(grid, images), "dB", low=0.0, high=most),
        filtered,
        Panel("Clusters", _frames(grid, numbered), colours="labels"),
        *(Panel(title, ground, colours="grey") for title in ("Association", "Identities", "Kalman", "Particle filter")),
    ]
    truth = _truth(run.radiated.truth)
    heads = [[["head", x, y, "#ffffff", "", 0] for x, y in _round(frame.heads)] for frame in run.frames]
    marks = [
        truth, [], [], heads, _association(run), _tracks(run, 0, "mark"),
        *([[*there, *found] for there, found in zip(truth, _tracks(run, n, "track"), strict=True)] for n in (1, 2)),
    ]  # fmt: skip
    nodes = _round(scene.network().positions_m)
    return player_spec(
        "The eight stages of tracking", panels, _extent(grid), marks=[one or None for one in marks],
        corners=_corners(scene), nodes=nodes, interval_s=scene.simulation.interval_s, legend=list(LEGEND),
    )  # fmt: skip


def _association(run: SceneRun) -> list[list[Mark]]:
    """Mark what each head is compared with: remembered places, and the radius round each head."""
    tracker = run.scene.method.tracker
    radius = tracker.radius_m if isinstance(tracker, RadiusTracker) else tracker.gate_m
    return [
        [
            *(["old", x, y, "", "", 0] for x, y in _round(frame.remembered)),
            *(["ring", x, y, "", "", radius] for x, y in _round(frame.heads)),
            *(["head", x, y, "#ffffff", "", 0] for x, y in _round(frame.heads)),
        ]
        for frame in run.frames
    ]


def _tracks(run: SceneRun, estimator: int, kind: str) -> list[list[Mark]]:
    return [
        [
            [kind, *_round(one.places)[estimator], "CONFIRMED" if one.confirmed else "CANDIDATE", str(one.track), 0]
            for one in frame.tracks
        ]
        for frame in run.frames
    ]


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
