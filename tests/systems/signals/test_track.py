"""From a signal to tracks: simulated objects found where they are, noise left alone, and the files that say so."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
import xarray as xr
import yaml
from scipy.special import polygamma

from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.false_alarm import ExtremeValue
from elusive.io import Truth, open_signal
from elusive.preprocess.standardise import learn_standard
from elusive.results import read_tracks_csv
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath
from elusive.systems.signals import results as signal_results
from elusive.systems.signals.results import tracked_of
from elusive.systems.signals.run import bound_to, track_signal_recording
from elusive.systems.signals.track import SignalState, SignalTracking, track_signal
from elusive.tracking import ReadBack, Step, Track
from tests.longer import longer

QUICK = {"filter": {"smoothing": 0.9, "max_velocity": 3}}  # a short memory: the law of noise is soon simulated
TIMED = {"filter": {"smoothing": 0.9, "max_velocity": 12}}  # the same at 4 frames a second
WRITTEN = [
    "checks.json",
    "config.yaml",
    "report.html",
    "report.png",
    "result.nc",
    "scores.csv",
    "scores.json",
    "tracks.csv",
]


def simulated(
    frames: int, paths: list[NoiseObjectPath], seed: int, samples: int = 400, background: float = 0.5, **sensor: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Frames, and where the objects are, ``(T, objects)``."""
    scene = NoiseObject(shape=(samples,), background_deviation=background, **sensor)
    drawn = scene.simulate_sequence(frames, paths, np.random.default_rng(seed))
    return drawn.frames, drawn.truth[:, :, 0]


def one(velocity: float = 2.0, appears: int = 20, leaves: int = 89) -> list[NoiseObjectPath]:
    return [NoiseObjectPath(start=(100.0,), velocity=(velocity,), appears=appears, leaves=leaves)]


def around(difference: np.ndarray, samples: int) -> np.ndarray:
    return np.abs((difference + samples / 2) % samples - samples / 2)


# ---------------------------------------------------------------------------------------------- found, and left alone


@pytest.mark.parametrize(
    ("statistic", "border"),
    longer(
        itertools.product(("llr", "std", "chi2", "dot"), ("circular", "bounded")),
        *itertools.product(("std", "chi2", "dot"), ("circular",)),
        *itertools.product(("llr", "std", "chi2"), ("bounded",)),
    ),
)
def test_an_object_is_found_where_it_is(statistic: str, border: str) -> None:
    frames, truth = simulated(120, one(), 1, border=border)
    given = {"filter": {**QUICK["filter"], "border": border}, "statistic": {"kind": statistic}}
    results = list(track_signal(frames, SignalTracking(**given)))
    confirmed = [[track for track in result.tracks if track.status == "confirmed"] for result in results]
    assert not any(confirmed[:20])
    off = [around(track.mean[0] - truth[k, 0], 400) for k in range(50, 90) for track in confirmed[k]]
    assert sum(len(tracks) > 0 for tracks in confirmed[50:90]) > 36
    assert max(off) <= 5
    assert not any(confirmed[110:])  # gone soon after it left at 89


@pytest.mark.parametrize("step", longer([{}, {"velocity_step": 1.0}], {}))
def test_velocities_between_whole_samples_are_not_lost(step: dict[str, float]) -> None:
    """With whole steps too: half a sample a frame off, what the filter is left with is enough to find the path."""
    frames, truth = simulated(90, one(velocity=1.5, appears=0, leaves=90), 3, background=0.75)
    results = list(track_signal(frames, SignalTracking(filter={"smoothing": 0.95, "max_velocity": 3, **step})))
    found = [
        any(around(track.mean[0] - truth[k, 0], 400) <= 3 for track in results[k].tracks if track.status != "deleted")
        for k in range(50, 90)
    ]
    assert sum(found) >= 38


