"""Several targets in frames by accumulation: found where they are, at the wanted rate of false alarms, and told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.filters.accumulate.image_evidence import FromNormal, WhiteEvidence
from elusive.filters.accumulate.likelihood_bound import LikelihoodBound
from elusive.io import Truth, open_frames
from elusive.results import read_tracks_csv
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.run import track_recording
from elusive.systems.images.track import ImageTracking, track_images
from tests import infrared
from tests.browsing import data_in, layers
from tests.longer import longer

SHAPE = (40, 48)
SENSOR = ImageSensor(rows=SHAPE[0], columns=SHAPE[1])
SNR_DB = 8.0


def tracking(sensor: ImageSensor | ClutterSensor = SENSOR, **changes: Any) -> ImageTracking:
    given = {"max_velocity": 1.0, "velocity_step": 0.25, **changes}
    return ImageTracking(filter=RecurrentImages(sensor=sensor, **given))


def frames_of(
    *paths: NDArray[np.float64], sensor: ImageSensor = SENSOR, seed: int = 1, snr_db: float = SNR_DB
) -> NDArray[np.float64]:
    """Noise, and a target at each place of each path ``(T, 2)``; NaN: none."""
    rng, intensity = np.random.default_rng(seed), sensor.intensity_of(snr_db)
    states = [[[x, 0, y, 0, intensity] for x, y in places if np.isfinite(x)] for places in zip(*paths, strict=True)]
    return np.stack([sensor.simulate(np.array(state).reshape(-1, 5), rng) for state in states])


def straight(frames: int, start: tuple[float, float], step: tuple[float, float]) -> NDArray[np.float64]:
    return np.array(start) + np.arange(frames)[:, None] * np.array(step)


@pytest.mark.thorough
def test_two_targets_and_one_that_comes_late_and_goes_again() -> None:
    first, second = straight(50, (4, 6), (0.75, 0.2)), straight(50, (44, 30), (-0.6, 0.0))
    third = straight(50, (34, 21), (0.1, -0.05))
    third[:15] = third[38:] = np.nan
    results = list(track_images(frames_of(first, second, third), tracking()))
    seen: dict[int, list[int]] = {}
    for number, step in enumerate(results):
        living = [one for one in step.tracks if one.status == "confirmed"]
        assert all(np.isnan(one.existence) and 0 <= one.score <= 1 for one in step.tracks)  # no posterior
        for one in living:
            apart = [np.hypot(*(one.mean[[0, 2]] - path[number])) for path in (first, second, third)]
            if np.nanmin(apart) < 2.5:
                seen.setdefault(one.track, []).append(int(np.nanargmin(apart)))
            else:  # the third's track may outlive it a while
                assert 37 < number < 46
        expected = {0, 1} | ({2} if 27 <= number < 38 else set())
        if number >= 20:
            assert expected <= {seen[one.track][-1] for one in living if one.track in seen}
    assert [len(set(of)) for of in seen.values()] == [1, 1, 1]  # a track stays with its target
    last = results[-1].tracks
    assert sorted(one.status for one in last) == ["confirmed", "confirmed"]
    assert {one.track for one in last} == {track for track, of in seen.items() if of[0] != 2}


def test_the_velocity_is_that_of_the_target() -> None:
    path = straight(40, (6, 30), (0.8, -0.4))
    results = list(track_images(frames_of(path), tracking(threshold_from="likelihood")))
    velocities = np.array([step.state.mean[[1, 3]] for step in results[20:]])
    np.testing.assert_allclose(velocities.mean(axis=0), (0.8, -0.4), atol=0.1)


@pytest.mark.parametrize("noise", longer(["gaussian", "rayleigh"], "rayleigh"))
def test_false_alarms_come_at_the_wanted_rate(noise: Any) -> None:
    """Of 200 runs at .1 some 20; the law is fitted to some 256 maxima, which scatters the rate by a quarter more."""
    sensor = ImageSensor(rows=20, columns=20, noise=noise)
    parameters = tracking(sensor, false_alarm=0.1, smoothing=0.5, velocity_step=0.5, target_snr_db=3.0)
    flt, rng = parameters.recursion, np.random.default_rng(7)
    begun: Any = flt.init(rng, 0.0)
    alarms = 0
    for _ in range(200):
        state = begun._replace(followed=flt.init_followed(rng))
        for _ in range(4):
            state = flt.step(state, state.time_s + 1, sensor.simulate(np.empty((0, 5)), rng), rng)
        alarms += float(state.followed.score.max()) > state.threshold
    assert abs(alarms - 20) < 3 * np.hypot(4.2, 5.0)


def test_the_bound_holds_for_exact_likelihood_ratios() -> None:
    """Sums of log ratios that fade: however heavy their tail, at most p of the maps hold one beyond the bound."""
    rng, gain, p = np.random.default_rng(3), 0.2, 0.2
    for level in (0.3, 1.0, 3.0):
        total, offset = np.zeros((4000, 20)), 0.0
        for _ in range(12):
            ratio = level * rng.standard_normal(total.shape) - level**2 / 2
            total = (1 - gain) * total + gain * (ratio + level**2 / 2)
            offset = (1 - gain) * offset - gain * level**2 / 2
        bound = LikelihoodBound(20, gain, 0.7, offset)
        highest = total.max(axis=1) / 0.7
        assert (highest > bound.threshold(p)).mean() <= p + 3 * np.sqrt(p / 4000)
        np.testing.assert_allclose(bound.probability(bound.threshold(p)), p)
    assert bound.probability(-1e3) == 1.0


@pytest.mark.parametrize(
    ("noise", "swerling"), longer([("gaussian", 0), ("rayleigh", 0), ("rayleigh", 1)], ("rayleigh", 1))
)
def test_evidence_is_zero_on_the_mean_everywhere(noise: Any, swerling: Any) -> None:
    sensor = ImageSensor(rows=7, columns=9, noise=noise, swerling=swerling)
    white = WhiteEvidence(sensor, 6.0)
    rng = np.random.default_rng(2)
    maps = np.stack([white.evidence(sensor.simulate(np.empty((0, 5)), rng)) for _ in range(1000)])
    error = maps.std(axis=0) * np.sqrt(1 / 1000 + 1 / 400)  # an envelope's own mean comes from 400 frames
    assert (np.abs(maps.mean(axis=0)) < 4.5 * error).all()
    drawn = np.stack([FromNormal(white).evidence(rng.standard_normal((7, 9))) for _ in range(1000)])
    assert (np.abs(drawn.mean(axis=0)) < 4.5 * error).all()
    np.testing.assert_allclose(drawn.std(), maps.std(), rtol=0.05)


def test_a_masked_cell_says_nothing() -> None:
    frame = np.random.default_rng(1).normal(0, 3, SHAPE)
    frame[10:20, 10:20] = np.nan
    evidence = WhiteEvidence(SENSOR, 6.0).evidence(frame)
    assert np.isfinite(evidence).all()
    assert (evidence[12:18, 12:18] == 0).all()


def test_a_missing_frame_is_predicted_over() -> None:
    path = straight(30, (6, 20), (0.75, 0.0))
    frames: list[Any] = list(frames_of(path))
    frames[20] = frames[21] = None
    results = list(track_images(frames, tracking(threshold_from="likelihood")))
    assert len(results) == 30
    assert [step.tracks[0].status for step in results[19:24]] == ["confirmed"] * 5
    assert np.hypot(*(results[21].tracks[0].mean[[0, 2]] - path[21])) < 2.5


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_tracks() -> None:
    frames = frames_of(straight(15, (6, 20), (0.75, 0.0)))
    parameters = tracking(smoothing=0.7)
    once, again = (list(track_images(frames, parameters)) for _ in range(2))
    assert [step.state.score for step in once] == [step.state.score for step in again]
    assert [[track[:2] for track in step.tracks] for step in once] == [
        [track[:2] for track in step.tracks] for step in again
    ]


def test_the_law_may_come_from_each_map_itself() -> None:
    sensor = ImageSensor(rows=96, columns=96)
    path = straight(25, (20, 70), (0.75, -0.5))
    results = list(track_images(frames_of(path, sensor=sensor), tracking(sensor, threshold_from="frame")))
    assert results[-1].tracks[0].status == "confirmed"
    assert np.hypot(*(results[-1].tracks[0].mean[[0, 2]] - path[-1])) < 2.5
    empty = list(track_images(frames_of(path * np.nan, sensor=sensor), tracking(sensor, threshold_from="frame")))
    assert not any(one.status == "confirmed" for step in empty for one in step.tracks)


def test_another_size_of_frame_is_refused() -> None:
    with pytest.raises(DataError, match="the sensor expects"):
        list(track_images([np.zeros((9, 9))], tracking(threshold_from="likelihood")))


WHITE = {"filter": {"sensor": {"kind": "white"}}}


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"filter": {"kind": "recurrent"}, "jitter_px": 1.0}, "jitter_px: has no meaning for filter 'recurrent'"),
        ({"filter": {"kind": "recurrent", "threshold_from": "simulation"}}, "recorded frames are not simulated"),
        ({"filter": {"kind": "recurrent", "particles": 10}}, "there is no such field"),
        ({**WHITE, "background": {"rest_lag": 9}}, "background: has no meaning for frames taken as they are"),
        ({**WHITE, "jitter_px": 1.0}, "jitter_px: has no meaning for frames taken as they are"),
        ({"clump_px": 9.0}, "clump_px: has no meaning for filter 'peaks'"),
    ],
)
def test_options_of_another_filter_are_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        ImageTracking(**given)


def test_more_velocities_than_memory_are_refused_before_they_are_listed() -> None:
    sensor = ImageSensor(rows=64, columns=64)
    with pytest.raises(DataError, match="more than half of the machine's"):
        next(track_images([np.zeros((64, 64))], tracking(sensor, max_velocity=1e6)))


def test_the_command_refuses_an_option_that_the_filter_does_not_have(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    np.save(tmp_path / "frames.npy", frames_of(straight(5, (6, 20), (0.75, 0.0))))
    command = ["track", "images", str(tmp_path / "frames.npy"), "--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit):
        main([*command, "--filter", "recurrent", "--newborns", "10"])
    assert "--newborns: has no meaning for filter 'recurrent'" in " ".join(capsys.readouterr().err.split())
    with pytest.raises(SystemExit):
        main([*command, "--smoothing", "0.5", "--filter", "single"])
    assert "--smoothing: has no meaning for filter 'single'" in " ".join(capsys.readouterr().err.split())


def test_a_recording_gives_a_row_a_track_and_a_report_of_all(tmp_path: Path) -> None:
    first, second = straight(25, (4, 6), (0.75, 0.2)), straight(25, (44, 30), (-0.6, 0.0))
    np.save(tmp_path / "frames.npy", frames_of(first, second))
    source = open_frames(str(tmp_path / "frames.npy"))
    outcome = track_recording(
        source, tracking(), tmp_path / "out", truth=Truth.of_frames(np.stack([first, second], axis=1))
    )
    read = read_tracks_csv(tmp_path / "out" / "tracks.csv")
    np.testing.assert_array_equal(read.rows["position"], outcome.log.rows["position"])
    assert np.isnan(read.rows["existence"]).all()  # it is no posterior: the column is empty
    both = read.rows[read.rows["time_s"] == 20]
    assert both["status"].tolist() == [1, 1]
    assert np.isnan(both["covariance"]).all()  # not known
    assert (both["added"][:, 0] > 0.99).all()  # score
    assert len((tmp_path / "out" / "tracks_mot.csv").read_text().splitlines()) >= 2 * 15
    said = dict(outcome.tracked.rows)
    assert said["Confirmed tracks"] == "1, 2"
    assert said["Tracks that never met a target"] == "0"
    assert outcome.tracked.tracks is not None
    assert sorted(outcome.tracked.tracks) == [1, 2]
    error = outcome.tracked.error
    assert error is not None
    assert np.nanmax(error[15:]) < 2.5  # of the first target to the nearest track
    page = data_in(tmp_path / "out" / "report.html")
    assert len(layers(page, type="track")) == 2
    assert len(layers(page, name="truth")) == 2
    # the configuration repeats the run
    again = ImageTracking.from_yaml(tmp_path / "out" / "config.yaml")
    assert again == tracking().bind(SHAPE)


needs_recordings = pytest.mark.skipif(
    not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA} is missing; point ELUSIVE_DATA at the data"
)


def followed(sequence: infrared.Sequence) -> tuple[float, set[int | None]]:
    """Share of the frames from the tenth with a track within 4 px of the label, and the confirmed tracks."""
    given = ImageTracking(filter={"kind": "recurrent"}).bind(sequence.frames.shape[1:])
    near, confirmed = [], set()
    for step, label in zip(track_images(sequence.frames, given), sequence.labels, strict=True):
        tracks = [one for one in step.tracks if one.status != "deleted"]
        near.append(any(np.hypot(*(one.mean[[0, 2]] - label)) <= 4 for one in tracks))
        confirmed |= {one.track for one in tracks if one.status == "confirmed"}
    return float(np.mean(near[10:])), confirmed


@pytest.mark.validate
@needs_recordings
def test_recorded_infrared() -> None:
    """With settings from the model alone the target is found, and nothing else becomes a confirmed track."""
    share, confirmed = followed(infrared.read("easy2"))
    assert share >= 0.9
    assert len(confirmed) == 1


@needs_recordings
@pytest.mark.thorough
@pytest.mark.parametrize("name", ["easy2", "sequence1"])
def test_recorded_infrared_in_full(name: str) -> None:
    sequence = infrared.read(name)
    share, confirmed = followed(sequence)
    assert share >= 0.9
    assert len(confirmed) <= 2  # sequence1 jumps by 8 px at frame 72, and its target is found anew
    assert followed(infrared.scale(sequence, 0.0))[1] == set()


def test_a_moving_scene_is_followed() -> None:
    """The scene jumps about by whole pixels; the target moves steadily in it, and is found where it is in the frame."""
    rng = np.random.default_rng(5)
    scene = ndimage.gaussian_filter(rng.normal(0, 60, (160, 160)), 3)
    jumps = np.cumsum(rng.integers(-2, 3, (45, 2)), axis=0) + 40
    path = straight(45, (25, 30), (0.5, 0.25))
    spot = np.exp(-0.5 * (np.arange(-4, 5) / 1.1) ** 2)
    frames = []
    for number, (across, down) in enumerate(jumps):
        seen = scene.copy()
        x, y = np.rint(path[number] + 40).astype(int)
        seen[y - 4 : y + 5, x - 4 : x + 5] += 9 * np.outer(spot, spot)
        frames.append(100 + seen[down : down + 80, across : across + 80] + rng.normal(0, 1, (80, 80)))
    given = ImageTracking(filter={"kind": "recurrent"}).bind((80, 80))
    results = list(track_images(frames, given))
    truth = path + 40 - jumps
    assert results[-1].tracks[0].status == "confirmed"
    first = [step.tracks[0].mean for step in results[20:]]
    apart = [np.hypot(*(mean[[0, 2]] - place)) for mean, place in zip(first, truth[20:], strict=True)]
    assert np.median(apart) < 2.0
    velocities = np.array([mean[[1, 3]] for mean in first[5:]])
    np.testing.assert_allclose(velocities.mean(axis=0), (0.5, 0.25), atol=0.2)
