"""What is shown of objects many pixels wide, in drawn frames."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from elusive.systems.images.track import ImageTracking, track_images
from elusive.tracking.peak_bodies import leave_parts
from elusive.tracking.peak_companions import leave_companions, leave_layers
from elusive.tracking.peak_targets import PeakTargets
from tests.longer import longer

FRAMES, ROWS, COLUMNS = 60, 96, 176
MOTORS = np.array([[-11.0, -5.0], [11.0, -5.0], [-11.0, 5.0], [11.0, 5.0], [0.0, 0.0]])


def shown(frames: np.ndarray) -> list[np.ndarray]:
    """Where tracks are shown in each frame, ``(n, 2)``."""
    steps = track_images(frames, ImageTracking().bind(frames.shape[1:]))
    return [
        np.array([t.mean[[0, 2]] for t in step.tracks if t.extra["shown"] and t.status == "confirmed"]).reshape(-1, 2)
        for step in steps
    ]


def scene(seed: int) -> tuple[np.random.Generator, np.ndarray]:
    """Still clouds with a little noise, and where what flies is in each frame, ``(n, 2)``."""
    rng = np.random.default_rng(seed)
    clouds = 25 * ndimage.gaussian_filter(rng.normal(size=(ROWS, COLUMNS)), 9) * 9
    frames = 100 + clouds + rng.normal(0, 1.5, (FRAMES, ROWS, COLUMNS))
    return rng, frames


@pytest.mark.parametrize("sign", longer([1.0, -1.0], -1.0))
def test_a_machine_of_several_hot_parts_is_one_track_at_its_middle(sign: float) -> None:
    _, frames = scene(5)
    y, x = np.mgrid[:ROWS, :COLUMNS]
    way = np.stack([40 + 1.6 * np.arange(FRAMES), 48 + 3 * np.sin(np.arange(FRAMES) / 15)], axis=1)
    for frame, place in zip(frames, way, strict=True):
        body = sum(np.exp(-((x - place[0] - a) ** 2 + (y - place[1] - b) ** 2) / 4.5) for a, b in MOTORS)
        along = np.abs(x - place[0]) < 11
        arms = (np.abs(np.abs(y - place[1]) - 5 / 11 * np.abs(x - place[0])) < 1.5) & along
        frame += sign * (70 * body + 18 * ndimage.gaussian_filter(arms.astype(float), 0.7))
    found = shown(np.round(frames))
    late = range(40, FRAMES)
    apart = [np.hypot(*(found[k] - way[k]).T) for k in late]
    # .95: a track may be missed now and then; at each of five parts 6 px or 12 px off it would be none
    assert np.mean([bool((off < 2.5).any()) for off in apart]) >= 0.95
    assert np.mean([len(off) for off in apart]) < 1.3


def test_a_point_that_passes_before_a_cloud_stays_where_it_is() -> None:
    _, frames = scene(6)
    y, x = np.mgrid[:ROWS, :COLUMNS]
    frames += 40 * np.exp(-((((x - 96) ** 2 + (y - 48) ** 2) / (2 * 6.0**2)) ** 4))
    way = np.stack([40 + 1.6 * np.arange(FRAMES), np.full(FRAMES, 45.0)], axis=1)
    for frame, place in zip(frames, way, strict=True):
        frame += 70 * np.exp(-((x - place[0]) ** 2 + (y - place[1]) ** 2) / 2)
    found = shown(np.round(frames))
    apart = [np.hypot(*(found[k] - way[k]).T).min(initial=np.inf) for k in range(25, FRAMES)]
    assert np.mean(np.array(apart) < 1.5) >= 0.95


def targets_at(place: np.ndarray, velocity: np.ndarray, strength: np.ndarray, bright: np.ndarray) -> PeakTargets:
    """Targets of scale 1 of one motion."""
    n = len(place)
    none = PeakTargets.none(1, 1)
    return none._replace(
        number=np.arange(n), place=place[:, None], velocity=velocity[:, None], weight=np.ones((n, 1)),
        strength=strength, scale=np.ones(n), bright=bright, shown=np.zeros(n, np.bool_),
    )  # fmt: skip


@pytest.mark.parametrize(("apart", "left"), [(12.0, 1), (60.0, 0)])
def test_four_that_go_together_are_a_layer_where_they_are_far_apart_else_one_thing(apart: float, left: int) -> None:
    place = apart * np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    targets = targets_at(place, np.full((4, 2), 1.0), np.full(4, 6.0), np.ones(4, np.bool_))
    seen = np.ones(4, np.bool_)
    leave_layers(targets, seen, np.ones(4, np.bool_), 30.0)
    assert seen.sum() == left


@pytest.mark.parametrize(
    ("strength", "bright", "velocity", "off", "left"),
    [
        (2.0, False, 0.0, 8.0, False),  # what rings
        (2.0, True, 0.0, 8.0, True),  # a weak one of the same polarity that rests, as it passes
        (2.0, True, 2.0, 8.0, False),  # what trails
        (5.0, False, 0.0, 8.0, True),  # a dark one nearly as strong
        (2.0, False, 0.0, 12.0, True),  # too far off
    ],
)
def test_what_rings_about_a_strong_one_is_not_shown(
    strength: float, bright: bool, velocity: float, off: float, left: bool
) -> None:
    place, way = np.array([[50.0, 50], [50 + off, 50]]), np.array([[2.0, 0], [velocity, 0]])
    targets = targets_at(place, way, np.array([6.0, strength]), np.array([True, bright]))
    seen = np.ones(2, np.bool_)
    leave_companions(targets, seen)
    assert seen.tolist() == [True, left]


@pytest.mark.parametrize("shown_before", [0, 1])
def test_what_rings_about_a_strong_one_does_not_take_its_place_in_a_body(shown_before: int) -> None:
    place = np.array([[50.0, 50], [54, 50]])
    targets = targets_at(place, np.full((2, 2), 1.0), np.array([10.0, 4.0]), np.array([True, False]))
    body = np.array([[0.0, 0, 0, 0, 12, 20], [-4, 0, -4, 0, 12, 20]])
    seen = np.ones(2, np.bool_)
    leave_parts(targets._replace(body=body, shown=np.arange(2) == shown_before), seen)
    assert seen.tolist() == [True, False]
