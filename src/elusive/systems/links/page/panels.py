"""The panels of radio tomography: of the radiation alone, and the stages of tracking side by side.

Mendieta (2017), section 5.6, figure 5.6.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from elusive.contracts import Array, X, Y
from elusive.preprocess.blobs import Clusters
from elusive.preprocess.voxels import VoxelGrid
from elusive.report import drawing as draw
from elusive.report.plots import track_colour
from elusive.systems.links.by_image import ImageState
from elusive.systems.links.scene import LinkScene, Radiated, SceneRun
from elusive.tracking.people_radius import RadiusTracker

PARTICLES_SHOWN = 60  # of a person
TRAIL_FRAMES = 25  # of a track's past that are drawn strongly
Stage = tuple[str, dict[str, Any], str, list[draw.Layer]]  # title, image, its colours, what lies over it


def radiation_spec(scene: LinkScene, radiated: Radiated) -> draw.Drawing:
    """Return what the radiation is, seen from above or as a surface."""
    images = radiated.images[scene.simulation.calibration_steps :]
    times = np.asarray(scene.simulation.interval_s * np.arange(len(images)), np.float64)
    seen = {**draw.scaled(_frames(scene.grid, images), low=0.0), "unit": "dB"}
    panel = _panel(("Radiation", seen, "heat", [_truth(radiated.truth, times)]), scene, times, 12)
    return draw.drawing("Radiation", times, [panel], turnable=True)


def tracking_spec(run: SceneRun) -> draw.Drawing:
    """Return the stages: eight by way of an image, three straight on the links."""
    grid, times = run.scene.grid, np.array([step.time_s for step in run.steps])
    places = np.empty((len(times), 0, 2)) if run.truth is None else run.truth.at(times)
    truth = _truth(places, times)
    radiation = np.zeros((len(times), len(grid.centres))) if run.images is None else run.images
    seen = {**draw.scaled(_frames(grid, radiation), low=0.0), "unit": "dB"}
    nodes = run.scene.simulation.network.bind(run.scene.area).positions_m
    stages = _image_stages if isinstance(run.steps[0].state, ImageState) else _link_stages
    shown: list[Stage] = [("Radiation", seen, "heat", [truth]), *stages(run, times, truth)]
    beneath = draw.points(nodes, "--plot", marker="square", size=1.5, name="nodes")
    panels = [
        _panel((title, values, colours, [beneath, *layers]), run.scene, times, 3 if len(shown) > 3 else 4)
        for title, values, colours, layers in shown
    ]
    most = int(np.argmax([sum(one.status == "confirmed" for one in step.tracks) for step in run.steps]))
    return draw.drawing("The stages of tracking", times, panels, start=most)


def _panel(stage: Stage, scene: LinkScene, times: Array, span: int) -> draw.Panel:
    title, values, colours, layers = stage
    rows, columns = scene.grid.shape
    x0, y0, side = scene.grid.x0, scene.grid.y0, scene.grid.voxel_m
    extent = (x0, x0 + columns * side, y0, y0 + rows * side)
    image = draw.image(values, extent, colours, times=draw.rounded(times, 4))
    outline = draw.area([scene.area.corners_m], colour="--plot")
    return draw.plane(title, extent, [image, outline, *layers], span=span, night=True, bare=True)


def _image_stages(run: SceneRun, times: Array, truth: draw.Layer) -> Iterable[Stage]:
    grid, clusters = run.scene.grid, getattr(run.tracking.method, "clusters", Clusters())
    images = _frames(grid, np.array([step.state.image for step in run.steps]))
    labels = [clusters.labels(step.state.image, grid, step.state.level) for step in run.steps]
    bright = _frames(grid, np.array(labels)) > 0
    most = float(images.max())
    numbered = np.where(bright, 1 + (_frames(grid, np.array(labels)) - 1) % 254, 0).astype(np.uint8)
    estimate = draw.scaled(images, 0.0, most)
    heads = [step.state.heads.positions for step in run.steps]
    head = _points(heads, times, "--ink", name="cluster heads", size=4)
    yield "Estimate", {**estimate, "unit": "dB"}, "heat", []
    yield "Filtered", {**draw.scaled(np.where(bright, images, 0.0), 0.0, most), "unit": "dB"}, "heat", []
    yield "Clusters", {"block": numbered, "low": 0.0, "high": 255.0}, "labels", [head]
    yield "Association", estimate, "dim", [*_association(run, times, heads), head]
    identities: list[dict[int, Array]] = []
    smoothed: list[dict[int, Array]] = []
    filtered: list[dict[int, Array]] = []
    for step, particles in zip(run.steps, run.particles, strict=True):
        living = step.state.people.living
        tracks = [one for one in step.tracks if one.track in living]
        identities.append({one.track: living[one.track].position for one in tracks})
        smoothed.append({one.track: one.mean[[X, Y]] for one in tracks})
        filtered.append({one.track: particles[one.track].mean[[X, Y]] for one in tracks})
    yield "Identities", estimate, "dim", _tracks(run, times, identities)
    yield "Kalman", estimate, "dim", [truth, *_tracks(run, times, smoothed)]
    yield "Particle filter", estimate, "dim", [truth, *_tracks(run, times, filtered)]


def _link_stages(run: SceneRun, times: Array, truth: draw.Layer) -> Iterable[Stage]:
    ground = draw.scaled(np.zeros(run.scene.grid.shape), 0.0, 1.0)
    clouds: list[Array] = []
    for step in run.steps:
        of_all = [one.particles for one in step.state.belief.targets if one.life.lives]
        few = [particles[:: max(1, len(particles) // PARTICLES_SHOWN)][:, [X, Y]] for particles in of_all]
        clouds.append(np.concatenate([np.zeros((0, 2)), *few]))
    particles = _points(clouds, times, "--particle", name="particles", size=1.0)
    yield "Particles", ground, "dim", [truth, particles]
    places = [{one.track: one.mean[[X, Y]] for one in step.tracks if one.status != "deleted"} for step in run.steps]
    yield "Identities", ground, "dim", [truth, *_tracks(run, times, places)]


def _association(run: SceneRun, times: Array, heads: Sequence[Array]) -> Iterable[draw.Layer]:
    """Mark what each head is compared with: remembered places, and the radius round each head."""
    tracker: Any = getattr(run.tracking.method, "tracker", None)
    radius = tracker.radius_m if isinstance(tracker, RadiusTracker) else tracker.gate_m
    remembered: list[Array] = []
    before: Any = tracker.init()
    for step in run.steps:
        known = [place for seen in before.memory for place in seen.values()]
        known = known or [person.position for person in before.living.values()]
        remembered.append(np.array(known).reshape(-1, 2))
        before = step.state.people
    yield _points(remembered, times, "--plot", name="remembered places", size=1.6)
    yield _points(heads, times, "--wall", name="reach of the pairing", marker="ring", radius=radius)


def _tracks(run: SceneRun, times: Array, places: Sequence[dict[int, Array]]) -> list[draw.Layer]:
    """Return the tracks through places by track, a step each."""
    confirmed = [{one.track for one in step.tracks if one.status == "confirmed"} for step in run.steps]
    trail = TRAIL_FRAMES * (float(np.median(np.diff(times))) if len(times) > 1 else 1.0)
    layers = []
    for track in sorted(set().union(*places)):
        steps = [number for number, there in enumerate(places) if track in there]
        way, sure = np.stack([places[number][track] for number in steps]), [track in confirmed[n] for n in steps]
        layers.append(draw.track(track, times[steps], way, track_colour(track), sure=sure, trail=trail))
    return layers


def _truth(truth: Array, times: Array) -> draw.Layer:
    there = [people[np.isfinite(people[:, 0])] for people in truth]
    return _points(there, times, "--ink", name="true places", marker="plus", size=6, width=2)


def _points(of_steps: Sequence[Array], times: Array, colour: str, **more: Any) -> draw.Layer:
    kept = [(float(time), np.reshape(places, (-1, 2))) for time, places in zip(times, of_steps, strict=True)]
    return draw.clouds(kept, colour, show="now", **more)


def _frames(grid: VoxelGrid, images: Any) -> Any:
    return images.reshape(-1, *grid.shape)
