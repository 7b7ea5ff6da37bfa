"""What sensors report of a state: each can simulate, and give the log likelihood of states."""

from elusive.sensors.clutter import ClutterSensor, NoiseTail, fit_tail
from elusive.sensors.image import ImageSensor
from elusive.sensors.waveform import NoiseObject, NoiseObjectPath, NoiseRecording

__all__ = ["ClutterSensor", "ImageSensor", "NoiseObject", "NoiseObjectPath", "NoiseRecording", "NoiseTail", "fit_tail"]
