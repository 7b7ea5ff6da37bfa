"""Noise objects in images: found where they are and once, whatever the statistic; noise alone is left alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.signal import lfilter

from elusive.cli import main
from elusive.errors import ParameterError
from elusive.preprocess.sliding import Window
from elusive.results import read_tracks_csv
from elusive.sensors import NoiseObject, NoiseObjectPath, NoiseRecording
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.track import ImageTracking
from tests.longer import longer

FRAMES = 30


def simulated(seed: int, side: int, fastest: float, **sensor: Any) -> NoiseRecording:
    """An object of 5 x 5, deviation 3 on 1, whose velocity is drawn from the box, in view throughout."""
    rng = np.random.default_rng([7, seed])
    velocity = rng.uniform(-fastest, fastest, 2)
    way = velocity * (FRAMES - 1) / 2
    middle = rng.uniform(np.abs(way) + 4, side - 4 - np.abs(way))
    path = NoiseObjectPath(start=tuple((middle - way).tolist()), velocity=tuple(velocity.tolist()))
    given = {"object_deviation": 3.0, "mode": "replacing", "border": "bounded", **sensor}
    return NoiseObject(shape=(side, side), **given).simulate_sequence(FRAMES, [path], rng)


def tracking(fastest: float, side: int, **given: Any) -> ImageTracking:
    sensor = {"kind": "white", "noise_sigma": 1.0}
    flt = {"kind": "recurrent", "sensor": sensor, "statistic": {"kind": "llr"}, "max_velocity": fastest} | given
    return ImageTracking(filter=flt).bind((side, side))


@cache
def begun(side: int, fastest: float, kind: str = "llr") -> tuple[Any, Any]:
    """The filter, and its state before any frame, for which noise has been simulated."""
    flt: Any = tracking(fastest, side, statistic={"kind": kind}).recursion
    return flt, flt.init(np.random.default_rng(0), 0.0)


def run(frames: NDArray[np.float64], side: int, fastest: float, kind: str = "llr") -> Iterator[list[Any]]:
    """Yield the confirmed tracks after each frame."""
    rng = np.random.default_rng(0)
    flt, start = begun(side, fastest, kind)
    state = start._replace(followed=flt.init_followed(rng))
    for number, frame in enumerate(frames):
        state = flt.step(state, float(number), frame, rng)
        yield [track for track in state.tracks if track.status == "confirmed"]


def found(side: int, fastest: float, runs: int, kind: str = "llr") -> tuple[int, int]:
    """Count the runs whose one confirmed track ends within 1.5 px of the object; and those with another, ever."""
    good = ghosts = 0
    for seed in range(runs):
        recording = simulated(seed, side, fastest)
        steps = list(run(recording.frames, side, fastest, kind))
        apart = [np.hypot(*np.subtract(track.position, recording.truth[-1, 0, [0, 2]])) for track in steps[-1]]
        good += len(apart) == 1 and apart[0] <= 1.5
        ghosts += len({track.track for confirmed in steps for track in confirmed}) > 1
    return good, ghosts


@pytest.mark.parametrize("runs", longer([5, 10], 10))
def test_an_object_is_one_track_where_it_is(runs: int) -> None:
    assert found(64, 1.0, runs) == (runs, 0)


@pytest.mark.thorough
def test_in_95_of_100_runs_of_full_size() -> None:
    good, ghosts = found(256, 4.0, 100)
    assert good >= 95
    assert ghosts == 0


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["std", "chi2", "dot"])
def test_the_other_statistics_find_it_too(kind: str) -> None:
    assert found(48, 0.5, 2, kind) == (2, 0)


def test_noise_alone_has_no_track() -> None:
    rng = np.random.default_rng(5)
    assert not any(run(rng.standard_normal((60, 64, 64)), 64, 1.0))


def test_noise_that_is_louder_in_places_is_no_object() -> None:
    """The background's deviation rises from 1 to 3 across the frame; an object of 3 on 1 is found in its quiet half."""
    loud = np.linspace(1.0, 3.0, 64)
    rng = np.random.default_rng(6)
    path = 10.0 + 0.4 * np.arange(40)
    frames = loud * rng.standard_normal((40, 64, 64))
    assert not any(run(frames, 64, 1.0))
    for frame, x in zip(frames, path, strict=True):
        place = np.ceil(x - 2.5).astype(int) + np.arange(5)
        frame[30:35, place] = 4.5 * rng.standard_normal((5, 5))
    *_, (track,) = run(frames, 64, 1.0)
    assert np.hypot(*np.subtract(track.position, (path[-1], 32))) < 1.5


