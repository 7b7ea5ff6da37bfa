"""A scene of ships in sea clutter before a coast, and how it is tracked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from pydantic import Field

from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.quality import Imprecision
from elusive.io.radar_video import open_radar_video
from elusive.model import Model
from elusive.systems.video.parameters import VideoTracking
from elusive.systems.video.results import VideoOutcome
from elusive.systems.video.simulate import VideoSimulation, simulate_video
from elusive.systems.video.track import track_video_recording


class VideoScene(Model):
    """What is simulated, and how it is tracked."""

    system: Literal["video"] = Field("video", description="What kind of scene this is")
    simulation: VideoSimulation = Field(VideoSimulation(), description="The radar, the sea, ships and coast")
    tracking: VideoTracking = Field(VideoTracking(), description="How it is tracked")

    def told(self) -> VideoTracking:
        """Return the tracking, told the radar's beam and pulse and the chart's error."""
        radar = self.tracking.radar.replace(
            beam_deg=self.simulation.radar.beam_deg, pulse_m=self.simulation.radar.pulse_m
        )
        sigma = max(self.simulation.coast_error_m, 1.0)
        charted = ChartedAreaParameters(imprecision=Imprecision(coast_sigma_m=sigma))
        return self.tracking.replace(radar=radar, charted=charted)


def track_video_scene(scene: VideoScene, out: Path, on_turn: Callable[[int], None] | None = None) -> VideoOutcome:
    """Simulate a scene into a folder, and track it into its folder ``tracks``.

    Raises
    ------
    DataError
        As :func:`~elusive.systems.video.simulate.simulate_video`.
    """
    made = simulate_video(scene.simulation, out, on_turn)
    charts = () if made.chart is None else (out / made.chart,)
    return track_video_recording(
        open_radar_video(out / made.video), scene.told(), out / "tracks", charts=charts,
        truth=out / "truth.csv" if scene.simulation.ships else None, on_turn=on_turn,
    )  # fmt: skip