def test_where_it_was_before_it_was_found_is_read_back() -> None:
    frames, truth = simulated(90, one(velocity=-1.0, appears=30), 2, background=0.8)
    results = list(track_signal(frames, SignalTracking(filter={"smoothing": 0.95, "max_velocity": 3})))
    ((when, back),) = [(k, back) for k, result in enumerate(results) for back in result.state.read_back.values()]
    first = when + 1 - len(back.positions)
    assert abs(first - 30) <= 4
    both = slice(max(first, 30), when + 1)
    assert around(back.positions[both.start - first :, 0] - truth[both, 0], 400).max() <= 3


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("frames", "fewest", "most"),
    # 19.6 and 59.6 +- 3 times (4.0 and 6.9 of the sampling, 1.4 and 4.1 of the simulated law, 7 % of its rate)
    [(2000, 7, 32), (6000, 36, 84)],
)
def test_noise_alone_raises_alarms_at_the_rate_asked_for(frames: int, fewest: int, most: int) -> None:
    """Maps a memory of ten frames apart: about 100 and 300 independent ones, a fifth of them with an alarm."""
    noise = np.random.default_rng(3).standard_normal((frames, 400))
    parameters = SignalTracking(**QUICK, false_alarm={"probability": 0.2})
    results = list(track_signal(noise, parameters))
    alarms = sum(result.state.score.max() > result.state.threshold for result in results[50::20])
    assert fewest <= alarms <= most
    begun = {track.track: track.status for result in results for track in result.tracks}
    confirmed = {track.track for result in results for track in result.tracks if track.status == "confirmed"}
    assert len(begun) > frames / 300
    assert len(confirmed) <= 0.01 * len(begun) + 3 * np.sqrt(0.01 * len(begun))


@pytest.mark.parametrize(("clip", "alarms"), [(4.0, False), (None, True)])
def test_a_click_is_no_object(clip: float | None, alarms: bool) -> None:
    frames, _ = simulated(60, [], 4)
    frames[40, 200] = 50.0
    results = list(track_signal(frames, SignalTracking(**QUICK, clip=clip)))
    assert any(result.state.score.max() > result.state.threshold for result in results[40:50]) == alarms


@pytest.mark.parametrize("given", longer([{}, {"calibration_frames": 60}], {}))
def test_samples_that_differ_are_standardised(given: dict[str, Any]) -> None:
    """Each sample with an offset and a loudness of its own, as channels of a receiver have."""
    rng = np.random.default_rng(5)
    loudness, offset = np.exp(rng.normal(0.0, 0.7, 400)), rng.normal(0.0, 5.0, 400)
    frames, truth = simulated(200, one(appears=100, leaves=199), 5, background=0.5)
    frames = loudness * frames + offset
    told_white = SignalTracking(**QUICK, noise="white", statistic={"subtract_mean": True})
    plain = track_signal(frames[:100], told_white)
    # loud samples
    assert any(track.status == "confirmed" for result in itertools.islice(plain, 20, None) for track in result.tracks)
    results = list(track_signal(frames, SignalTracking(**QUICK, **given)))
    assert len(results) == 200
    for result in results[: given.get("calibration_frames", 0)]:
        assert np.isnan(result.state.threshold)
        assert result.tracks == ()
    assert not any(track.status == "confirmed" for result in results[:100] for track in result.tracks)
    places = {k: t.mean[0] for k in range(140, 200) for t in results[k].tracks if t.status == "confirmed"}
    assert len(places) > 50
    assert max(around(x - truth[k, 0], 400) for k, x in places.items()) <= 5


@pytest.mark.thorough
def test_long_calibration_sets_the_threshold_from_its_own_scores() -> None:
    """Noise with longer tails than a Gaussian's: simulated Gaussian frames do not tell how high it scores."""
    rng = np.random.default_rng(6)
    frames = rng.standard_t(4, (1500, 400))
    told = {"filter": {"smoothing": 0.8, "max_velocity": 2}, "clip": None, "false_alarm": {"probability": 0.01}}
    own = list(track_signal(frames, SignalTracking(**told, calibration_frames=800)))[800:]
    gaussian = list(track_signal(frames[800:], SignalTracking(**told, noise="white")))
    rates = [np.mean([r.state.score.max() > r.state.threshold for r in results[20::10]]) for results in (own, gaussian)]
    assert rates[0] < 0.1
    assert rates[1] > 0.3


