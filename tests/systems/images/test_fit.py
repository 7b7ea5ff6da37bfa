"""`elusive fit images`: the noise, level, width, brightness and polarity with which frames were drawn are found."""

from __future__ import annotations

import json

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError
from elusive.io import open_frames
from elusive.sensors import ImageSensor
from elusive.systems.images.fit import RECORDED, WHITE, fit_images
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.scene import held_frames
from elusive.systems.images.simulate import ImageSimulation, draw_images


def drawn(seed, snr_db=12.0, targets=3, noise_sigma=25.0, psf_sigma=1.2, frames=40, **sensor):
    """Frames of a scene with targets."""
    sensor = ImageSensor(noise_sigma=noise_sigma, psf_sigma=psf_sigma, **sensor)
    shown = {"frames": frames, "appears": 2, "leaves": frames - 2, "targets": targets, "snr_db": snr_db}
    return draw_images(ImageSimulation(rows=64, columns=64, seed=seed, sensor=sensor, **shown)).frames


def fitted(frames):
    """Values by their options."""
    found = fit_images(held_frames("frames", frames))
    return found, {value.option: value for value in found.values}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(
    ("sigma", "level", "width", "snr_db"), [(25, 1000, 1.2, 12), (3, 0, 0.8, 15), (400, 9000, 2.0, 10)]
)
def test_what_frames_were_drawn_with_is_found(seed, sigma, level, width, snr_db):
    found, values = fitted(level + drawn(seed, snr_db, noise_sigma=sigma, psf_sigma=width))
    assert found.remark == WHITE
    told = ImageTracking(**found.tree)
    assert told.filter.sensor.noise_sigma == pytest.approx(sigma, rel=0.02)
    assert told.pedestal == pytest.approx(level, abs=0.03 * sigma)
    assert told.filter.sensor.psf_sigma == pytest.approx(width, abs=4 * values["--psf-sigma"].deviation + 0.05 * width)
    low, high = told.filter.birth.snr_db_range
    assert low < snr_db < high
    assert high - low < 14
    assert values["--polarity"].value == "bright"


@pytest.mark.thorough
def test_stated_deviations_are_those_over_recordings():
    """Over recordings, the noise's error is as large as stated: by the chi-square law of its sum."""
    errors = []
    for seed in range(12):
        _, values = fitted(drawn(seed, targets=1, frames=20))
        sigma = values["--noise-sigma"]
        errors.append((float(sigma.value) - 25.0) / sigma.deviation)
    # a deviation from eight parts is a Student t's; its mean square is 7 / 5
    assert 0.3 < np.mean(np.square(errors)) / (7 / 5) < 2.5


def test_dark_targets_and_an_envelope_are_known_as_such():
    found, values = fitted(1000 - drawn(0))
    assert values["--polarity"].value == "dark"
    assert ImageTracking(**found.tree).polarity == "dark"
    found, _ = fitted(drawn(0, noise="rayleigh"))
    assert ImageTracking(**found.tree).filter.sensor.noise == "rayleigh"
    assert ImageTracking(**found.tree).filter.sensor.noise_sigma == pytest.approx(25, rel=0.02)


def test_what_cannot_be_known_is_left_out():
    found, values = fitted(drawn(0, snr_db=-10.0))
    assert values["--psf-sigma"].value == ""
    assert "too few" in values["--psf-sigma"].how
    assert "psf_sigma" not in found.tree["filter"]["sensor"]
    assert (
        ImageTracking(**found.tree).filter.birth
        == ImageTracking(filter={"kind": "several", "sensor": {"kind": "white"}}).filter.birth
    )


def test_a_scene_is_tracked_as_recorded():
    rng = np.random.default_rng(0)
    still = 30 * rng.standard_normal((64, 64))
    found, _ = fitted(500 + still + rng.normal(0, 3, (24, 64, 64)))
    assert found.remark == RECORDED
    assert found.tree == {}
    with pytest.raises(DataError, match="one frame does not tell its noise from its scene; give more"):
        fitted(500 + still + rng.normal(0, 3, (1, 64, 64)))


def test_frames_are_tracked_with_what_was_fitted(tmp_path, capsys):
    frames = np.round(1000 + drawn(4)).astype(np.uint16)
    np.save(tmp_path / "frames.npy", frames)
    main_quietly(["fit", "images", tmp_path / "frames.npy", "--out", tmp_path / "fitted.yaml"])
    said = capsys.readouterr()
    assert "--noise-sigma" in said.out
    assert "use it with: elusive track images" in said.err
    out = tmp_path / "out"
    main_quietly(
        ["track", "images", tmp_path / "frames.npy", "--config", tmp_path / "fitted.yaml", "--out", out, "--strict",
         "--particles", 200, "--newborns", 100]
    )  # fmt: skip
    assert all(one["holds"] for one in json.loads((out / "checks.json").read_text()))


def main_quietly(arguments):
    """Run a command that ends well."""
    with pytest.raises(SystemExit) as ended:
        main([*map(str, arguments)])
    assert not ended.value.code


def test_a_frame_that_shows_nothing_is_left_out_of_the_fit(tmp_path):
    frames = np.random.default_rng(0).normal(100, 3, (40, 64, 64))
    np.save(tmp_path / "all.npy", frames)
    frames[10] = 0
    np.save(tmp_path / "blank.npy", frames)
    done = []
    fits = [fit_images(open_frames(tmp_path / name), done.append) for name in ("all.npy", "blank.npy")]
    assert done == 2 * [*range(1, 81)]
    noise = [float(value.value) for fit in fits for value in fit.values if value.option == "--noise-sigma"]
    assert noise == pytest.approx([3.0, 3.0], rel=0.02)
