"""What sensors report of a state: each can simulate, and give the log likelihood of states."""

from elusive.sensors.clutter import ClutterSensor
from elusive.sensors.image import ImageSensor
from elusive.sensors.noise_tail import NoiseTail, fit_tail
from elusive.sensors.radar import RadarSensor
from elusive.sensors.scan_prior import ScanPrior
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath, NoiseRecording

__all__ = [
    "ClutterSensor",
    "ImageSensor",
    "NoiseObject",
    "NoiseObjectPath",
    "NoiseRecording",
    "NoiseTail",
    "RadarSensor",
    "ScanPrior",
    "fit_tail",
]
