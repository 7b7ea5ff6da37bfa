"""Frames that are not what was declared: each is named on the command line, and right ones pass in silence."""

from __future__ import annotations

import json
from html import unescape

import numpy as np
import pytest

from elusive.checks import broken
from elusive.cli import main
from elusive.cli.terminal import NOT_BELIEVED
from elusive.io import open_frames
from elusive.sensors import ImageSensor
from elusive.systems.images.checks import FrameChecks
from elusive.systems.images.frame_facts import FrameFacts
from elusive.systems.images.look import look
from elusive.systems.images.movers import Movers
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.recorded_checks import again_finding, recorded_findings
from elusive.systems.images.run import track_recording
from elusive.systems.images.scene_facts import SceneFacts
from elusive.systems.images.simulate import ImageSimulation, draw_images
from elusive.systems.images.track import track_images
from elusive.tracking.peaks import SceneTracker
from elusive.tracking.track import Track
from tests.longer import longer

SIGMA = 3.0
WHITE = ("--noise-sigma", SIGMA)
SEVERAL = ("--filter", "several")
QUICK = ("--filter", "single", "--particles", 200, "--newborns", 100)
LEARNT = {"filter": {"kind": "peaks"}}


def simulated(seed=0, size=24, snr_db=12.0, targets=1, frames=24, **sensor):
    """Frames of white noise with targets."""
    scene = ImageSimulation(
        rows=size, columns=size, frames=frames, leaves=frames - 4, snr_db=snr_db, targets=targets, seed=seed,
        sensor=ImageSensor(noise_sigma=SIGMA, **sensor),
    )  # fmt: skip
    return draw_images(scene).frames


def drifting(frames):
    """Frames whose level rises by five deviations."""
    return frames + np.linspace(0, 5 * SIGMA, len(frames))[:, None, None]


def patterned(frames):
    """Frames with a pattern as strong as the noise that stays."""
    return frames + np.random.default_rng(1).normal(0, SIGMA, frames.shape[1:])


def blurred(frames):
    """Frames whose neighbouring pixels share noise."""
    return (frames + np.roll(frames, 1, axis=1) + np.roll(frames, 1, axis=2)) / np.sqrt(3)


def spiked(frames):
    """Frames with a heavy tail: a pixel in thirty is far too low or high."""
    wide = np.random.default_rng(2).random(frames.shape) < 1 / 30
    return np.where(wide, 5 * frames, frames)


def scene(moved=0.0, size=64, frames=30, seed=0):
    """Frames of a smooth scene that moves along, with some noise; a camera's."""
    rng = np.random.default_rng(seed)
    wide = rng.normal(0, 1, (size, 2 * size))
    for axis in (0, 1):
        wide = sum(np.roll(wide, k, axis) for k in range(-2, 3))
    starts = [round(moved * k) for k in range(frames)]
    return np.stack([100 + 4 * wide[:, k : k + size] + rng.normal(0, 1, (size, size)) for k in starts])


WRONG = {
    "half the noise declared": (lambda: simulated(), ("--noise-sigma", SIGMA / 2), "noise.scale"),
    "twice the noise declared": (lambda: simulated(), ("--noise-sigma", 2 * SIGMA), "noise.scale"),
    "a pedestal left in": (lambda: simulated() + 100, WHITE, "frames.pedestal"),
    "a level that drifts": (lambda: drifting(simulated()), WHITE, "frames.level-drifts"),
    "an envelope as Gaussian": (lambda: simulated(noise="rayleigh"), WHITE, "noise.law"),
    "Gaussian as an envelope": (lambda: simulated() + 50, (*WHITE, "--noise", "rayleigh"), "noise.law"),
    "a scene in white frames": (lambda: patterned(simulated()), WHITE, "noise.correlated-in-time"),
    "blurred noise": (lambda: blurred(simulated()), WHITE, "noise.correlated-in-space"),
    "outliers": (lambda: spiked(simulated()), WHITE, "noise.tail"),
    "far too bright a target expected": (
        lambda: simulated(targets=2),
        (*WHITE, *SEVERAL, "--snr-db", 28),
        "targets.left-over",
    ),
    "too small a point spread": (
        lambda: simulated(size=64, snr_db=20.0, targets=3, psf_sigma=1.4),
        (*WHITE, "--psf-sigma", 0.7),
        "targets.spread",
    ),
    "too large a point spread": (
        lambda: simulated(size=64, snr_db=20.0, targets=3, psf_sigma=0.35),
        (*WHITE, "--psf-sigma", 0.7),  # as all here: kernels are compiled for each width of a patch
        "targets.spread",
    ),
    "time last": (lambda: scene().transpose(1, 2, 0), ("--noise-sigma", 20), "frames.axes"),
    "time between": (lambda: scene().transpose(1, 0, 2), ("--noise-sigma", 20), "frames.axes"),
}


