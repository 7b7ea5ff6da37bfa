"""From beliefs and detections to tracks."""

from elusive.tracking.accumulated import PeakTrack, PeakTracker, PeakTrackerState
from elusive.tracking.lifecycle import Lifecycle, LifecycleState
from elusive.tracking.peaks import Peak, find_peaks
from elusive.tracking.read_back import ReadBack, read_back

__all__ = [
    "Lifecycle",
    "LifecycleState",
    "Peak",
    "PeakTrack",
    "PeakTracker",
    "PeakTrackerState",
    "ReadBack",
    "find_peaks",
    "read_back",
]