@pytest.mark.thorough
def test_a_short_calibration_raises_the_threshold_as_far_as_it_errs() -> None:
    """Samples whose deviation came out too small stand out ever after; 3 signals of unlike samples, 25 frames each."""
    rng = np.random.default_rng(9)
    told = SignalTracking(**QUICK, calibration_frames=25, false_alarm={"probability": 0.01})
    alarms = []
    for _ in range(3):
        frames = np.exp(rng.normal(0.0, 0.7, 400)) * rng.standard_normal((225, 400))
        alarms.append(np.mean([r.state.score.max() > r.state.threshold for r in list(track_signal(frames, told))[65:]]))
    assert np.mean(alarms) < 0.09  # .03 over 40 signals; .2 if noise is simulated as if all samples were alike


def test_each_half_of_the_calibration_is_judged_by_the_other() -> None:
    frames = list(np.random.default_rng(10).standard_normal((11, 50)) * np.linspace(1, 9, 50))
    evidence = SignalTracking().whitened.evidence
    first, second = (evidence._replace(standard=learn_standard(half)) for half in (frames[:5], frames[5:]))
    expected = [second.evidence(frame) for frame in frames[:5]] + [first.evidence(frame) for frame in frames[5:]]
    np.testing.assert_allclose([evidence.of_taken(taken) for taken in evidence.crossed(frames)], expected)


# ------------------------------------------------------------------------------------------------------ lazy, bounded


def test_a_stream_without_end_is_tracked_frame_by_frame() -> None:
    rng = np.random.default_rng(7)
    taken = []

    def stream() -> Iterator[np.ndarray]:
        for number in itertools.count():
            taken.append(number)
            yield rng.standard_normal(400)

    results = track_signal(stream(), SignalTracking(**QUICK))
    for number in range(5):
        next(results)
        assert taken[-1] == number


def test_the_same_seed_gives_the_same_and_a_file_the_same_as_a_stream(tmp_path: Path) -> None:
    frames, _ = simulated(60, one(), 8)
    np.save(tmp_path / "a.npy", frames)
    parameters = SignalTracking(filter={"smoothing": 0.8, "max_velocity": 2}, seed=3)
    first, second = (list(track_signal(given, parameters)) for given in (frames, iter(frames)))
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.state.score, b.state.score)
        assert a.state.threshold == b.state.threshold
        assert repr(a.tracks) == repr(b.tracks)
    outcome = track_signal_recording(open_signal(tmp_path / "a.npy"), parameters, tmp_path / "out")
    np.testing.assert_allclose(outcome.tracked.highest, [result.state.score.max() for result in first])
    other = list(track_signal(frames[:30], parameters.replace(seed=4)))
    assert other[-1].state.threshold != first[29].state.threshold


# -------------------------------------------------------------------------------------------------------------- files


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray, dict[str, str]]:
    folder = tmp_path_factory.mktemp("signal")
    frames, truth = simulated(100, one(leaves=99), 1)
    np.save(folder / "a.npy", frames)
    source = open_signal(folder / "a.npy", rate_hz=4.0, start=5)
    seen: list[int] = []
    done = track_signal_recording(
        source, SignalTracking(**TIMED), folder / "out", truth=Truth.of_frames(truth[:, :, None]), on_frame=seen.append
    )
    assert seen == list(range(1, 96))
    return folder, truth, dict(done.tracked.rows)