def run(capsys, *arguments):
    """Exit code, and what was said on standard error."""
    code = 0
    try:
        main([*map(str, arguments)])
    except SystemExit as end:
        code = end.code or 0
    return code, capsys.readouterr().err


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_wrong_is_named(tmp_path, capsys, wrong):
    frames, options, name = WRONG[wrong]
    np.save(tmp_path / "frames.npy", frames())
    out = tmp_path / "out"
    code, said = run(capsys, "track", "images", tmp_path / "frames.npy", "--out", out, *QUICK, *options, "--strict")
    assert code == NOT_BELIEVED, said
    failing = {one["name"]: one for one in json.loads((out / "checks.json").read_text()) if not one["holds"]}
    assert name in failing
    last = said.strip().splitlines()[-len(failing) :]
    assert any(line.startswith(f"{name}: {failing[name]['sentence']}") for line in last)
    assert failing[name]["sentence"] in unescape((out / "report.html").read_text())
    assert failing[name]["remedy"]
    believed = "Not to be believed as it stands"
    assert (believed in (out / "report.html").read_text()) == any(one["grave"] for one in failing.values())


def test_what_is_told_right_passes_in_silence(tmp_path, capsys):
    np.save(tmp_path / "frames.npy", 100 - simulated())
    code, said = run(
        capsys, "track", "images", tmp_path / "frames.npy", "--out", tmp_path / "out", *WHITE, "--pedestal", 100,
        "--polarity", "dark", *QUICK, "--strict",
    )  # fmt: skip
    assert code == 0, said
    assert said.strip().splitlines()[-1].startswith("Written to")


def failing(frames, **parameters):
    """Findings on frames that do not hold, by name; of their tracks, which are not there, nothing is asked."""
    checks = FrameChecks(ImageTracking(**parameters))
    for frame in frames:
        checks.add(frame)
    return {one.name: one for one in checks.findings() if not one.holds and one.name != "targets.left-over"}


RIGHT = {
    "weak": {"snr_db": 6.7},
    "bright": {"snr_db": 20.0, "size": 20},
    "several": {"size": 48, "targets": 4, "psf_sigma": 1.0},
    "envelope": {"noise": "rayleigh"},
}


def test_targets_that_are_followed_leave_nothing_over(tmp_path, capsys):
    np.save(tmp_path / "frames.npy", simulated(3, size=48, targets=3))
    out = tmp_path / "out"
    told = ("--noise-sigma", SIGMA, "--particles", 300, "--newborns", 100)
    code, said = run(capsys, "track", "images", tmp_path / "frames.npy", "--out", out, *told, "--strict")
    assert code == 0, said
    (left,) = [one for one in json.loads((out / "checks.json").read_text()) if one["name"] == "targets.left-over"]
    assert left["seen"] < 0.1


def remarks(kind, seeds):
    """Share of right recordings with a remark."""
    options = RIGHT[kind]
    sensor = {"kind": "white", "noise_sigma": SIGMA} | {k: v for k, v in options.items() if k in ("noise", "psf_sigma")}
    return np.mean(
        [
            bool(failing(simulated(seed, **options), filter={"kind": "several", "sensor": sensor}))
            for seed in range(seeds)
        ]
    )


@pytest.mark.parametrize("kind", longer(RIGHT, "bright", "several"))
def test_right_frames_are_seldom_remarked_on(kind):
    assert remarks(kind, 20) <= 1 / 20


@pytest.mark.thorough
@pytest.mark.parametrize("kind", RIGHT)
def test_right_frames_are_seldom_remarked_on_over_many_seeds(kind):
    assert remarks(kind, 300) <= 1 / 20


@pytest.mark.parametrize("moved", longer([0.0, 0.5, 2.0], 0.0, 2.0))
def test_a_recorded_scene_is_seldom_remarked_on(moved):
    assert np.mean([bool(failing(scene(moved, seed=seed), **LEARNT)) for seed in range(20)]) <= 1 / 20


