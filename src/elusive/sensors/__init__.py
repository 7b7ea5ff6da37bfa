"""What sensors report of a state: each can simulate, and give the log likelihood of states."""

from elusive.sensors.image import ImageSensor

__all__ = ["ImageSensor"]
