"""A scene tracked: every stage of every frame kept, so that all of them can be looked at side by side, and scored.

Mendieta (2017), sections 3.8 to 3.12 and 5.6: radiation, estimate, filtered image, clusters, association, identities,
Kalman and particle filter; scores by eqs. 4.1 to 4.7.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.metrics import clear_mot, sightings, sightings_of
from elusive.systems.links.by_image import ImageChain, ImageChainState
from elusive.systems.links.scene import LinkScene, Radiated, radiate, received
from elusive.systems.links.smoothing import SmoothedTrack
from elusive.tracking.people import Event

GATE_M = 2.0  # of a pair, section 4.1
ESTIMATORS = ("plain", "kalman", "particle")


class SceneTrack(NamedTuple):
    """A track in a frame."""

    track: int
    confirmed: bool
    places: Array  # (3, 2) by each of ESTIMATORS [m]


class SceneFrame(NamedTuple):
    """Every stage of one frame."""

    image: Array  # (V,) estimate [dB]
    threshold: float  # that its voxels had to exceed [dB]
    clusters: NDArray[np.int64]  # (V,) number of each voxel's cluster from 1; 0: below the threshold
    heads: Array  # (H, 2) [m]
    remembered: Array  # (R, 2) earlier places that heads were compared with [m]
    tracks: tuple[SceneTrack, ...]
    events: tuple[Event, ...]


class SceneRun(NamedTuple):
    """A scene and what became of it."""

    scene: LinkScene
    radiated: Radiated
    frames: tuple[SceneFrame, ...]


def run_link_scene(
    scene: LinkScene, radiated: Radiated | None = None, *, on_frame: Callable[[int], None] | None = None
) -> SceneRun:
    """Draw the links of a scene and track its people.

    Parameters
    ----------
    scene
        Complete: equal scenes give equal runs.
    radiated
        From :func:`~elusive.systems.links.scene.radiate` with the same scene; by default it is drawn here.
    on_frame
        Called with the number of frames done. What it raises ends the run.

    Raises
    ------
    DataError
        If the nodes are no network, no link passes the area, or the empty area shows no noise to calibrate on.
    """
    radiated = radiate(scene) if radiated is None else radiated
    *_, linked, own = scene.streams()
    simulation = scene.simulation
    method = scene.method.replace(voxel_m=simulation.voxel_m, weights=simulation.weights)
    nodes = scene.network()
    chain = method.on(nodes, scene.area)
    weights = simulation.weights.sparse(nodes, chain.grid)
    stages = Stages(scene, chain, np.array(list(received(scene, weights, radiated.empty, linked))), own)
    frames: list[SceneFrame] = []
    for change in received(scene, weights, radiated.images, linked):
        frames.append(stages.step(change))
        if on_frame is not None:
            on_frame(len(frames))
    return SceneRun(scene, radiated, tuple(frames))


class Stages:
    """The chain and the particle filters behind it, a frame at a time.

    Parameters
    ----------
    scene
        Whose method.
    chain
        Prepared for the scene's network.
    empty
        ``(K, L)`` changes of the links while nobody was there [dB].
    rng
        Source of randomness of the filters.
    """

    def __init__(self, scene: LinkScene, chain: ImageChain, empty: Array, rng: Generator) -> None:
        self._scene, self._chain, self._rng = scene, chain, rng
        self._state = chain.init(empty)
        self._particles: dict[int, SmoothedTrack] = {}

    @property
    def nobody(self) -> bool:
        """Whether nobody is tracked."""
        return not self._state.people.tracks

    def step(self, change: Array) -> SceneFrame:
        """Return every stage of the next frame, from the changes ``(L,)`` of its links [dB]."""
        before, self._state = self._state, self._chain.step(self._state, change, self._rng)
        heads = {one.track: None if one.missed else np.array(one.position) for one in self._state.people.tracks}
        self._particles = self._scene.particle.step(self._particles, heads, self._rng)
        return _frame(self._scene, self._chain, before, self._state, self._particles)


def _frame(
    scene: LinkScene,
    chain: ImageChain,
    before: ImageChainState,
    state: ImageChainState,
    particles: dict[int, SmoothedTrack],
) -> SceneFrame:
    """Keep a frame; the thesis counts observations, so that its tracker's tracks without a head are not shown."""
    observed = scene.method.tracker.kind == "radius"
    tracks = tuple(
        SceneTrack(
            one.track, one.status == "confirmed",
            np.array([one.position, state.smoothed[one.track].position, particles[one.track].position]),
        )
        for one in state.people.tracks
        if one.status != "deleted" and not (observed and one.missed)
    )  # fmt: skip
    level = before.threshold.level
    bright = np.flatnonzero(state.image > max(level, scene.method.clusters.sidelobe * state.image.max(), 0.0))
    if len(bright) > scene.method.clusters.most_voxels:
        order = np.argsort(-state.image[bright], kind="stable")
        bright = np.sort(bright[order[: scene.method.clusters.most_voxels]])
    clusters = np.zeros(len(state.image), np.int64)
    if len(bright):
        clusters[bright] = 1 + scene.method.clusters.label(chain.grid.centres[bright])
    memory = getattr(before.people, "memory", None)
    known = (
        [one.position for one in before.people.tracks if one.status != "deleted"]
        if memory is None
        else [place for seen in memory for place in seen.positions]
    )
    return SceneFrame(
        state.image.astype(np.float32), level, clusters, state.heads.positions, np.array(known).reshape(-1, 2), tracks,
        state.events,
    )  # fmt: skip