def test_everything_is_written_and_says_the_same(tracked: tuple[Path, np.ndarray, dict[str, str]]) -> None:
    folder, truth, told = tracked
    assert sorted(path.name for path in (folder / "out").iterdir()) == WRITTEN
    read = read_tracks_csv(folder / "out" / "tracks.csv")
    assert read.columns.added == ("score", "evidence", "moves", "shown")
    assert np.isnan(read.rows["existence"]).all()  # a score is no posterior probability
    rows = read.rows[read.rows["status"] == 1]
    assert len(np.unique(rows["track"])) == 1
    assert told["Tracks that never met a target"] == "0"
    assert float(told["Error there"].split()[0]) < 2
    assert len(rows) > 40
    off = rows["position"][:, 0] - truth[np.round(4 * rows["time_s"]).astype(int), 0]
    assert around(off, 400).max() <= 5
    assert (rows["added"][:, 1] > 4).all()
    assert (rows["added"][:, 0] > 0.5).all()
    assert rows["velocity"][:, 0].mean() == pytest.approx(8.0, abs=0.4)  # 2 samples a frame, 4 frames a second
    with xr.open_dataset(folder / "out" / "result.nc", engine="h5netcdf", decode_times=False) as result:
        np.testing.assert_allclose(result["step_time"], np.arange(5, 100) / 4)
        assert result["evidence_map"].shape == (95, 400)
        np.testing.assert_allclose(result["evidence_map"].max("sample"), result["step_highest"], rtol=1e-6)
        at = round(4 * rows["time_s"][-1]) - 5
        assert int(result["evidence_map"].values[at].argmax()) == pytest.approx(rows["position"][-1, 0], abs=1)
        assert result["map_time"].values[0] == 1.25


@pytest.fixture(scope="module")
def counted() -> tuple[np.ndarray, list[Step[Any]]]:
    """Frames, and their steps where time counts frames."""
    frames, _ = simulated(60, one(leaves=59), 1)
    return frames, list(track_signal(frames, SignalTracking(filter={"border": "circular"})))


@pytest.mark.parametrize("rate_hz", longer([4.0, 30000 / 1001, 0.1], 4.0, 0.1))
def test_a_rate_changes_the_unit_of_velocities_and_of_what_is_given(
    counted: tuple[np.ndarray, list[Step[Any]]], rate_hz: float
) -> None:
    frames, steps = counted
    parameters = SignalTracking(filter={"border": "circular"})
    timed = list(track_signal(frames, parameters.bind(400, 1 / rate_hz), np.arange(60) / rate_hz))
    for a, b in zip(steps, timed, strict=True):
        assert b.time_s == pytest.approx(a.time_s / rate_hz)
        assert a.state.threshold == b.state.threshold
        assert [track[:2] for track in a.tracks] == [track[:2] for track in b.tracks]
        for track, same in zip(a.tracks, b.tracks, strict=True):
            np.testing.assert_allclose(same.mean, track.mean * [1, rate_hz])
    assert any(track.status == "confirmed" for track in timed[-1].tracks)
    given = SignalTracking(filter={"smoothing": 0.9, "max_velocity": 8.0}).bind(400, 0.25)
    assert given.recursion.max_velocity == 2.0
    assert given.recursion.smoothing == pytest.approx(0.9**0.25)
    assert given.recursion.velocity_step == pytest.approx(2.5 * (1 - 0.9**0.25), abs=1e-6)


