"""`elusive simulate images`, and a scene of image frames."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show, tell_written
from elusive.systems.images.run import FILES
from elusive.systems.images.scene import ImageScene, track_image_scene
from elusive.systems.images.simulate import ImageSimulation, simulate_images

SCENE = ImageScene


@accepts(ImageSimulation)
def simulate_command(out: Out, given: dict[str, Any], config: Config = None) -> None:
    """Let weak targets move through image frames and write what a camera sees, and where they were."""
    parameters = parameters_of(ImageSimulation, given, config)
    with bar("frames", parameters.frames) as advance:
        drawn = simulate_images(parameters, out, on_frame=advance)
    say(f"Written to {out}: frames.npy, truth.csv ({drawn.truth.shape[1]} targets), simulation.yaml")
    frames, truth = (shlex.quote(str(out / name)) for name in ("frames.npy", "truth.csv"))
    sensor, (low, high) = parameters.sensor, parameters.snr_db_range
    sought = f"--snr-db {low:g}" if low == high else f"--snr-db-range {low:g} {high:g}"
    noise = "" if sensor.noise == "gaussian" else f" --noise {sensor.noise}"
    seen = f"--noise-sigma {sensor.noise_sigma:g} --psf-sigma {sensor.psf_sigma:g}{noise} {sought}"
    command = f"elusive track images {frames} --truth {truth} {seen} --out tracks"
    say(f"To track: {command}")


def run_scene(scene: Path, parameters: ImageScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    with bar("frames", parameters.frames) as advance:
        outcome = track_image_scene(parameters, out, on_frame=advance)
    show(scene.name, ("", ""), outcome.tracked.rows)
    tell_written(out, (*FILES, "frames.npy", "truth.csv", "scene.yaml"), outcome.scored)