class SceneScores(NamedTuple):
    """How well a run tracked: eqs. 4.1 to 4.7."""

    targets: int  # true places in all frames
    misses: int
    false_positives: int
    mismatches: int
    mota: float
    deviations: Array  # (M, 3) of each pair by each of ESTIMATORS [m]

    @property
    def mean_deviation_m(self) -> Array:
        """Mean by each of ESTIMATORS, ``(3,)``; NaN without a pair."""
        return self.deviations.mean(axis=0) if len(self.deviations) else np.full(len(ESTIMATORS), np.nan)

    @property
    def max_deviation_m(self) -> Array:
        """Greatest by each of ESTIMATORS, ``(3,)``; NaN without a pair."""
        return self.deviations.max(axis=0) if len(self.deviations) else np.full(len(ESTIMATORS), np.nan)


def score_scene(run: SceneRun, *, confirmed_only: bool = False) -> SceneScores:
    """Compare a run's tracks with the truth.

    Parameters
    ----------
    run
        From :func:`run_link_scene`.
    confirmed_only
        Whether candidates are left out; the thesis counts them.

    Raises
    ------
    DataError
        If nobody walks in the scene: then there is nothing to score by.
    """
    truth = run.radiated.truth
    if not np.isfinite(truth).any():
        raise DataError("paths: nobody walks in the scene, so that there is nothing to score by; create paths.")
    rows = [
        (number, one)
        for number, frame in enumerate(run.frames)
        for one in frame.tracks
        if one.confirmed or not confirmed_only
    ]
    found = sightings(
        np.array([number for number, _ in rows], np.int64), np.array([one.track for _, one in rows], np.int64),
        np.array([one.places[0] for _, one in rows]).reshape(-1, 2),
    )  # fmt: skip
    mot = clear_mot(sightings_of(truth), found, GATE_M, len(run.frames))
    places = {(number, one.track): one.places for number, one in rows}
    apart = [places[frame, track] - truth[frame, target] for frame, target, track in mot.pairs.tolist()]
    deviations = np.linalg.norm(np.array(apart).reshape(-1, len(ESTIMATORS), 2), axis=2)
    return SceneScores(
        int(mot.targets.sum()), int(mot.misses.sum()), int(mot.false_positives.sum()), int(mot.mismatches.sum()),
        mot.mota, deviations,
    )  # fmt: skip
