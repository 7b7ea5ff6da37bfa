"""Frames in, tracks out: any size, gaps, borders, a target that comes back, and the same numbers from the same seed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from elusive.contracts import X, Y
from elusive.errors import DataError
from elusive.filters import BernoulliFilter, MeasurementBirth
from elusive.io import open_frames, read_tracks_csv
from elusive.sensors.image import ImageSensor
from elusive.systems.images.results import FrameTrack, row_of
from elusive.systems.images.track import ImageTracking, track_images, track_recording
from elusive.tracking import Lifecycle

SNR_DB = 14.0
NOWHERE = (np.nan, np.nan)


def tracking(shape: tuple[int, int], seed: int = 0, **changes: Any) -> ImageTracking:
    """White noise of known deviation: nothing to whiten, so that what must come out is known."""
    sensor = ImageSensor(rows=shape[0], columns=shape[1])
    model = BernoulliFilter(sensor=sensor, birth=MeasurementBirth(snr_db=SNR_DB, max_speed=2.0), **changes)
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


def places(results: list[FrameTrack]) -> NDArray[np.float64]:
    return np.array([result.mean[[X, Y]] for result in results])


def existence(results: list[FrameTrack]) -> NDArray[np.float64]:
    return np.array([result.existence for result in results])


@pytest.mark.parametrize("shape", [(20, 20), (7, 90), (64, 48), (300, 17), (480, 640), (768, 1024)], ids=str)
def test_any_size_and_shape(shape: tuple[int, int]) -> None:
    rows, columns = shape
    path = straight(12, (0.3 * columns, 0.5 * rows), (min(0.4, columns / 40), min(0.3, rows / 40)))
    results = list(track_images(frames_of(path, shape), tracking(shape)))
    assert len(results) == 12
    # the median: in a third of all runs one frame's noise takes it below for that frame
    assert np.median(existence(results)[4:]) > 0.9
    assert (np.hypot(*(places(results) - path)[4:].T) < 1.0).all()
    assert [result.track for result in results[-5:]] == [1] * 5
    assert results[-1].status == "confirmed"


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
    assert results[-1].track is None


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
    confirmed = [result.track for result in results if result.status == "confirmed"]
    first, second = sorted(set(confirmed))
    assert first < second
    assert {result.track for result in results[10:18]} == {first}
    assert {result.track for result in results[38:46]} == {second}
    assert all(result.track is None for result in results[23:31])
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
    assert np.trace(results[12].covariance) > np.trace(results[11].covariance)
    assert p[13:].min() > 0.9
    assert {result.track for result in results[6:]} == {1}


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
    for a, b in zip(one, same, strict=True):
        assert a.existence == b.existence
        np.testing.assert_array_equal(a.mean, b.mean)
        np.testing.assert_array_equal(a.covariance, b.covariance)
    assert [a.existence for a in one] != [b.existence for b in other]


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


def test_the_sensor_takes_its_size_from_the_recording() -> None:
    fitted = tracking((20, 20)).fitted_to((7, 90))
    assert fitted.filter.sensor.shape == (7, 90)
    assert fitted.replace(filter=tracking((20, 20)).filter) == tracking((20, 20))


def test_speeds_are_a_second_where_the_rate_is_known() -> None:
    mean, covariance = np.array([3.0, 0.5, 7.0, -0.25, 9.0]), np.diag([4.0, 1.0, 9.0, 1.0, 1.0])
    result = FrameTrack(0.75, mean, covariance, 2, "confirmed")
    assert row_of(result, 1.5, None)[:10] == (1.5, 2, "confirmed", 0.75, 3.0, 7.0, 0.5, -0.25, 2.0, 3.0)
    assert row_of(result, 1.5, 20.0)[:10] == (1.5, 2, "confirmed", 0.75, 3.0, 7.0, 10.0, -5.0, 2.0, 3.0)
    absent = row_of(result._replace(track=None, status="none"), 1.5, 20.0)
    assert absent[:4] == (1.5, None, "none", 0.75)
    assert np.isnan(absent[4:]).all()


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
        open_frames(source, rate_hz=10.0), tracking((5, 5)), out, truth=path, on_frame=done.append
    )
    assert done == list(range(1, 25))
    expected = list(track_images(np.load(source), tracking((20, 24))))
    rows = read_tracks_csv(out / "tracks.csv")
    assert rows == outcome.rows or str(rows) == str(outcome.rows)  # NaN equals no NaN
    assert [row.existence for row in rows] == [result.existence for result in expected]
    assert [row.time_s for row in rows] == [k / 10 for k in range(24)]
    with xr.open_dataset(out / "result.nc", engine="h5netcdf") as dataset:
        np.testing.assert_array_equal(dataset["mean"], [result.mean for result in expected])
        np.testing.assert_array_equal(dataset["covariance"], [result.covariance for result in expected])
        assert dataset["state"].values.tolist() == ["x", "vx", "y", "vy", "intensity"]
        np.testing.assert_allclose(dataset["time"], np.arange(24) / 10)
        assert dataset["status"].values.tolist() == [row.status for row in rows]
    last = rows[-1]
    assert last.vx == pytest.approx(10 * 0.4, abs=1.5)
    assert last.x == pytest.approx(path[-1, 0], abs=1.0)
    table = dict(outcome.tracked.rows)
    assert table["Frames"] == "24, 24 x 20 pixels"
    found = [row.existence > 0.5 and np.hypot(row.x - x, row.y - y) < 4 for row, (x, y) in zip(rows, path, strict=True)]
    assert table["Found: P above .5, within 4 px"] == f"{100 * np.mean(found[4:]):.0f} % of the frames with it"


def test_a_truth_that_ends_too_soon_is_refused(recording: tuple[Path, NDArray[np.float64]], tmp_path: Path) -> None:
    source, path = recording
    with pytest.raises(DataError, match=r"^truth: has 23 rows for 24 frames"):
        track_recording(open_frames(source), tracking((20, 24)), tmp_path / "out", truth=path[:-1])
    assert sorted(file.name for file in tmp_path.iterdir()) == ["frames.npy"]


def test_a_truth_is_counted_from_the_files_first_frame(
    recording: tuple[Path, NDArray[np.float64]], tmp_path: Path
) -> None:
    source, path = recording
    outcome = track_recording(open_frames(source, start=10), tracking((20, 24)), tmp_path / "out", truth=path)
    assert outcome.tracked.truth is not None
    np.testing.assert_array_equal(outcome.tracked.truth, path[10:])
    with pytest.raises(DataError, match=r"^truth: "):
        track_recording(open_frames(source, start=10), tracking((20, 24)), tmp_path / "other", truth=path[:-1])


def test_another_filter_still_takes_frames_as_recorded() -> None:
    assert ImageTracking(filter={"kind": "existence"}).filter.sensor.kind == "clutter"
    assert ImageTracking(filter={"kind": "existence", "sensor": {"kind": "white"}}).filter.sensor.kind == "white"
