"""What existence is worth on recordings: tracks of an existence are there again as often as it says.

Targets are painted in at random; a track is there again if two of the next five frames hold a peak as bright within
2.5 px of where it should be. What is 8 to 16 px beside it counts as chance. Labels and paint are for scoring alone.
"""

from __future__ import annotations

import zlib
from typing import NamedTuple

import numpy as np
import pytest
from scipy.spatial import cKDTree

from elusive.preprocess.peaks import PeakFinder, Peaks
from elusive.tracking.peaks import PeakBelief, SceneTracker
from tests import infrared

pytestmark = pytest.mark.skipif(
    not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA} is missing; point ELUSIVE_DATA at the data"
)
LONGEST, NEXT, AGAIN, NEAR_PX, LEVEL = 150, 5, 2, 2.5, 0.9
PAINTED, PAINTINGS = 12, 4  # targets at a time, and times: some 340 of each half
HALVES = (  # each holds of every camera and length
    ("easy2", "sequence7", "easy4", "easy6", "sequence11", "IR_BIRD_071", "IR_DRONE_151"),
    (
        "sequence1", "IR_AIRPLANE_027", "IR_AIRPLANE_044", "IR_BIRD_072", "IR_DRONE_059", "IR_DRONE_142",
        "IR_HELICOPTER_045",
    ),
)  # fmt: skip


class Tracked(NamedTuple):
    peaks: list[Peaks]
    beliefs: list[PeakBelief]


def found(frames: np.ndarray) -> list[Peaks]:
    finder, peaks = PeakFinder(), []
    state = finder.init()
    for frame in frames:
        state = finder.step(state, frame)
        peaks.append(state.output)
    return peaks


def painted(name: str, seed: int) -> Tracked:
    """The first frames of a recording with a dozen moving targets painted in, tracked."""
    whole = infrared.read(name)
    sequence = whole._replace(frames=whole.frames[:LONGEST], labels=whole.labels[:LONGEST])
    way = np.array([peaks.offset_px for peaks in found(sequence.frames)])
    rng = np.random.default_rng(zlib.crc32(name.encode()) + seed)
    peaks = found(infrared.paint(sequence, way, rng, PAINTED).sequence.frames)
    tracker = SceneTracker()
    beliefs = [tracker.begin()]
    for k, one in enumerate(peaks):
        beliefs.append(tracker.follow(beliefs[-1], float(k), one, sequence.frames.shape[1:], 1.0))
    return Tracked(peaks, beliefs[1:])


def features(places: np.ndarray, height: np.ndarray) -> np.ndarray:
    level = np.log(np.maximum(np.abs(height), 1e-3)) / LEVEL
    return np.column_stack([places / NEAR_PX, level, 100.0 * (height > 0)])


def became(tracked: Tracked, rng: np.random.Generator) -> np.ndarray:
    """Existence of every track at every third time, whether it is there again, and whether by chance, ``(n, 3)``."""
    few = SceneTracker().most_peaks
    trees = [cKDTree(features((p.places_px - p.offset_px)[:few], p.contrast[:few])) for p in tracked.peaks]
    rows = []
    for k in range(infrared.FIRST, len(trees) - NEXT, 3):
        tracks = [track for track in tracked.beliefs[k].tracks if np.isfinite(track.existence)]
        if not tracks or any(peaks.cut for peaks in tracked.peaks[k + 1 : k + NEXT + 1]):
            continue
        mean = np.array([track.mean for track in tracks])
        height = np.array([track.extra["intensity"] for track in tracks])
        angle, far = rng.uniform(0, 2 * np.pi, len(tracks)), rng.uniform(8, 16, len(tracks))
        beside = far[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        seen = np.zeros((len(tracks), 2), int)
        for later in range(1, NEXT + 1):
            place = mean[:, [0, 2]] - tracked.peaks[k].offset_px + later * mean[:, [1, 3]]
            for a, at in enumerate((place, place + beside)):
                seen[:, a] += trees[k + later].query(features(at, height))[0] < 1
        rows.append(np.column_stack([[track.existence for track in tracks], seen >= AGAIN]))
    return np.concatenate(rows)


def by_tenth(rows: np.ndarray) -> np.ndarray:
    """Of each tenth of existence: how many, mean existence, share there again beyond chance, ``(10, 3)``."""
    tenth = np.minimum((10 * rows[:, 0]).astype(int), 9)
    table = []
    for one in range(10):
        count, (existence, again, chance) = (tenth == one).sum(), rows[tenth == one].mean(axis=0)
        table.append((count, existence, (again - chance) / (1 - chance)))
    return np.array(table)


@pytest.mark.validate
@pytest.mark.parametrize("names", HALVES, ids=["first", "second"])
def test_tracks_are_there_again_as_often_as_existence_says(names):
    rng = np.random.default_rng(1)
    table = by_tenth(np.concatenate([became(painted(name, k), rng) for k in range(PAINTINGS) for name in names]))
    count, existence, again = table.T
    off = np.abs(again - existence)
    told = f"how many, existence, there again:\n{np.round(table, 2)}"
    assert (count >= 20).all(), told
    assert np.average(off, weights=count) < 0.05, told
    assert (off < 0.1).all(), told


def test_too_short_a_recording_tells_no_existence():
    rng = np.random.default_rng(3)
    tracker = SceneTracker()
    belief = tracker.begin()
    for k, peaks in enumerate(found(rng.normal(100, 3, (5, 64, 64)))):
        belief = tracker.follow(belief, float(k), peaks, (64, 64), 1.0)
        assert all(np.isnan(track.existence) for track in belief.tracks)
