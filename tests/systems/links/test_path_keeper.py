"""Tracks kept for the report of a long log: all of a short one, evenly thinned and bounded of a long one."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.systems.links.report import PathKeeper, PathPoint


def point(track: int, frame: int) -> PathPoint:
    return PathPoint(track, (frame + track / 10, -frame), (0.1 * track, 0.2), 1 / (1 + frame), frame % 3 > 0)


def present(frame: int) -> list[int]:
    """Numbers of the tracks of a frame, in no order: one all the time, one each 7th frame, one for a while."""
    return [*([9] if 20 <= frame < 90 else []), *([4] if frame % 7 == 0 else []), 2]


@pytest.mark.parametrize("frames", [0, 1, 40, 41, 300, 5000])
@pytest.mark.parametrize("limits", [{"frames": 40}, {"points": 60}, {"frames": 64, "points": 70}])
def test_each_so_many_th_frame_is_kept(frames: int, limits: dict[str, int]) -> None:
    keeper = PathKeeper(**limits)
    for frame in range(frames):
        keeper.offer(0.5 * frame, [point(track, frame) for track in present(frame)])
    kept = range(0, frames, keeper.every)
    paths = keeper.paths()
    assert keeper.times_s.tolist() == [0.5 * frame for frame in kept]
    assert sorted(paths) == sorted({track for frame in kept for track in present(frame)})
    for track, path in paths.items():
        there = [(number, frame) for number, frame in enumerate(kept) if track in present(frame)]
        points = [point(track, frame) for _, frame in there]
        assert path.track == track
        assert path.frames.tolist() == [number for number, _ in there]
        np.testing.assert_array_equal(path.places, [one.place for one in points])
        np.testing.assert_array_equal(path.deviation, [one.deviation for one in points])
        np.testing.assert_array_equal(path.existence, [one.existence for one in points])
        assert path.confirmed.tolist() == [one.confirmed for one in points]
    held = sum(len(path.frames) for path in paths.values())
    assert len(kept) <= limits.get("frames", frames)
    assert held <= limits.get("points", held)
    if keeper.every > 1:  # no more is dropped than must be
        twice = range(0, frames, keeper.every // 2)
        points_twice = sum(len(present(frame)) for frame in twice)
        assert len(twice) > limits.get("frames", frames) or points_twice > limits.get("points", points_twice)


def test_very_many_tracks_in_a_frame_are_kept() -> None:
    """One frame is kept whatever it holds, but it alone."""
    keeper = PathKeeper(points=100)
    for frame in range(5):
        keeper.offer(float(frame), [point(track, frame) for track in range(1000)])
    assert keeper.times_s.tolist() == [0.0]
    assert len(keeper.paths()) == 1000
