"""From beliefs and detections to tracks."""

from elusive.tracking.accumulated import PeakTrack, PeakTracker, PeakTrackerState
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.peaks import Peak, find_peaks
from elusive.tracking.read_back import ReadBack, read_back
from elusive.tracking.track import Status, Step, Track

__all__ = [
    "Life",
    "Lifecycle",
    "Peak",
    "PeakTrack",
    "PeakTracker",
    "PeakTrackerState",
    "ReadBack",
    "Status",
    "Step",
    "Track",
    "find_peaks",
    "read_back",
]