def test_levels_that_flicker_are_no_other_order_of_axes():
    levels = np.random.default_rng(2).normal(0, 200, (30, 1, 1))
    assert "frames.axes" not in failing(scene() + levels, **LEARNT)


def test_the_order_of_noise_alone_is_a_remark():
    """Without a scene the shape alone tells: as many frames as rows, of a square camera."""
    found = failing(np.random.default_rng(0).normal(0, 1, (64, 64, 30)), **LEARNT)
    assert set(found) == {"frames.axes"}
    assert not found["frames.axes"].grave


@pytest.mark.parametrize(("frames", "grave"), [(1, True), (6, True), (15, False)])
def test_few_frames_are_said_to_be_few(frames, grave):
    found = failing(scene(frames=frames), **LEARNT)
    assert set(found) == {"frames.few"}
    assert found["frames.few"].grave == grave
    assert f" {frames} frame{'' if frames == 1 else 's'}: " in found["frames.few"].sentence


def resting():
    """A still, smooth scene with a point that stays, well above what is about it."""
    frames = scene()
    frames[:, 39:42, 20:23] += 300.0
    return frames


SCENES = {
    "another scene": (lambda: np.concatenate([scene(frames=15), scene(frames=15, seed=1)]), "frames.cut", "--start 15"),
    "a point that rests": (resting, "scene.rests", "x 21, y 40"),
    "few frames": (lambda: scene(frames=9), "frames.few", "9 frames"),
}


@pytest.mark.parametrize("wrong", SCENES)
def test_a_scene_that_cannot_be_learnt_is_named(tmp_path, capsys, wrong):
    frames, name, words = SCENES[wrong]
    np.save(tmp_path / "frames.npy", frames())
    out = tmp_path / "out"
    code, said = run(capsys, "track", "images", tmp_path / "frames.npy", "--out", out, "--strict")
    findings = [one for one in json.loads((out / "checks.json").read_text()) if not one["holds"]]
    assert [one["name"] for one in findings] == [name]
    assert code == (NOT_BELIEVED if findings[0]["grave"] else 0)
    assert said.strip().splitlines()[-1].startswith(name)
    assert words in said.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("share", "number", "holds"), [(0.5, 40, False), (0.7, 40, True), (0.5, 0, True), (0.9, 9, True)]
)
def test_sure_tracks_that_are_not_there_again_are_named(share, number, holds):
    found = again_finding(share if number else np.nan, number)
    assert found.holds == holds
    assert holds or f"{100 * share:.0f} %" in found.sentence


TAKEN_BY = {
    "peaks": {"kind": "peaks"},
    "single": {"kind": "single", "sensor": {"kind": "white", "noise_sigma": SIGMA}},
    "single, recorded": {"kind": "single", "particles": 500, "newborns": 500},
    "several": {"kind": "several", "sensor": {"kind": "white", "noise_sigma": SIGMA}},
    "recurrent": {"kind": "recurrent"},
}


@pytest.mark.parametrize("by", longer(TAKEN_BY, "single, recorded", "several", "recurrent"))
def test_copies_are_passed_over_as_if_they_were_missing(by):
    """A camera's frames exported at a higher rate: what is known of the others is, to the last bit, the same."""
    numbers = np.arange(50) - np.arange(50) // 5
    frames = simulated(frames=41) if "sensor" in TAKEN_BY[by] else scene(0.7, frames=41)
    frames[20:, 13:16, 12:15] += 40
    copied = np.diff(numbers, prepend=-1) == 0
    parameters = ImageTracking.model_validate({"filter": TAKEN_BY[by]}).bind(frames.shape[1:])
    checks = FrameChecks(parameters)
    missing = [None if copy else frames[k] for k, copy in zip(numbers, copied, strict=True)]
    given, left_out = (list(track_images(seen, parameters)) for seen in (frames[numbers], missing))
    for one, other in zip(given, left_out, strict=True):
        checks.take(one)
        told = [[(track.track, track.existence, *track.mean) for track in step.tracks] for step in (one, other)]
        np.testing.assert_array_equal(*told)
    assert any(step.tracks for step in given) or by == "single, recorded"
    (found,) = (one for one in checks.findings() if one.name == "frames.repeated")
    assert (found.holds, found.grave, found.seen) == (False, False, 9 / 49)


