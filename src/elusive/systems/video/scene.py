"""A scene of ships in sea clutter before a coast, complete in one file: what is simulated, and how it is tracked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from elusive.io.atomic import existing_folder
from elusive.io.radar_video import open_radar_video
from elusive.model import Model
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.results import VideoOutcome
from elusive.systems.video.simulate import VideoSimulation, simulate_video
from elusive.systems.video.track import track_video_recording

# of the tracker, what the simulation says
SETTLED = (
    ("tracking", "radar", "beam_deg"), ("tracking", "radar", "pulse_m"),
    ("tracking", "charted", "imprecision", "coast_sigma_m"),
)  # fmt: skip
FINEST_M = 1.0  # deviation of a charted coast that the tracker counts on at least


class VideoScene(Model):
    """Everything that a run of the workbench's radar video can be told: what is simulated, and how it is tracked."""

    main_options: ClassVar[tuple[str, ...]] = (
        "turns", "ships", "snr_db", "speed_mps", "shape", "clutter_db", "coast_north_m", "coast_error_m", "rocks",
        "seed",
    )  # fmt: skip

    system: Literal["video"] = Field("video", description="What kind of scene this is")
    simulation: VideoSimulation = Field(VideoSimulation(), description="The radar, the sea, ships and coast")
    tracking: VideoTracking = Field(VideoTracking(), description="How it is tracked")

    @property
    def settled(self) -> VideoTracking:
        """The tracking, told the radar's beam and pulse and the chart's error."""
        drawn, charted = self.simulation, self.tracking.charted
        error = charted.imprecision.replace(coast_sigma_m=max(drawn.coast_error_m, FINEST_M))
        return self.tracking.replace(
            radar=self.tracking.radar.replace(beam_deg=drawn.radar.beam_deg, pulse_m=drawn.radar.pulse_m),
            charted=charted.replace(imprecision=error),
        )


def track_video_scene(scene: VideoScene, out: Path, on_turn: Callable[[int], None] | None = None) -> VideoOutcome:
    """Simulate a scene's video into ``recording``, track it as any other, and write ``scene.yaml``.

    Parameters
    ----------
    scene
        What to run.
    out
        Folder for the results.
    on_turn
        Called with the number of turns done, of simulating and then of tracking.

    Raises
    ------
    DataError
        As :func:`~elusive.systems.video.simulate.simulate_video` and
        :func:`~elusive.systems.video.track.track_video_recording`.
    """
    folder, turns = existing_folder(out), scene.simulation.turns
    recording = folder / "recording"
    made = simulate_video(scene.simulation, recording, on_turn)
    outcome = track_video_recording(
        open_radar_video(recording / made.video), scene.settled, folder,
        charts=() if made.chart is None else (recording / made.chart,),
        truth=recording / "truth.csv" if scene.simulation.ships else None,
        on_turn=None if on_turn is None else lambda done: on_turn(turns + done),
    )  # fmt: skip
    (folder / "scene.yaml").write_text(scene.to_yaml(), encoding="utf-8")
    return outcome