def test_an_object_is_followed_at_uneven_times(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    times = np.cumsum(rng.uniform(0.1, 0.4, 90))
    frames, _ = simulated(90, [], 4)
    truth = 60 + 8.0 * times
    for frame, place in zip(frames, truth, strict=True):
        frame[np.round(place + np.arange(-2, 3)).astype(int) % 400] += rng.standard_normal(5)
    header = ",".join(["time_s", *(f"s{k}" for k in range(400))])
    np.savetxt(tmp_path / "a.csv", np.column_stack([times, frames]), delimiter=",", header=header, comments="")
    source = open_signal(tmp_path / "a.csv")
    assert bound_to(source, SignalTracking()).interval_s == pytest.approx(0.25, abs=0.1)
    log = track_signal_recording(source, SignalTracking(filter={"smoothing": 0.9}), tmp_path / "out").log
    sure = log.rows[(log.rows["status"] == 1) & (log.rows["step"] > 40)]
    assert len(sure) > 40
    assert around(sure["position"][:, 0] - truth[sure["step"]], 400).max() <= 5
    assert sure["velocity"].mean() == pytest.approx(8.0, abs=2.0)


def test_the_configuration_repeats_the_run(tracked: tuple[Path, np.ndarray, dict[str, str]], tmp_path: Path) -> None:
    folder, truth, _ = tracked
    again = SignalTracking.from_yaml(folder / "out" / "config.yaml")
    track_signal_recording(
        open_signal(folder / "a.npy", rate_hz=4.0, start=5),
        again,
        tmp_path / "out",
        truth=Truth.of_frames(truth[:, :, None]),
    )
    for name in WRITTEN:
        assert (tmp_path / "out" / name).read_bytes() == (folder / "out" / name).read_bytes(), name


def test_times_of_the_file_give_seconds(tmp_path: Path) -> None:
    frames, _ = simulated(40, one(appears=0, leaves=39), 9, samples=100)
    times = 100.0 + 0.5 * np.arange(40)
    header = ",".join(["time_s", *(f"s{k}" for k in range(100))])
    np.savetxt(tmp_path / "a.csv", np.column_stack([times, frames]), delimiter=",", header=header, comments="")
    outcome = track_signal_recording(open_signal(tmp_path / "a.csv"), SignalTracking(**QUICK), tmp_path / "out")
    assert outcome.log.times_s.tolist() == times.tolist()
    assert outcome.tracked.time_unit == "s"
    rows = outcome.log.rows
    assert rows["velocity"][rows["status"] == 1].mean() == pytest.approx(4.0, abs=0.5)


def test_a_large_map_is_thinned_by_its_largest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signal_results, "KEPT", (16, 50))
    frames, _ = simulated(70, one(), 10)
    np.save(tmp_path / "a.npy", frames)
    outcome = track_signal_recording(open_signal(tmp_path / "a.npy"), SignalTracking(**QUICK), tmp_path / "out")
    with xr.open_dataset(tmp_path / "out" / "result.nc", engine="h5netcdf", decode_times=False) as result:
        cells = result["evidence_map"]
        stride, shrink = cells.attrs["frames_a_cell"], cells.attrs["samples_a_cell"]
        assert (stride, shrink) == (8, 8)
        assert cells.shape == (9, 50)
        blocks = [outcome.tracked.highest[k : k + stride].max() for k in range(0, 70, stride)]
        np.testing.assert_allclose(cells.max("sample"), blocks, rtol=1e-6)
        assert result["step_highest"].size == 70


@pytest.mark.parametrize(("x", "frames"), [(100.0, []), (104.0, []), (396.0, []), (200.0, [5, 6, 7, 8])])
def test_a_track_is_not_read_back_into_another_one(tmp_path: Path, x: float, frames: list[int]) -> None:
    """Track 1 stands at 100, or across the ring's ends, until track 2 begins in frame 9, found to be there since 5."""
    place = 100.0 if x < 300 else 1.0
    np.save(tmp_path / "a.npy", np.random.default_rng(1).standard_normal((11, 400)))
    log = signal_results.SignalLog(open_signal(tmp_path / "a.npy"), SignalTracking(show="all"))
    unknown, law = np.full((2, 2), np.nan), ExtremeValue(5.0, 1.0)
    for k in range(11):
        first = Track(1, "confirmed", np.nan, np.array([place, 0.0]), unknown, 1.0)
        second = Track(2, "candidate" if k == 9 else "confirmed", np.nan, np.array([x, 0.0]), unknown, 1.0)
        back = {2: ReadBack(5, np.full((6, 1), x), 1.0)} if k == 10 else {}
        state = SignalState(np.arange(400.0), np.arange(400.0), 5.0, law, back)
        log.take(Step(float(k), None, state, (first,) if k < 9 else (first, second)))
    assert log.earlier()[2][:, 0].tolist() == frames