def test_each_white_frame_twice_has_no_noise_that_goes_on():
    checks = FrameChecks(ImageTracking.model_validate({"filter": {"sensor": {"kind": "white", "noise_sigma": SIGMA}}}))
    for frame in np.repeat(simulated(), 2, axis=0):
        checks.add(frame)
    assert {one.name for one in checks.findings() if not one.holds} <= {"frames.repeated", "targets.left-over"}


def dotted(fall, size=96, frames=36, crowd=False):
    """Frames of a scene with points in it, of which a third fall through it; in a crowd all go their own ways."""
    rng = np.random.default_rng(4)
    (x, y), drawn = rng.uniform(4, size - 4, (2, 36)), scene(size=size, frames=frames)
    speed = np.where(np.arange(36) < 12, fall * 1j, 0.0)
    if crowd:
        speed, drawn = fall * np.exp(1j * np.arange(36)), rng.normal(100, 1, drawn.shape)
    yy, xx = np.mgrid[:size, :size]
    for k, frame in enumerate(drawn):
        for across, down in zip((x + speed.real * k) % size, (y + speed.imag * k) % size, strict=True):
            frame += 50 * np.exp(-((xx - across) ** 2 + (yy - down) ** 2) / 2)
    return drawn


@pytest.mark.parametrize(("crowd", "low", "high"), [(False, 0.15, 0.45), (True, 0.55, 1.0)])
def test_a_scene_most_of_which_moves_is_named(crowd, low, high):
    frames = dotted(1.0, crowd=crowd)
    parameters = ImageTracking().bind(frames.shape[1:])
    checks = FrameChecks(parameters)
    for step in track_images(frames, parameters):
        checks.take(step)
    (found,) = (one for one in checks.findings() if one.name == "images.movers")
    assert found.holds != crowd
    assert not found.grave
    assert low < found.seen < high