@pytest.mark.thorough
def test_noise_that_goes_on_from_frame_to_frame_is_no_object() -> None:
    """As of detectors that answer slowly: .8 of each pixel comes again; within it an object of 3 on 1 is found."""
    rng = np.random.default_rng(8)
    frames = 100 + lfilter([1], [1, -0.8], rng.standard_normal((80, 64, 64)), axis=0)[20:]
    flt: Any = tracking(0.5, 64, sensor={"kind": "clutter"}, smoothing=0.8).recursion
    start = flt.init(np.random.default_rng(0), 0.0)

    def confirmed(frames: NDArray[np.float64]) -> list[list[Any]]:
        state, found = start._replace(followed=flt.init_followed(rng)), []
        for number, frame in enumerate(frames):
            state = flt.step(state, float(number), frame, rng)
            found.append([track for track in state.tracks if track.status == "confirmed"])
        return found

    assert not any(confirmed(frames))
    for number, frame in enumerate(frames[20:]):
        x = 10 + round(0.4 * number)
        frame[18:23, x - 2 : x + 3] += np.sqrt(8) * rng.standard_normal((5, 5))
    (track,) = confirmed(frames)[-1]
    assert np.hypot(*np.subtract(track.position, (x, 20))) < 1.5


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("sensor", "learns"),
    [
        ({"kind": "clutter"}, True),
        ({"kind": "white", "noise_sigma": 1.0}, False),
    ],
)
def test_recorded_evidence_is_held_against_the_clutter_and_white_noise_against_itself(
    sensor: dict[str, Any], learns: bool
) -> None:
    """Under a level that lasts for fifteen frames there were 17 tracks in three such recordings, and are 4."""
    rng, level, kept = np.random.default_rng(0), np.zeros((48, 48)), math.exp(-1 / 15)
    flt: Any = tracking(2.0, 48, sensor=sensor).recursion
    state, numbers = flt.init(np.random.default_rng(0), 0.0), set[int]()
    for number in range(80):
        fresh = gaussian_filter(rng.standard_normal((48, 48)), 5, mode="wrap") * 5 * math.sqrt(4 * math.pi)
        level = kept * level + math.sqrt(1 - kept**2) * fresh
        state = flt.step(state, float(number), np.exp(0.5 * level) * rng.standard_normal((48, 48)), rng)
        numbers |= {track.track for track in state.tracks if track.status == "confirmed"}
    assert (state.followed.search.recurrent.belief.spreads.max() > 1.2) == learns
    assert (len(numbers) <= 3) == learns


@pytest.mark.thorough
def test_the_command_tracks_objects(tmp_path: Path) -> None:
    recording = simulated(2, 48, 0.5)
    frames = recording.frames
    frames[7, 3, 4] = np.nan  # a masked pixel
    np.save(tmp_path / "frames.npy", 10 * frames)
    options = ["--statistic", "llr", "--object-size", "5", "--sensor", "white", "--max-velocity", "1"]
    with pytest.raises(SystemExit) as done:
        main(["track", "images", str(tmp_path / "frames.npy"), "--out", str(tmp_path / "out"), *options])
    assert done.value.code == 0
    rows = read_tracks_csv(tmp_path / "out" / "tracks.csv").rows
    last = rows[(rows["status"] == 1) & (rows["time_s"] == FRAMES - 1)]
    assert len(last) == 1
    np.testing.assert_allclose(last["position"][0], recording.truth[-1, 0, [0, 2]], atol=1.5)
    again = ImageTracking.from_yaml(tmp_path / "out" / "config.yaml").filter
    assert isinstance(again, RecurrentImages)
    assert isinstance(again.statistic, Window)
    assert (again.statistic.window, again.statistic.border) == (5, "cut")


@pytest.mark.parametrize(
    ("given", "window", "border"),
    [
        ({"statistic": {"kind": "llr"}, "object_size": 8}, 9, "cut"),
        ({"statistic": {"kind": "std"}, "object_size": 1, "border": "circular"}, 3, "circular"),
        ({"statistic": {"kind": "dot", "window": 3, "border": "reflected"}, "object_size": 9}, 3, "reflected"),
    ],
)
def test_the_window_follows_the_object(given: dict[str, Any], window: int, border: str) -> None:
    statistic = RecurrentImages(**given).statistic
    assert isinstance(statistic, Window)
    assert (statistic.window, statistic.border) == (window, border)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"object_size": 7}, "object_size: has no meaning for point targets"),
        ({"statistic": {"kind": "llr"}, "threshold_from": "likelihood"}, "a statistic is no likelihood ratio"),
        ({"statistic": {"kind": "lrr"}}, "llr"),
    ],
)
def test_what_does_nothing_is_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        RecurrentImages(**given)
