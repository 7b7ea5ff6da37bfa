"""Parameters of tracking ships in radar video, filled from the recording where they are not given."""

from __future__ import annotations

import math
import time
from typing import ClassVar

import numpy as np
from pydantic import Field

from elusive.charts import Coast, FieldWater, Water
from elusive.charts.charted_area import ChartedAreaParameters
from elusive.model import Model, Positive
from elusive.preprocess.clutter_map import ClutterMap
from elusive.sensors.echo_extent import EchoExtent
from elusive.sensors.radar_video import RadarVideo
from elusive.sensors.spokes import Spokes
from elusive.tracking.evidence_maps import EvidenceRules, EvidenceTracker
from elusive.tracking.lifecycle import Lifecycle

MOST_BYTES = 2e9  # of cells and what is learnt of them
OF_CELL, OF_TURN = 200.0, 9e7  # what a turn's cell takes, and its targets, in logarithms of an array: measured
BEAM_DEG = 2.0  # of a recording in which nothing shows it
PROBED = 1 << 18  # logarithms that are timed


class RecordedVideo(Model):
    """The radar of a recording; its ranges are those of the spokes, and what is not given is what its echoes show."""

    beam_deg: Positive | None = Field(
        None,
        description="Width of the beam, between half powers, one way; by default as the recording's echoes show [deg]",
    )
    pulse_m: Positive | None = Field(
        None,
        description="Resolution in range, half a pulse's length; by default as the recording's echoes show [m]",
    )
    levels_db: tuple[float, ...] = Field(
        RadarVideo.model_fields["levels_db"].default,
        min_length=1,
        description=RadarVideo.model_fields["levels_db"].description,
    )

    def bind(self, spokes: Spokes, extent: EchoExtent) -> RadarVideo:
        """Return the sensor for the range scale of some spokes, whose echoes reach so far."""
        pulse_m = self.pulse_m or (None if math.isnan(extent.pulse_m) else extent.pulse_m)
        beam_deg = self.beam_deg or (BEAM_DEG if math.isnan(extent.beam_deg) else extent.beam_deg)
        return RadarVideo(
            beam_deg=beam_deg, pulse_m=pulse_m, levels_db=self.levels_db, start_m=spokes.start_m,
            step_m=spokes.step_m, samples=spokes.amplitude.shape[1],
        )  # fmt: skip


class VideoTracking(Model):
    """Parameters of `elusive track video`."""

    main_options: ClassVar[tuple[str, ...]] = (
        "beam_deg", "pulse_m", "azimuth_bias_deg", "coast_sigma_m", "births_per_h", "rest_deviations", "seed",
    )  # fmt: skip

    radar: RecordedVideo = Field(RecordedVideo(), description="The radar")
    azimuth_bias_deg: float = Field(
        0.0, ge=-180, le=180, description="What is added to every azimuth: of a head that is not mounted straight [deg]"
    )
    clutter: ClutterMap = Field(ClutterMap(), description="How clutter is learnt")
    learning_turns: int = Field(
        6, ge=1, le=50, description="Turns that clutter is learnt from before the first is tracked in"
    )
    water: FieldWater = Field(FieldWater(), description="How the chart is used, where one is given")
    charted: ChartedAreaParameters = Field(ChartedAreaParameters(), description="What the charts are taken to say")
    tracker: EvidenceRules = Field(
        EvidenceRules(lifecycle=Lifecycle(confirm_from=0.95, candidate_from=0.5, delete_below=0.1, delete_frames=3)),
        description="When a track begins and ends",
    )
    seed: int = Field(0, ge=0, description="Root of all random numbers")

    def bind(self, sensor: RadarVideo, coast: Coast | None) -> tuple[EvidenceTracker, Water | None]:
        """Return the tracker for a radar and a coast, and P(water)."""
        water = None if coast is None else self.water.bind(coast)
        rules = {name: getattr(self.tracker, name) for name in EvidenceRules.model_fields}
        return EvidenceTracker(**rules, sensor=sensor, knowledge=() if water is None else (water,)), water


class PlotFinding(Model):
    """Parameters of `elusive plots`."""

    main_options: ClassVar[tuple[str, ...]] = ("false_alarms", "beam_deg", "pulse_m", "azimuth_bias_deg", "least_water")

    radar: RecordedVideo = Field(RecordedVideo(), description="The radar")
    azimuth_bias_deg: float = Field(
        0.0, ge=-180, le=180, description="What is added to every azimuth: of a head that is not mounted straight [deg]"
    )
    clutter: ClutterMap = Field(ClutterMap(), description="How clutter is learnt")
    learning_turns: int = Field(6, ge=1, le=50, description="Turns that clutter is learnt from before the first")
    water: FieldWater = Field(FieldWater(), description="How the chart is used, where one is given")
    charted: ChartedAreaParameters = Field(ChartedAreaParameters(), description="What the charts are taken to say")
    false_alarms: Positive = Field(5.0, description="Mean number of false alarms a turn: sets the threshold")
    least_water: float = Field(0.5, ge=0, le=1, description="P(water) below which a plot is taken to be of land")


def bytes_held(sensor: RadarVideo, learning_turns: int) -> float:
    """Memory that a run takes for cells: of a turn, of what is learnt, and of turns that wait [bytes]."""
    rows, columns = sensor.shape
    return float(rows * columns * (8 * learning_turns + 68))


def seconds_a_turn(sensor: RadarVideo) -> float:
    """Time that a turn takes of one core of this machine, by that of a logarithm here; good to a factor of two [s]."""
    values = np.linspace(0.5, 2.0, PROBED, dtype=np.float32)
    taken = []
    for _ in range(5):
        began = time.thread_time()
        np.log(values)
        taken.append(time.thread_time() - began)
    rows, columns = sensor.shape
    return min(taken) / PROBED * (OF_CELL * rows * columns * max(1.0, sensor.grouped / 4) + OF_TURN)