@pytest.mark.parametrize(
    ("most", "frames", "holds"), [(0.97, 9, False), (0.97, 8, True), (0.98, 50, True), (0.4, 50, True)]
)
def test_what_is_shown_and_never_moved_for_sure_is_named(most, frames, holds):
    """Of a hundred frames a target is shown in all, and for some another track that hardly moves."""
    movers, belief = Movers(), SceneTracker().begin()
    for k in range(100):
        others = [(2, most if k == frames // 2 else min(0.6, most))] if k < frames else []
        tracks = [
            Track(number, "confirmed", 0.9, np.zeros(4), np.eye(4), extra={"moves": moves, "shown": 1.0})
            for number, moves in [(1, min(1.0, 0.55 + k / 40)), *others]
        ]
        movers.take(belief._replace(tracks=tuple(tracks)))
    (found,) = (one for one in movers.findings() if one.name == "tracks.unsure")
    assert found.holds == holds
    assert not found.grave
    assert found.seen == (frames / 100 if most == 0.97 else 0.0)


@pytest.mark.parametrize("marks", [0, 8])
def test_marks_on_the_sensor_before_a_scene_that_goes_by_are_named(marks):
    rng, size, frames = np.random.default_rng(7), 96, 40
    wide = dotted(0.0, size=2 * size, frames=1)[0]
    yy, xx = np.mgrid[:size, :size]
    dust = sum(
        (-40 * np.exp(-((xx - x) ** 2 + (yy - y) ** 2) / 4) for x, y in rng.uniform(6, size - 6, (marks, 2))),
        np.zeros((size, size)),
    )
    seen = np.array([wide[20 : 20 + size, k : k + size] + dust for k in range(frames)])
    seen += rng.normal(0, 1, seen.shape)
    parameters = ImageTracking().bind(seen.shape[1:])
    checks = FrameChecks(parameters)
    for step in track_images(seen, parameters):
        checks.take(step)
    (found,) = (one for one in checks.findings() if one.name == "images.marks")
    assert found.holds == (marks == 0)
    assert not found.grave


def test_whitened_pixels_are_compared_with_a_gaussian():
    gaussian = {0.159: -1.0, 0.5: 0.0, 0.841: 1.0, 0.999: 3.3}
    assert all(one.holds for one in recorded_findings(SceneFacts(), gaussian)[-2:])
    wide, tail = recorded_findings(SceneFacts(), gaussian | {0.841: 1.6, 0.999: 53.0})[-2:]
    assert (wide.name, tail.name) == ("noise.whitened", "noise.whitened-tail")
    assert not wide.holds
    assert not tail.holds
    assert "53.0" in tail.sentence


@pytest.mark.parametrize(("heights", "alone"), [((60.0,), True), ((60.0, 26.0, 19.0, 13.0, 9.0, 6.0), False)])
def test_the_brightest_of_many_lamps_does_not_stand_alone(heights, alone):
    """Twice the next, as the first of every fourth draw of a Pareto law of exponent two is."""
    scene, (y, x) = SceneFacts(), np.mgrid[:96, :96]
    rng, lamps = np.random.default_rng(9), np.zeros((96, 96))
    for k, height in enumerate(heights):
        lamps += height * np.exp(-((x - 12 - 14 * k) ** 2 + (y - 20 - 37 * (k % 3)) ** 2) / 3)
    for _ in range(30):
        scene.add(100 + lamps + rng.normal(0, 3, lamps.shape))
    assert scene.resting.height > 2 * scene.resting.next_heights[0]
    (found,) = (one for one in recorded_findings(scene, {}, Movers().standing()) if one.name == "scene.rests")
    assert found.holds != alone


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_what_is_shown_and_never_moved_is_named(speed):
    """A roof, eight pixels wide, is no point; what goes has been shown for standing out alone, too, at first."""
    rng, (y, x) = np.random.default_rng(3), np.mgrid[:96, :96]
    parameters = ImageTracking().bind((96, 96))
    checks, shown = FrameChecks(parameters), 0
    roofs = ((abs(y - 24) <= 4) & (abs(x - 33 - speed * k) <= 4) for k in range(40))
    frames = (100 + 3 * np.sin(x / 9) + rng.normal(size=roof.shape) - 60 * roof for roof in roofs)
    for step in track_images(frames, parameters):
        checks.take(step)
        shown += any(track.extra["shown"] and track.extra["moves"] < 0.5 for track in step.tracks)
    assert shown > 2
    (found,) = (one for one in checks.findings() if one.name == "scene.rests")
    assert found.holds == (speed > 0)
    assert found.holds or found.seen == shown


def test_what_is_kept_does_not_grow():
    facts = FrameFacts()
    rng = np.random.default_rng(0)
    seen = SceneFacts()
    for _ in range(700):
        facts.add(frame := rng.normal(0, 1, (16, 16)))
        seen.add(frame)
    assert max(len(facts.medians), len(facts.steps)) <= 65
    assert len(seen.likeness) <= 257
    assert facts.law.sigma == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize("axis", [0, 2])
def test_a_look_before_the_run_tells_the_order_of_axes(tmp_path, axis):
    rng = np.random.default_rng(5)
    frames = 100 + 20 * rng.normal(size=(1, 48, 64)) + rng.normal(size=(40, 48, 64))
    np.save(tmp_path / "frames.npy", np.moveaxis(frames, 0, axis))
    looked = look(tmp_path / "frames.npy", {})
    assert looked.said == ("40 frames of 64 x 48 pixels." if axis == 0 else "48 frames of 40 x 64 pixels.")
    assert [one.name for one in broken(looked.findings)] == ([] if axis == 0 else ["frames.axes"])
    assert looked.picture.shape == np.moveaxis(frames, 0, axis).shape[1:]


@pytest.mark.parametrize(
    "blank", [[30, 31, 32], *(pytest.param(few, marks=pytest.mark.thorough) for few in ([40], [0, 1]))]
)
def test_frames_that_show_nothing_are_passed_over_and_told(blank, tmp_path):
    """As while a shutter is closed: the target is followed past them, and told as before."""
    rng, (y, x) = np.random.default_rng(3), np.mgrid[:72, :96]
    scene = 100 + 40 * np.exp(-((y - 60) ** 2 / 400 + (x - 40) ** 2 / 900)) + 5 * np.sin(x / 9)
    frames = np.array([
        scene + rng.normal(0, 2, scene.shape) + 14 * np.exp(-((y - 20) ** 2 + (x - 12 - 0.9 * k) ** 2) / 3)
        for k in range(60)
    ])  # fmt: skip
    frames[blank] = 0
    np.save(tmp_path / "frames.npy", frames.clip(0, 255).astype(np.uint8))
    outcome = track_recording(open_frames(tmp_path / "frames.npy"), ImageTracking(), tmp_path / "out")
    told = {finding.name: finding for finding in outcome.findings}["frames.blank"]
    assert (told.holds, told.grave, told.seen) == (False, False, len(blank) / 60)
    rows = outcome.log.shown.rows
    last = rows["position"][rows["time_s"] == 59]
    assert np.hypot(*(last - [12 + 0.9 * 59, 20]).T).min() < 2
