"""Recordings, live sources and truth read, of every system; tracks sent on; files that appear whole or not at all."""

from elusive.io._asterix_items import TargetReport
from elusive.io.ais import AisPosition, read_ais
from elusive.io.asterix import AsterixSummary, asterix_plots, read_asterix, summarize_asterix
from elusive.io.asterix_video import send_asterix_video, write_asterix_video
from elusive.io.atomic import atomic_folder, atomic_path, existing_folder
from elusive.io.frames import FrameSource, open_frames
from elusive.io.radar_plots import RadarSource, open_radar_plots
from elusive.io.radar_video import RadarVideoSource, open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.io.radar_writing import write_radar_plots_csv
from elusive.io.signals import SignalFrame, SignalSource, open_signal
from elusive.io.truth import Truth, read_truth, write_truth
from elusive.sensors.radar_scans import RadarPlot, RadarScan, scans_by_rotation

__all__ = [
    "AisPosition",
    "AsterixSummary",
    "FrameSource",
    "RadarPlot",
    "RadarScan",
    "RadarSource",
    "RadarVideoSource",
    "SignalFrame",
    "SignalSource",
    "TargetReport",
    "Truth",
    "asterix_plots",
    "atomic_folder",
    "atomic_path",
    "existing_folder",
    "open_frames",
    "open_radar_plots",
    "open_radar_video",
    "open_signal",
    "read_ais",
    "read_asterix",
    "read_truth",
    "scans_by_rotation",
    "send_asterix_video",
    "summarize_asterix",
    "write_asterix_video",
    "write_radar_plots_csv",
    "write_radar_video_arrays",
    "write_truth",
]