@pytest.mark.thorough
def test_the_truth_only_scores(tracked: tuple[Path, np.ndarray, dict[str, str]], tmp_path: Path) -> None:
    folder, truth, _ = tracked
    source = open_signal(folder / "a.npy", rate_hz=4.0, start=5)
    outcome = track_signal_recording(source, SignalTracking(**TIMED), tmp_path / "out")
    assert (tmp_path / "out" / "tracks.csv").read_bytes() == (folder / "out" / "tracks.csv").read_bytes()
    assert "Error there" not in dict(outcome.tracked.rows)
    elsewhere = (truth + 200) % 400
    told = dict(
        track_signal_recording(
            source, SignalTracking(**TIMED), tmp_path / "c", truth=Truth.of_frames(elsewhere[:, :, None])
        ).tracked.rows
    )
    assert told["Tracks that never met a target"] == "1"
    assert told["Targets found within 5 samples"] == "0 % of their times"
    with pytest.raises(DataError, match="truth: has 50 rows for 100 frames"):
        tracked_of(outcome.log, Truth.of_frames(truth[:50, :, None]))


# --------------------------------------------------------------------------------------------------------- parameters


@pytest.mark.parametrize(
    ("given", "window", "border"),
    [
        ({}, 5, "circular"),
        ({"object_size": 8}, 9, "circular"),
        ({"object_size": 1}, 1, "circular"),
        ({"object_size": 1, "statistic": {"kind": "std"}}, 3, "circular"),
        ({"object_size": 7, "statistic": {"kind": "dot"}}, 7, "circular"),
        ({"object_size": 7, "statistic": {"window": 3}}, 3, "circular"),
        ({"filter": {"border": "bounded"}}, 5, "cut"),
        ({"filter": {"border": "bounded"}, "statistic": {"border": "reflected"}}, 5, "reflected"),
        ({"filter": SignalTracking().filter.replace(border="bounded")}, 5, "cut"),
        ({"object_size": 7, "statistic": SignalTracking().statistic}, 5, "circular"),
    ],
)
def test_what_is_not_given_follows_what_is(given: dict[str, Any], window: int, border: str) -> None:
    parameters = SignalTracking(**given)
    assert (parameters.statistic.window, parameters.statistic.border) == (window, border)
    assert SignalTracking(**yaml.safe_load(parameters.to_yaml())) == parameters


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"statistic": {"window": 4}}, "must be odd"),
        ({"filter": {"smoothing": 1.0}}, "smoothing: must be less than 1"),
        ({"filter": {"smoothing": -0.1}}, "smoothing: must be greater than or equal to 0"),
        ({"calibration_frames": 5}, "calibration_frames: must be 0 or at least 10"),
        ({"object_size": 0}, "object_size: must be greater than or equal to 1"),
        ({"object_size": "many"}, "object_size"),
        ({"clip": 0}, "clip: must be greater than 0"),
        ({"statistic": {"kind": "lrr"}}, "llr"),
        ({"statistc": {}}, "did you mean 'statistic'"),
    ],
)
def test_a_bad_parameter_is_one_sentence(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        SignalTracking(**given)


@pytest.mark.parametrize(
    ("frames", "given", "sentence"),
    [
        (np.random.default_rng(1).standard_normal((9, 4)), {}, "4 samples are shorter than the window of 5"),
        (
            np.random.default_rng(1).standard_normal((9, 40)),
            {"calibration_frames": 10},
            "has 9 frames, all of them taken",
        ),
        (np.full((9, 40), 2.0), {}, "none of its 9 frames can be used"),
        (np.full((9, 40), np.nan), {}, "none of its 9 frames can be used"),
        (np.full((30, 40), 2.0), {"calibration_frames": 20}, "20 of its 20 frames cannot be used, and 5 are needed"),
    ],
)
def test_frames_that_cannot_be_used_are_said(frames: np.ndarray, given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        list(track_signal(frames, SignalTracking(**given)))


def test_frames_of_another_size_are_said() -> None:
    rng = np.random.default_rng(1)
    for given in ({}, {"calibration_frames": 20}):
        frames = [rng.standard_normal(50 if k < 30 else 51) for k in range(40)]
        with pytest.raises(DataError, match="51"):
            list(track_signal(frames, SignalTracking(**QUICK, **given)))


def test_too_much_memory_is_refused_before_anything_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    np.save(tmp_path / "a.npy", simulated(20, [], 1)[0])
    memory = psutil.virtual_memory()._replace(total=20_000)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: memory)
    with pytest.raises(DataError, match=r"a\.npy: .*GB, more than half of the machine's"):
        track_signal_recording(open_signal(tmp_path / "a.npy"), SignalTracking(), tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


# ------------------------------------------------------------------------------------------------------ standardising


def test_equal_deviations_are_drawn_together_and_unlike_ones_kept() -> None:
    rng = np.random.default_rng(2)
    alike = learn_standard(list(rng.standard_normal((25, 2000)))).deviation
    assert np.std(np.log(alike)) < 0.05  # of themselves they scatter by 1 / sqrt(50) = .14
    true = np.repeat([0.1, 10.0], 1000)
    unlike = learn_standard(list(true * rng.standard_normal((25, 2000)) + 3.0))
    np.testing.assert_allclose(np.median(unlike.deviation.reshape(2, -1), axis=1), [0.1, 10.0], rtol=0.1)
    np.testing.assert_allclose(np.mean(unlike.mean), 3.0, atol=0.2)
    frame = true * rng.standard_normal(2000) + 3.0
    assert np.std(unlike.apply(frame)[1000:]) == pytest.approx(1.0, abs=0.15)


def test_deviations_lose_as_much_error_as_their_true_scatter_allows() -> None:
    """Normal log variances: the error of the posterior mean is sigma^2 tau^2 / (sigma^2 + tau^2), chance sigma^2."""
    rng = np.random.default_rng(3)
    spread, frames, n = 0.3, 20, 20_000
    true = rng.normal(0.0, spread, n)  # log variances
    learnt = learn_standard(list(np.exp(true / 2) * rng.standard_normal((frames, n))))
    error = np.mean((2 * np.log(learnt.deviation) - true) ** 2)
    by_chance = polygamma(1, (frames - 1) / 2)
    assert error == pytest.approx(by_chance * spread**2 / (by_chance + spread**2), rel=0.1)


@pytest.mark.parametrize(
    ("frames", "sentence"),
    [
        (np.ones((4, 3)), "4 of them are too few"),
        ([np.zeros(3)] * 5 + [np.zeros(4)], "several sizes"),
        (np.full((6, 3), np.nan), "NaN"),
        (np.ones((6, 3)), "sample 0: is the same in all 6 frames"),
    ],
)
def test_frames_that_teach_nothing_are_said(frames: Any, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        learn_standard(list(frames))


def test_a_signal_rounded_to_hardly_any_value_is_refused() -> None:
    frames = np.round(np.random.default_rng(1).standard_normal((30, 200)) / 3)
    with pytest.raises(DataError, match="half one value"):
        list(track_signal(frames, SignalTracking(**QUICK)))


def rotor(lobes: float, seed: int, frames: int = 150, samples: int = 300) -> np.ndarray:
    """Frames of noise, twice as loud in a fifth of each of so many periods in a frame."""
    phase = np.arange(frames * samples) * lobes / samples
    loud = 1 + (phase % 1.0 < 0.2)
    return np.random.default_rng(seed).standard_normal((frames, samples)) * loud.reshape(frames, samples)


def believed(frames: np.ndarray, **told: Any) -> int:
    """Count the tracks that are confirmed at some time."""
    steps = track_signal(frames, SignalTracking(**QUICK, **told))
    return len({track.track for step in steps for track in step.tracks if track.status == "confirmed"})


@pytest.mark.thorough
@pytest.mark.parametrize("lobes", [3.98, 5.03, 7.02])
def test_a_rotor_is_no_object(lobes: float) -> None:
    # of three signals one ghost in what is left over; each has at least four where noise is taken to be white
    assert sum(believed(rotor(lobes, seed)) for seed in range(3)) <= 1
    assert believed(rotor(lobes, 0), noise="white") >= 4


@pytest.mark.thorough
def test_an_object_before_a_rotor_is_found() -> None:
    frames, rng = rotor(5.03, 1), np.random.default_rng(1)
    places = (40 + 1.5 * np.arange(150)) % 300
    for frame, place in zip(frames, places, strict=True):
        frame[(round(place) + np.arange(-2, 3)) % 300] += 2.5 * rng.standard_normal(5)
    found = [
        [abs((track.mean[0] - place + 150) % 300 - 150) for track in step.tracks if track.status == "confirmed"]
        for step, place in zip(track_signal(frames, SignalTracking(**QUICK)), places, strict=True)
    ]
    assert np.mean([any(off < 5 for off in one) for one in found[60:]]) > 0.9
    assert np.mean([sum(off >= 5 for off in one) for one in found[60:]]) < 0.1


def louder(seed: int, speed: float, size: int, loud: float) -> np.ndarray:
    """Frames of noise, in which so many samples are louder from frame 60."""
    frames = np.random.default_rng(seed).standard_normal((150, 300))
    for number in range(60, 150):
        frames[number, (100 + round(speed * number) + np.arange(size)) % 300] *= loud
    return frames


@pytest.mark.parametrize(("speed", "size", "loud"), longer([(0.0, 8, 3.0), (1.3, 20, 2.0)], (1.3, 20, 2.0)))
@pytest.mark.parametrize("seeds", longer([1, 3], 3))
def test_a_thing_wider_than_was_told_is_one_that_moves_or_does_not(
    speed: float, size: int, loud: float, seeds: int
) -> None:
    """Eight samples at rest and twenty on their way, five told: they were three to eleven tracks in each signal."""
    count, moving = [], []
    for seed in range(seeds):
        for step in itertools.islice(track_signal(louder(seed, speed, size, loud), SignalTracking(**QUICK)), 75, None):
            sure = [track for track in step.tracks if track.status == "confirmed"]
            count.append(len(sure))
            moving += [track.extra["moves"] for track in sure]
    assert np.mean(np.array(count) == 1) > 0.9
    assert (np.mean(moving) > 0.7) if speed else (np.mean(moving) < 0.3)


@pytest.mark.parametrize("show", longer(["moving", "all"], "moving"))
def test_what_rests_is_followed_and_shown_when_asked_for(tmp_path: Path, show: str) -> None:
    """Something loud at rest beside an object on its way: report and scores are of the object alone, or of both."""
    rng = np.random.default_rng(2)
    frames, place = rng.standard_normal((150, 400)), 60 + 1.5 * np.arange(150)
    frames[60:110, 300:308] *= 3
    for k, x in enumerate(place.round().astype(int)):
        frames[k, x - 2 : x + 3] += 1.5 * rng.standard_normal(5)
    np.save(tmp_path / "a.npy", frames)
    truth = Truth.of_frames(place[:, None, None])
    outcome = track_signal_recording(
        open_signal(tmp_path / "a.npy"), SignalTracking(**QUICK, show=show), tmp_path / "out", truth=truth
    )
    table, rows = dict(outcome.tracked.rows), read_tracks_csv(tmp_path / "out" / "tracks.csv").rows
    sure = rows[rows["status"] == 1]
    believed: dict[int, list[float]] = {}
    for row in sure:  # moves in the mean since it was confirmed, but for a mean as near as the file's digits
        mean = np.mean([*believed.setdefault(row["track"], []), row["added"][2]])
        believed[row["track"]].append(row["added"][2])
        assert abs(mean - 0.5) < 1e-3 or (row["added"][3] == 1) == (mean > 0.5)
    moving = {number for number, values in believed.items() if np.mean(values) > 0.5}
    assert 0 < len(moving) < len(believed)
    assert {path.track for path in outcome.tracked.paths} == (moving if show == "moving" else believed.keys())
    shown = np.isin(sure["track"], list(moving))
    resting = np.abs(sure["position"][:, 0] - 303.5) < 8
    assert resting.sum() > 20
    assert np.mean(shown[resting]) < 0.1
    assert np.mean(shown[~resting]) > 0.9
    drawn = np.concatenate([path.x[path.sure] for path in outcome.tracked.paths])
    assert (np.mean(np.abs(drawn - 303.5) < 8) > 0.1) == (show == "all")
    assert ("Followed, not shown" in table) == (show == "moving")
    assert ("not shown (--show all)" in outcome.tracked.verdict) == (show == "moving")
