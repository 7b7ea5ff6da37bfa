"""Recorded infrared with its target scaled or painted out, and the runs that are scored on it.

The labels place the patch that is changed, and score the result.
"""

from __future__ import annotations

import csv
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from elusive.io import open_frames
from elusive.preprocess.registration import Registration
from elusive.systems.images.track import ImageTracking, track_images
from tests import recordings

DATA = recordings.DATA / "infrared"
HALF_PX = {
    "easy2": 9, "sequence1": 7, "easy4": 8, "sequence11": 10, "IR_AIRPLANE_027": 6,
    "IR_AIRPLANE_044": 7, "IR_BIRD_071": 7, "IR_BIRD_072": 7, "IR_DRONE_059": 8, "IR_DRONE_142": 7,
    "IR_DRONE_151": 7, "IR_HELICOPTER_045": 9,
}  # fmt: skip
"""How far a target goes from its label, halo and all: there frames with it and without differ as anywhere. Else 4."""
WARM_UP = 8  # frames before the filter begins
SEQUENCES = ("easy2", "sequence1", "easy4", "easy6", "sequence7", "sequence11")
CLIPS = tuple(
    f"IR_{name}"
    for name in (
        "AIRPLANE_027", "AIRPLANE_044", "BIRD_071", "BIRD_072", "DRONE_059", "DRONE_142", "DRONE_151", "HELICOPTER_045",
    )
)  # fmt: skip
FIRST = 10  # frame from which a recording is scored
MOVED_PX, DUE = 5.0, 30  # a target that has moved so far against the scene is to be shown so many frames later


class Sequence(NamedTuple):
    """A recording and its labels."""

    frames: np.ndarray  # (n, rows, columns) grey levels
    labels: np.ndarray  # (n, 2) x, y, 0-based pixel centres, NaN where it is not in view
    near_px: float = 4.0  # distance from a label within which a track is at the target
    half_px: int = 4  # the patch that is changed is of so many pixels about the label's


def read(name: str) -> Sequence:
    """Read a recording: a sequence, whose labels are 1-based, or a clip, whose are not."""
    if name in SEQUENCES:
        labels = np.loadtxt(DATA / f"{name}.txt") - 1
        return Sequence(np.stack(list(open_frames(DATA / name))), labels, half_px=HALF_PX.get(name, 4))
    frames = np.stack(list(open_frames(DATA / "clips" / f"{name}.mp4")))
    labels = np.full((len(frames), 2), np.nan)
    with (DATA / "clips" / f"{name}.csv").open() as lines:
        for row in csv.DictReader(lines):
            if row["x_px"] and int(row["frame"]) < len(frames):
                labels[int(row["frame"])] = float(row["x_px"]), float(row["y_px"])
    return Sequence(frames, labels, 6.0, HALF_PX[name])


def target_free(sequence: Sequence, labels: np.ndarray, neighbours: int = 7) -> list[np.ndarray | None]:
    """Each frame's patch about its label as it is without the target; None where the label is NaN.

    It is the median of the nearest frames, earlier or later, laid over this one, in which the target, halo and all, is
    beside the patch; without a label it may be anywhere. That median is lifted to agree with this frame in the median
    over the three pixels round the patch. Where the target stands so long that there is no such frame, it is what lies
    beside it in this frame, the side whose own surroundings agree best with those of the patch.
    """
    frames = sequence.frames
    registration = Registration()
    steps = [registration.offset(a, b) for a, b in pairwise(frames)]
    offsets = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    scene = labels - offsets
    reach, clear_px = sequence.half_px + 3, max(8, 2 * sequence.half_px)
    ring = np.ones((2 * reach + 1,) * 2, dtype=bool)
    ring[3:-3, 3:-3] = False
    patches: list[np.ndarray | None] = []
    for k, frame in enumerate(frames):
        if np.isnan(labels[k]).any():
            patches.append(None)
            continue
        column, row = np.round(labels[k]).astype(int)
        y, x = np.mgrid[row - reach : row + reach + 1, column - reach : column + reach + 1].astype(float)
        views: list[np.ndarray] = []
        for j in np.argsort(np.abs(np.arange(len(frames)) - k), kind="stable"):
            if not np.abs(scene[j] - scene[k]).max() >= clear_px:
                continue
            dx, dy = registration.refine(frame, frames[j], offsets[j] - offsets[k])
            view = ndimage.map_coordinates(frames[j], [y + dy, x + dx], order=3, cval=np.nan)
            if np.isfinite(view).all():
                views.append(view)
            if len(views) == neighbours:
                break
        patch = (
            np.median(views, axis=0) if views else _beside(frame, int(row), int(column), reach, ring, max(12, clear_px))
        )
        patch += np.median((frame[row - reach : row + reach + 1, column - reach : column + reach + 1] - patch)[ring])
        patches.append(patch[3:-3, 3:-3])
    return patches


