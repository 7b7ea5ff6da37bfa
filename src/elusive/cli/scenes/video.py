"""`elusive simulate video`, and a scene of ships in sea clutter."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

from elusive.cli.given import accepts, parameters_of
from elusive.cli.terminal import Config, Out, bar, say, show, show_run, tell_written
from elusive.systems.video.results import FILES, LOCATED
from elusive.systems.video.scene import VideoScene, track_video_scene
from elusive.systems.video.simulate import VideoSimulation, simulate_video

SCENE = VideoScene


@accepts(VideoSimulation)
def simulate_command(out: Out, given: dict[str, Any], config: Config = None) -> None:
    """Write what a radar receives of ships, sea clutter, a coast and rocks, before any threshold."""
    parameters = parameters_of(VideoSimulation, given, config)
    with bar("turns", parameters.turns) as advance:
        made = simulate_video(parameters, out, advance)
    show(out.name, ("", ""), made.rows)
    say(f"Written to {out}: {', '.join(made.files)}")
    told = f" --pulse-m {parameters.radar.pulse_m:g} --beam-deg {parameters.radar.beam_deg:g}"
    if made.chart is not None:
        told += f" --chart {shlex.quote(str(out / made.chart))} --coast-sigma-m {max(parameters.coast_error_m, 1):g}"
    truth = f" --truth {shlex.quote(str(out / 'truth.csv'))}" if parameters.ships else ""
    command = f"elusive track video {shlex.quote(str(out / made.video))}{told}{truth}"
    say(f"To track: {command} --out tracks")


def run_scene(scene: Path, parameters: VideoScene, out: Path) -> None:
    """Run a scene and say what came of it."""
    with bar("turns", 2 * parameters.simulation.turns) as advance:  # simulated, then tracked
        outcome = track_video_scene(parameters, out, advance)
    say(outcome.tracked.verdict)
    show_run(scene.name, outcome.tracked.rows, outcome.findings)
    tell_written(out, (*FILES, LOCATED, "scene.yaml", "recording"), outcome.scored)
