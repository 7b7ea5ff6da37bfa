"""Frames in, tracks out: any size, gaps, borders, a target that comes back, and the same numbers from the same seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
import yaml
from numpy.typing import NDArray

from elusive.cli import main
from elusive.contracts import VX, VY, X, Y
from elusive.errors import DataError
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.filters.particle.parts import switching
from elusive.io import Truth, open_frames
from elusive.results import read_tracks_csv
from elusive.sensors.image import ImageSensor
from elusive.systems.images.run import follow, track_recording
from elusive.systems.images.scene import held_frames
from elusive.systems.images.track import ImageTracking, track_images
from elusive.tracking import Lifecycle, Step

SNR_DB = 14.0
NOWHERE = (np.nan, np.nan)


def tracking(shape: tuple[int, int], seed: int = 0, max_speed: float = 2.0, **changes: Any) -> ImageTracking:
    """White noise of known deviation: nothing to whiten, so that what must come out is known."""
    sensor = ImageSensor(rows=shape[0], columns=shape[1])
    model = BernoulliFilter(sensor=sensor, birth=MeasurementBirth(snr_db=SNR_DB, max_speed=max_speed), **changes)
    return ImageTracking(filter=model, tracks=Lifecycle(), seed=seed)


def frames_of(path: Any, shape: tuple[int, int], seed: int = 1) -> NDArray[np.float64]:
    """Noise, and a target at each place of a path ``(T, 2)``; NaN: none."""
    sensor = ImageSensor(rows=shape[0], columns=shape[1])
    rng = np.random.default_rng(seed)
    intensity = sensor.intensity_of(SNR_DB)
    targets = [np.array([[x, 0, y, 0, intensity]]) if np.isfinite(x) else np.empty((0, 5)) for x, y in path]
    return np.stack([sensor.simulate(target, rng) for target in targets])


def straight(frames: int, start: tuple[float, float], step: tuple[float, float]) -> NDArray[np.float64]:
    return np.array(start) + np.arange(frames)[:, None] * np.array(step)


def places(results: list[Step]) -> NDArray[np.float64]:
    return np.array([step.state.mean[[X, Y]] for step in results])


def existence(results: list[Step]) -> NDArray[np.float64]:
    return np.array([step.state.existence for step in results])


def number(step: Step) -> int | None:
    """The number of the one track there is, if there is one."""
    return next((track.track for track in step.tracks), None)


@pytest.mark.parametrize("shape", [(20, 20), (7, 90), (64, 48), (300, 17), (480, 640), (768, 1024)], ids=str)
def test_any_size_and_shape(shape: tuple[int, int]) -> None:
    rows, columns = shape
    path = straight(12, (0.3 * columns, 0.5 * rows), (min(0.4, columns / 40), min(0.3, rows / 40)))
    results = list(track_images(frames_of(path, shape), tracking(shape)))
    assert len(results) == 12
    # the median: in a third of all runs one frame's noise takes it below for that frame
    assert np.median(existence(results)[4:]) > 0.9
    assert (np.hypot(*(places(results) - path)[4:].T) < 1.0).all()
    assert [number(step) for step in results[-5:]] == [1] * 5
    assert results[-1].tracks[0].status == "confirmed"


@pytest.mark.parametrize(
    ("start", "step"),
    [((0.0, 10.0), (0.0, 0.5)), ((23.0, 3.0), (0.0, 0.5)), ((3.0, 0.0), (0.7, 0.0)), ((5.0, 19.0), (0.5, 0.0))],
    ids=["left", "right", "top", "bottom"],
)
def test_a_target_along_the_border(start: tuple[float, float], step: tuple[float, float]) -> None:
    path = straight(16, start, step)
    results = list(track_images(frames_of(path, (20, 24)), tracking((20, 24))))
    assert (existence(results)[6:] > 0.5).all()
    assert (np.hypot(*(places(results) - path)[6:].T) < 1.5).all()


def test_a_target_that_leaves_over_the_border_ends_its_track() -> None:
    path = straight(30, (10.0, 10.0), (0.9, 0.1))
    results = list(track_images(frames_of(path, (20, 24)), tracking((20, 24))))
    inside = int((path[:, 0] < 23.5).sum())
    assert (existence(results)[5:inside] > 0.5).all()
    assert (existence(results)[inside + 6 :] < 0.5).all()
    assert results[-1].tracks == ()


def test_a_target_that_comes_back_gets_a_new_track() -> None:
    path = np.full((50, 2), np.nan)
    path[4:18] = straight(14, (5.0, 6.0), (0.5, 0.3))
    path[32:46] = straight(14, (20.0, 14.0), (-0.5, 0.0))
    results = list(track_images(frames_of(path, (20, 28)), tracking((20, 28))))
    p = existence(results)
    assert p[:3].max() < 0.5
    assert p[8:18].min() > 0.9
    assert p[21:31].max() < 0.5
    assert p[36:46].min() > 0.9
    assert p[48:].max() < 0.5
    confirmed = {track.track for step in results for track in step.tracks if track.status == "confirmed"}
    first, second = sorted(confirmed)
    assert first < second
    assert {number(step) for step in results[10:18]} == {first}
    assert {number(step) for step in results[38:46]} == {second}
    assert all(step.tracks == () for step in results[23:31])
    error = np.hypot(*(places(results) - path).T)
    assert np.nanmax(error[[*range(8, 18), *range(36, 46)]]) < 1.0


def test_a_missing_frame_is_the_prediction() -> None:
    path = straight(20, (8.0, 8.0), (0.4, 0.2))
    frames: list[Any] = list(frames_of(path, (20, 24)))
    frames[12] = None
    parameters = tracking((20, 24))
    results = list(track_images(frames, parameters))
    assert len(results) == 20
    p = existence(results)
    model = parameters.filter
    # a target well inside cannot leave in one step: only birth and death act
    expected = (1 - model.death_probability) * p[11] + model.birth_probability * (1 - p[11])
    assert p[12] == pytest.approx(expected, abs=1e-6)
    # place and velocity: the intensity hardly walks, and particles are drawn anew
    before, after = (results[k].tracks[0].covariance[:4, :4] for k in (11, 12))
    assert np.trace(after) > np.trace(before)
    assert p[13:].min() > 0.9
    assert {number(step) for step in results[6:]} == {1}


def test_frames_that_are_all_missing_say_nothing() -> None:
    parameters = tracking((20, 24))
    p = existence(list(track_images([None] * 200, parameters)))
    model = parameters.filter
    stationary = model.birth_probability / (model.birth_probability + model.death_probability)
    assert p[0] < p[5] < p[20]
    assert 0.3 * stationary < p[-1] < stationary  # less, since what leaves the frame is absent


def test_masked_pixels_are_passed_over() -> None:
    path = straight(20, (8.0, 8.0), (0.4, 0.2))
    frames = frames_of(path, (20, 24))
    frames[:, ::7, ::5] = np.nan
    frames[9, 3:6, 3:6] = np.inf
    results = list(track_images(frames, tracking((20, 24))))
    assert existence(results)[6:].min() > 0.9
    assert np.hypot(*(places(results) - path)[6:].T).max() < 1.0


def test_an_empty_sky_is_mostly_empty() -> None:
    """Calibrated: over stretches without a target, mean existence is far under one half."""
    p = [
        existence(list(track_images(frames_of([NOWHERE] * 30, (20, 20), seed), tracking((20, 20))))) for seed in (5, 6)
    ]
    assert np.mean(p) < 0.1


def test_the_same_seed_gives_the_same_numbers() -> None:
    frames = frames_of(straight(10, (8.0, 8.0), (0.4, 0.2)), (20, 24))
    one, same, other = (list(track_images(frames, tracking((20, 24), seed=seed))) for seed in (3, 3, 4))
    np.testing.assert_array_equal(existence(one), existence(same))
    np.testing.assert_array_equal(places(one), places(same))
    assert existence(one).tolist() != existence(other).tolist()


def test_it_is_lazy() -> None:
    frames = frames_of(straight(10, (8.0, 8.0), (0.4, 0.2)), (20, 24))
    taken: list[int] = []

    def stream() -> Any:
        for number, frame in enumerate(frames):
            taken.append(number)
            yield frame

    results = track_images(stream(), tracking((20, 24)))
    assert taken == []
    next(results)
    next(results)
    assert taken == [0, 1]


def test_a_frame_of_another_size_is_refused() -> None:
    with pytest.raises(DataError, match=r"\(20, 24\).*\(24, 20\)|\(24, 20\).*\(20, 24\)"):
        list(track_images(frames_of([NOWHERE], (20, 24)), tracking((24, 20))))


@pytest.mark.parametrize("shape", [(20, 20), (20, 200), (400, 31)], ids=str)
def test_frames_too_small_for_peaks_name_the_filters_that_take_them(
    shape: tuple[int, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "frames.npy", np.random.default_rng(1).normal(100, 3, (8, *shape)))
    with pytest.raises(SystemExit, match="2"):
        main(["track", "images", str(tmp_path / "frames.npy"), "--out", str(tmp_path / "out")])
    said = " ".join(capsys.readouterr().err.split())
    assert f"{shape[1]} x {shape[0]} pixels" in said
    assert all(option in said for option in ("--filter single", "--filter several", "--noise-sigma"))
    white = {"kind": "white", "noise_sigma": 3.0}
    for filter in ({"kind": "single", "sensor": white}, {"kind": "several", "sensor": white}):
        assert ImageTracking(filter=filter).bind(shape).sensor.rows == shape[0]


def test_the_sensor_takes_its_size_from_the_recording() -> None:
    bound = tracking((20, 20)).bind((7, 90), 0.5)
    assert (bound.filter.sensor.shape, bound.interval_s) == ((7, 90), 0.5)
    assert bound.replace(filter=tracking((20, 20)).filter, interval_s=1.0) == tracking((20, 20))


@pytest.mark.parametrize("kind", ["several", "single", "existence", "recurrent"])
@pytest.mark.parametrize("rate_hz", [25.0, 30000 / 1001, 0.2])
def test_a_rate_changes_the_unit_of_velocities_and_nothing_else(kind: str, rate_hz: float) -> None:
    path = straight(22, (5.0, 6.0), (0.5, 0.25))
    source = held_frames("made", frames_of(path, (28, 32)))
    given = {"kind": kind, "sensor": {"kind": "white"}}
    given |= (
        {"threshold_from": "likelihood"}
        if kind == "recurrent"
        else {"birth": {"kind": "frame" if kind == "several" else "measurement", "snr_db": SNR_DB}}
    )
    parameters = ImageTracking(filter=given)
    counted, timed = (list(follow(one, parameters)) for one in (source, replace(source, rate_hz=rate_hz)))
    np.testing.assert_allclose([step.time_s for step in timed], np.arange(22) / rate_hz)
    # its clouds are drawn anew with roots that round otherwise: ten effective particles .3 px wide at first
    near = 0.15 if kind == "several" else 0.02
    for a, b in zip(counted, timed, strict=True):
        assert [(one.track, one.status) for one in a.tracks] == [(one.track, one.status) for one in b.tracks]
        for one, same in zip(a.tracks, b.tracks, strict=True):
            np.testing.assert_allclose(one.mean[[X, Y]], same.mean[[X, Y]], atol=near)
            np.testing.assert_allclose(one.mean[[VX, VY]], same.mean[[VX, VY]] / rate_hz, atol=near)
            np.testing.assert_allclose(one.existence, same.existence, atol=0.02)
    (track,) = timed[-1].tracks
    np.testing.assert_allclose(track.mean[[VX, VY]] / rate_hz, (0.5, 0.25), atol=0.15)


def test_what_is_given_counts_a_second_and_what_is_left_alone_a_frame() -> None:
    left = ImageTracking(filter={"kind": "single"}).bind((48, 48), 0.04).recursion.detector
    assert left.birth.max_speed == pytest.approx(4.0 * 25)
    assert left.motion.motion.q == pytest.approx(0.0025 * 25**3)
    p = switching(left.birth_probability, left.death_probability, 0.04)
    assert p == pytest.approx((0.05, 0.05))
    rates = {"kind": "single", "birth": {"max_speed": 7.0}, "death_probability": 0.3}
    given = ImageTracking(filter=rates).bind((48, 48), 0.04)
    assert given.recursion.detector.birth.max_speed == 7.0
    assert given.recursion.detector.death_probability == 0.3
    assert given.recursion.detector.motion == left.motion
    assert given.bind((48, 48), 0.04) == given  # as often as one likes: config.yaml repeats a run
    white = {"kind": "several", "sensor": {"kind": "white"}}
    several = ImageTracking(filter=white).bind((48, 48), 0.04).recursion
    assert several.birth.max_speed == pytest.approx(4.0 * 25)
    assert several.motion.motion.q == pytest.approx(0.0025 * 25**3)
    assert several.birth_probability == pytest.approx(1 - (1 - 0.02) ** 25)
    bank = ImageTracking(filter={"kind": "recurrent", "max_velocity": 50.0}).bind((48, 48), 0.04).recursion.model
    assert (bank.max_velocity, bank.smoothing) == (2.0, 0.9)  # a frame, as it counts


@pytest.mark.parametrize("kind", ["several", "single", "recurrent"])
def test_frames_at_uneven_times(kind: str) -> None:
    """A target of constant velocity, seen at random intervals, with gaps: found where it is, its velocity in px / s."""
    rng = np.random.default_rng(9)
    times = np.cumsum(rng.uniform(0.02, 0.06, 30))
    path = np.array([4.0, 5.0]) + np.outer(times - times[0], [14.0, 7.0])
    given = {"kind": kind, "sensor": {"kind": "white"}}
    given |= (
        {"threshold_from": "likelihood"}
        if kind == "recurrent"
        else {"birth": {"kind": "frame" if kind == "several" else "measurement", "snr_db": SNR_DB}}
    )
    source = held_frames("made", frames_of(path, (28, 32)), times_s=times)
    assert source.interval_s == pytest.approx(np.median(np.diff(times)))
    steps = list(follow(source, ImageTracking(filter=given)))
    assert [step.time_s for step in steps] == times.tolist()
    for step, place in zip(steps[15:], path[15:], strict=True):
        near = [track for track in step.tracks if np.hypot(*(track.mean[[X, Y]] - place)) < 2.0]
        assert len(near) == 1
        np.testing.assert_allclose(near[0].mean[[VX, VY]], (14.0, 7.0), atol=8.0)
    with pytest.raises(DataError, match="comes after"):
        list(track_images(frames_of(path[:2], (28, 32)), tracking((28, 32)), [1.0, 0.0]))


@pytest.fixture
def recording(tmp_path: Path) -> tuple[Path, NDArray[np.float64]]:
    path = np.full((24, 2), np.nan)
    path[4:] = straight(20, (8.0, 8.0), (0.4, 0.2))
    np.save(tmp_path / "frames.npy", frames_of(path, (20, 24)))
    return tmp_path / "frames.npy", path


def test_a_recording_leaves_what_the_filter_said(recording: tuple[Path, NDArray[np.float64]], tmp_path: Path) -> None:
    source, path = recording
    done: list[int] = []
    out = tmp_path / "out"
    outcome = track_recording(
        open_frames(source, rate_hz=10.0),
        tracking((5, 5), max_speed=20.0),
        out,
        truth=Truth.of_frames(path[:, None]),
        on_frame=done.append,
    )
    assert done == list(range(1, 25))
    expected = list(
        track_images(np.load(source), tracking((20, 24), max_speed=20.0).bind((20, 24), 0.1), np.arange(24) / 10)
    )
    read = read_tracks_csv(out / "tracks.csv")
    assert read.columns.added == ("intensity", "snr_db")
    np.testing.assert_array_equal(read.rows["position"], outcome.log.rows["position"])
    tracks = [track for step in expected for track in step.tracks]
    assert read.rows["existence"].tolist() == [track.existence for track in tracks]
    np.testing.assert_allclose(outcome.log.times_s, np.arange(24) / 10)
    np.testing.assert_array_equal(outcome.log.steps["existence"], existence(expected))
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as dataset:
        np.testing.assert_array_equal(dataset["x"], [track.mean[X] for track in tracks])
        np.testing.assert_array_equal(
            dataset["position_covariance"], [track.covariance[np.ix_([X, Y], [X, Y])] for track in tracks]
        )
        np.testing.assert_array_equal(dataset["step_existence"], existence(expected))
        assert ImageTracking(**yaml.safe_load(dataset.attrs["config"])).interval_s == 0.1
    last = read.rows[-1]
    assert last["velocity"][0] == pytest.approx(10 * 0.4, abs=1.5)
    assert last["position"][0] == pytest.approx(path[-1, 0], abs=1.0)
    table = dict(outcome.tracked.rows)
    assert table["Frames"] == "24, 24 x 20 pixels"
    rows = outcome.log.rows[outcome.log.rows["status"] == 1]
    found = np.hypot(*(rows["position"] - path[rows["step"]]).T) < 4
    assert table["Targets found within 4 px"] == f"{100 * found.sum() / 20:.0f} % of their times"


def test_a_truth_that_ends_too_soon_is_refused(recording: tuple[Path, NDArray[np.float64]], tmp_path: Path) -> None:
    source, path = recording
    with pytest.raises(DataError, match=r"^truth: has 23 rows for 24 frames"):
        track_recording(
            open_frames(source), tracking((20, 24)), tmp_path / "out", truth=Truth.of_frames(path[:-1, None])
        )
    assert sorted(file.name for file in tmp_path.iterdir()) == ["frames.npy"]


def test_a_truth_is_counted_from_the_files_first_frame(
    recording: tuple[Path, NDArray[np.float64]], tmp_path: Path
) -> None:
    source, path = recording
    outcome = track_recording(
        open_frames(source, start=10), tracking((20, 24)), tmp_path / "out", truth=Truth.of_frames(path[:, None])
    )
    assert outcome.tracked.truth is not None
    np.testing.assert_array_equal(outcome.tracked.truth, path[10:])
    with pytest.raises(DataError, match=r"^truth: "):
        track_recording(
            open_frames(source, start=10),
            tracking((20, 24)),
            tmp_path / "other",
            truth=Truth.of_frames(path[:-1, None]),
        )


def test_another_filter_still_takes_frames_as_recorded() -> None:
    assert ImageTracking(filter={"kind": "existence"}).filter.sensor.kind == "clutter"
    assert ImageTracking(filter={"kind": "existence", "sensor": {"kind": "white"}}).filter.sensor.kind == "white"