def _beside(frame: np.ndarray, row: int, column: int, reach: int, ring: np.ndarray, away_px: int) -> np.ndarray:
    """What lies so far beside a place in the same frame, with the surroundings most like the place's own."""
    own = frame[row - reach : row + reach + 1, column - reach : column + reach + 1]
    found: list[tuple[float, np.ndarray]] = []
    for turn in np.arange(16) * np.pi / 8:
        y, x = row + round(away_px * np.sin(turn)), column + round(away_px * np.cos(turn))
        if not (reach <= y < len(frame) - reach and reach <= x < frame.shape[1] - reach):
            continue
        there = frame[y - reach : y + reach + 1, x - reach : x + reach + 1].astype(float)
        found.append((float(np.std((there - own)[ring])), there))
    return min(found, key=lambda one: one[0])[1]


def scale(
    sequence: Sequence,
    factor: float,
    labels: np.ndarray | None = None,
    patches: list[np.ndarray | None] | None = None,
) -> Sequence:
    """The recording with its target's contrast times a factor; 0 paints it out. ``labels``: another target's.

    ``patches``: what :func:`target_free` gave, which takes seconds and is the same for every factor.
    """
    labels = sequence.labels if labels is None else labels
    patches = target_free(sequence, labels) if patches is None else patches
    frames = sequence.frames.copy()
    for frame, patch, label in zip(frames, patches, labels, strict=True):
        if patch is None:
            continue
        x, y = np.round(label).astype(int)
        half = len(patch) // 2
        place = (slice(y - half, y + half + 1), slice(x - half, x + half + 1))
        frame[place] = patch + factor * (frame[place] - patch)
    return sequence._replace(frames=np.clip(np.round(frames), 0, 255))


class Painted(NamedTuple):
    """A recording with targets painted in, and where they are."""

    sequence: Sequence
    places: np.ndarray  # (n, targets, 2) x, y; NaN where there is none


