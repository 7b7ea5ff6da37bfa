"""`elusive simulate signal`, and a scene of a signal."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show, tell_written
from elusive.systems.signals.run import FILES
from elusive.systems.signals.scene import SignalScene, SignalSimulation, simulate_signal, track_signal_scene

SCENE = SignalScene


@accepts(SignalSimulation)
def simulate_command(out: Out, given: dict[str, Any], config: Config = None) -> None:
    """Let noise objects move along a signal and write its samples, and where they were."""
    parameters = parameters_of(SignalSimulation, given, config)
    drawn = simulate_signal(parameters, out)
    objects = drawn.truth.shape[1]
    truth = f", truth.csv ({objects} object{'s' if objects > 1 else ''})" if objects else ""
    say(f"Written to {out}: signal.npy{truth}, simulation.yaml")
    scored = f"--truth {shlex.quote(str(out / 'truth.csv'))} " if objects else ""
    sensor = parameters.sensor
    command = f"elusive track signal {shlex.quote(str(out / 'signal.npy'))} {scored}--border {sensor.border}"
    say(f"To track: {command} --object-size {sensor.object_size} --smoothing 0.9 --out tracks")


def run_scene(scene: Path, parameters: SignalScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    with bar("frames", parameters.frames) as advance:
        outcome = track_signal_scene(parameters, out, on_frame=advance)
    say(outcome.tracked.verdict)
    show(scene.name, ("", ""), outcome.tracked.rows)
    tell_written(out, (*FILES, "signal.npy", "truth.csv", "scene.yaml"), outcome.scored)
