"""What a signal's run assumed, against what came: wrong inputs are named through the command line, right ones not."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from elusive.checks import broken
from elusive.cli import main
from elusive.filters.accumulate.false_alarm import ExtremeValue
from elusive.systems.signals.checks import findings_of
from elusive.systems.signals.facts import SignalFacts
from elusive.systems.signals.track import SignalState, SignalTracking, track_signal
from elusive.tracking import Step, Track
from tests.longer import longer

later = partial(pytest.param, marks=pytest.mark.thorough)
QUICK = {"filter": {"smoothing": 0.9, "max_velocity": 3}}
TIMES, SAMPLES = 150, 200


def noise(kind: str, seed: int, times: int = TIMES, samples: int = SAMPLES) -> np.ndarray:
    """Frames ``(times, samples)`` of noise of a kind, with an object in it."""
    rng = np.random.default_rng(seed)
    frames = rng.standard_normal((times, samples))
    speed, loud = (12, 4) if kind == "fast" else (1, 2)
    for number in range(times // 2, times):
        frames[number, (50 + speed * number + np.arange(5)) % samples] += loud * rng.standard_normal(5)
    if kind.startswith("ar"):
        return lfilter([1], [1, -float(kind[2:])], frames.ravel()).reshape(frames.shape)
    if kind == "unequal":
        return frames * 10 ** (3 * rng.standard_normal(samples) / 20)
    if kind == "drifting":
        phases = rng.uniform(0, 2 * np.pi, samples)
        return frames * 10 ** (4 * np.sin(2 * np.pi * np.arange(times)[:, None] / 700 + phases) / 20)
    if kind == "along":
        return frames * 10 ** (5 * np.sin(np.arange(frames.size) / 250) / 20).reshape(frames.shape)
    if kind == "rotor":  # louder at every fifth part of a frame, nearly
        beats = np.sin(2 * np.pi * np.arange(frames.size) * 5.03 / samples).reshape(frames.shape)
        return rng.standard_normal(frames.shape) * (1 + (beats > 0.8))
    if kind == "bursts":  # of eight samples, anywhere and never twice
        for frame in frames:
            for first in rng.integers(samples, size=rng.poisson(2.0)):
                frame[(first + np.arange(8)) % samples] += 4 * rng.standard_normal(8)
    if kind == "pulses":  # three in a frame, nearly
        return rng.standard_normal(frames.shape) + 3 * (np.arange(frames.size) % 66.95 < 5).reshape(frames.shape)
    if kind == "quiet":
        frames = rng.standard_normal(frames.shape)
        for number in range(30, times):
            frames[number, (50 + number + np.arange(9)) % samples] *= 0.15
    if kind == "jumps":
        return frames + np.where(rng.random((times, 1)) < 0.2, 10 * rng.standard_normal((times, 1)), 0.0)
    if kind == "rests":
        frames[20:, 20:28] *= 3
    if kind == "strong":  # three objects, thrice as loud as noise
        for first, way in ((10, 1.5), (80, -0.8), (140, 2.2)):
            for number in range(30, times):
                frames[number, (first + round(way * number) + np.arange(5)) % samples] += 3 * rng.standard_normal(5)
    if kind == "silent":
        frames[: times // 4] = 0.0
    return frames


def names(frames: np.ndarray, **given: Any) -> dict[str, bool]:
    """Findings that do not hold, and whether they are grave."""
    parameters, facts = SignalTracking(**QUICK, **given), SignalFacts()
    for step in track_signal(frames, parameters):
        facts.add(step)
    return {one.name: one.grave for one in broken(findings_of(parameters, facts))}


def in_turn(*channels: np.ndarray) -> np.ndarray:
    """Samples of channels one after another."""
    return np.stack(channels, axis=-1).reshape(len(channels[0]), -1)


def read_as_pairs(frames: np.ndarray) -> np.ndarray:
    """Real samples as I and Q."""
    return frames[:, ::2] + 1j * frames[:, 1::2]


@pytest.mark.parametrize(
    "kind", longer(["white", "strong", "ar0.9", "unequal", "along"], "strong", "ar0.9", "unequal", "along")
)
@pytest.mark.parametrize("seed", longer([0, 1, 2], 1, 2))
def test_what_is_right_is_not_remarked_on(kind: str, seed: int) -> None:
    assert names(noise(kind, seed)) == {}


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["white", "ar0.5", "ar0.9", "ar0.99", "unequal", "along"])
def test_one_right_signal_in_twenty_is_remarked_on_at_most(kind: str) -> None:
    assert sum(bool(names(noise(kind, seed))) for seed in range(20)) <= 1


def test_what_is_quieter_is_found_as_the_finding_says() -> None:
    told = {"mode": "replacing", "object_deviation": 0.3}
    parameters, facts = SignalTracking(**QUICK, statistic=told), SignalFacts()
    for step in track_signal(noise("quiet", 1), parameters):
        facts.add(step)
    (found,) = [track.mean for track in step.tracks if track.status == "confirmed"]
    assert found == pytest.approx([(50 + TIMES - 1 + 4) % SAMPLES, 1.0], abs=3)
    assert "signals.quieter" not in [one.name for one in broken(findings_of(parameters, facts))]


def test_a_level_that_jumps_ends_no_run() -> None:
    *_, last = track_signal(noise("jumps", 1), SignalTracking(**QUICK))
    (found,) = [track.mean[0] for track in last.tracks if track.extra["shown"] and track.status == "confirmed"]
    assert found == pytest.approx((50 + TIMES - 1 + 2) % SAMPLES, abs=3)


def test_the_mean_of_few_samples_ends_no_run() -> None:
    frames = np.random.default_rng(1).standard_normal((100, 9)) + np.r_[[0.0] * 40, [1.0] * 60][:, None]
    assert len(list(track_signal(frames + 0.5j * frames[:, ::-1], SignalTracking(**QUICK)))) == 100
    assert len(list(track_signal(frames, SignalTracking(**QUICK)))) == 100


@pytest.mark.parametrize("ends", ["confirmed", "deleted"])
def test_alarms_are_counted_unless_they_are_believed(ends: str) -> None:
    facts, rng, law = SignalFacts(), np.random.default_rng(2), ExtremeValue(20.0, 2.0)
    for number in range(60):
        status = "candidate" if number < 59 else ends
        state = SignalState(rng.standard_normal(50), np.full(50, 6.0), 5.0, law)
        facts.add(Step(number, state.taken, state, (Track(1, status, 0.0, np.zeros(2), np.eye(2)),)))
    assert facts.alarms(0.001).holds == (ends == "confirmed")
    assert facts.alarms(0.001).seen == (0.0 if ends == "confirmed" else 1.0)


@pytest.mark.parametrize(
    ("frames", "arguments", "name", "grave"),
    [
        (lambda: noise("ar0.9", 1), ["--noise", "white", "--subtract-mean"], "signals.colour", True),
        (lambda: noise("unequal", 1), ["--noise", "white"], "signals.levels", True),
        later(lambda: noise("along", 1, samples=800), ["--noise", "white"], "signals.levels", True),
        later(lambda: noise("drifting", 1, times=400), [], "signals.drift", False),
        later(lambda: noise("ar0.9", 1).T, [], "signals.axes", False),
        later(lambda: noise("ar0.9", 1).T, ["--noise", "white"], "signals.axes", True),
        (lambda: noise("unequal", 1, samples=300).T, [], "signals.axes", False),
        later(lambda: noise("white", 1)[:15], [], "signals.few", False),
        (lambda: noise("white", 1)[:8], [], "signals.few", True),
        (lambda: noise("white", 1)[:, :30], [], "signals.short", False),
        later(lambda: noise("white", 1), ["--calibration-frames", "10", "--smoothing", "0.95"], "signals.short", False),
        later(lambda: noise("bursts", 1, times=300), [], "signals.bursts", True),
        later(lambda: noise("bursts", 1, times=300), ["--clip", "2"], "signals.bursts", True),
        (lambda: noise("fast", 1), [], "signals.bursts", False),
        (lambda: noise("rests", 1), [], "signals.rests", False),
        (lambda: noise("pulses", 1), [], "signals.alike", False),
        (lambda: noise("quiet", 1), [], "signals.quieter", False),
        later(lambda: noise("rotor", 1), ["--noise", "white"], "signals.alike", False),
        (
            lambda: noise("white", 1),
            ["--statistic", "dot", "--boundaries", "-0.674", "--boundaries", "0", "--boundaries", "0.674"],
            "signals.boundaries",
            True,
        ),
        later(lambda: np.sign(noise("white", 1)), [], "signals.even", True),
        later(lambda: np.clip(noise("white", 1), -0.5, 0.5), [], "signals.even", True),
        (lambda: (2000 * noise("white", 1)).astype(">i2").view("<i2"), [], "signals.even", True),
        later(lambda: in_turn(noise("white", 1), 2 * noise("white", 2)), [], "signals.interleaved", False),
        later(lambda: in_turn(noise("ar0.5", 1), noise("ar0.5", 2)), [], "signals.interleaved", False),
        later(lambda: read_as_pairs(noise("ar0.9", 1)), [], "signals.interleaved", False),
        later(lambda: noise("silent", 1), [], "signals.silent", False),
        (lambda: np.where(np.arange(TIMES)[:, None] < 100, 0.0, noise("white", 1)), [], "signals.silent", True),
    ],
)
def test_a_wrong_input_is_named(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    frames: Callable[[], np.ndarray],
    arguments: list[str],
    name: str,
    grave: bool,
) -> None:
    np.save(tmp_path / "signal.npy", frames())
    quick = ["--max-velocity", "3", *([] if "--smoothing" in arguments else ["--smoothing", "0.9"])]
    command = ["track", "signal", str(tmp_path / "signal.npy"), "--out", str(tmp_path / "out"), "--strict"]
    with pytest.raises(SystemExit) as end:
        main([*command, *quick, *arguments])
    assert (end.value.code or 0) == (3 if grave else 0)
    failing = [one for one in json.loads((tmp_path / "out" / "checks.json").read_text()) if not one["holds"]]
    assert name in [one["name"] for one in failing]
    assert [one["grave"] for one in failing if one["name"] == name] == [grave]
    said = " ".join(capsys.readouterr().err.split())
    assert all(f"{one['sentence']} {one['remedy']}" in said for one in failing)
    assert name in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