def paint(sequence: Sequence, way: np.ndarray, rng: np.random.Generator, targets: int = 10) -> Painted:
    """Paint moving targets in at random, bright and dark, at least 20 px from the label and from each other.

    Point spread .8 to 2 px, .2 to 3 px a frame against the scene, a peak of 3 to 10 deviations of what is left of its
    surroundings less their median of 5 x 5, 20 to 60 frames long, the first and last five fading.

    ``way`` is where the scene of the first frame is in each, ``(n, 2)``: targets move with it.
    """
    frames = sequence.frames.astype(float)
    count, rows, columns = frames.shape
    places = np.full((count, targets, 2), np.nan)
    y, x = np.mgrid[:rows, :columns]
    for target in range(targets):
        for _ in range(200):
            life = int(rng.integers(20, min(61, count - FIRST // 2)))
            when = np.arange(life) + rng.integers(FIRST // 2, count - life + 1)
            angle, speed = rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 3.0)
            start = rng.uniform(10, [columns - 10, rows - 10])
            along = np.arange(life)[:, None] * speed * np.array([np.cos(angle), np.sin(angle)])
            path = start + along + way[when] - way[when[0]]
            others = np.concatenate([sequence.labels[when][:, None], places[when]], axis=1)
            apart = np.hypot(*np.moveaxis(others - path[:, None], 2, 0))
            inside = ((path > 5) & (path < [columns - 6, rows - 6])).all()
            if inside and not (apart < 20).any():
                break
        else:
            continue
        spread, snr, sign = rng.uniform(0.8, 2.0), rng.uniform(3.0, 10.0), rng.choice([-1.0, 1.0])
        fade = np.clip((np.minimum(np.arange(life), np.arange(life)[::-1]) + 1) / 6, 0, 1)
        noise = []
        for k, (u, v) in zip(when, path, strict=True):
            near = sequence.frames[k, max(0, int(v) - 10) : int(v) + 11, max(0, int(u) - 10) : int(u) + 11]
            left = near - ndimage.median_filter(near.astype(float), 5)
            noise.append(1.4826 * np.median(np.abs(left)))
        height = sign * snr * max(float(np.median(noise)), 0.3)  # a third: of grey levels, rounded
        for k, (u, v), part in zip(when, path, fade, strict=True):
            frames[k] += part * height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * spread**2))
        places[when, target] = path
    return Painted(sequence._replace(frames=np.clip(np.round(frames), 0, 255)), places)


class Score(NamedTuple):
    """How well the labelled target is followed and shown, from the tenth frame on."""

    followed: float  # share of its frames with a confirmed track at it, of existence above one half or not told yet
    shown: float  # share of the frames in which it is due with a shown track at it; NaN where there is none
    due: int  # frames from thirty after it has moved, or in which it is the strongest peak
    others: float  # other shown tracks a frame
    brightest: float  # share of its frames in which the strongest peak, alone, is at it
    existence: float  # mean of the greatest existence of anything shown at it, 1 where it is not told yet
    sure: float  # other shown tracks a frame of existence above .9
    seen: float  # share of all frames of its with a shown track at it, due or not


def score(sequence: Sequence) -> Score:
    """Track through the raw frames without any option, and score by the labels."""
    frames, labels, near_px = sequence[:3]
    steps = list(track_images(frames, ImageTracking().bind(frames.shape[1:])))
    peaks = [step.state.peaks for step in steps]
    in_view = np.flatnonzero(np.isfinite(labels[:, 0]))
    way = labels - np.array([found.offset_px for found in peaks])
    gone = np.flatnonzero(np.hypot(*(way - way[in_view[0]]).T) > MOVED_PX) if len(in_view) else []
    due_from = gone[0] + DUE if len(gone) else len(frames)
    followed, shown, brightest, others, existence, sure_others, there = [], [], [], [], [], [], []
    for k, step in enumerate(steps[FIRST:], FIRST):
        at = {
            track.track: np.isfinite(labels[k, 0]) and np.hypot(*(track.mean[[0, 2]] - labels[k])) <= near_px
            for track in step.tracks
        }
        sure = [track for track in step.tracks if track.status == "confirmed"]
        seen = [track for track in sure if track.extra["shown"]]
        others.append(sum(not at[track.track] for track in seen))
        sure_others.append(sum(not at[track.track] and track.existence > 0.9 for track in seen))
        if np.isnan(labels[k, 0]):
            continue
        followed.append(any(at[track.track] and not track.existence <= 0.5 for track in sure))
        brightest.append(bool(np.hypot(*(peaks[k].places_px[0] - labels[k])) <= near_px))
        existence.append(
            max((np.nan_to_num(track.existence, nan=1.0) for track in seen if at[track.track]), default=0.0)
        )
        there.append(any(at[track.track] for track in seen))
        if k >= due_from or brightest[-1]:
            shown.append(there[-1])
    return Score(
        float(np.mean(followed)),
        float(np.mean(shown)) if shown else np.nan,
        len(shown),
        float(np.mean(others)),
        float(np.mean(brightest)),
        float(np.mean(existence)),
        float(np.mean(sure_others)),
        float(np.mean(there)),
    )
