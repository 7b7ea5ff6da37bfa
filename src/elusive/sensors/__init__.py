"""What sensors report of a state: each can simulate, and give the log likelihood of states."""

from elusive.sensors.clutter import ClutterSensor, NoiseTail, fit_tail
from elusive.sensors.image import ImageSensor

__all__ = ["ClutterSensor", "ImageSensor", "NoiseTail", "fit_tail"]
