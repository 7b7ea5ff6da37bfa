"""From beliefs and detections to tracks."""

from elusive.tracking.accumulated import PeakTrack, PeakTracker
from elusive.tracking.follow import FollowedState, Follower
from elusive.tracking.footprint import Footprint
from elusive.tracking.lifecycle import Life, Lifecycle
from elusive.tracking.read_back import ReadBack, read_back
from elusive.tracking.search import VelocitySearch
from elusive.tracking.track import Status, Step, Track

__all__ = [
    "FollowedState",
    "Follower",
    "Footprint",
    "Life",
    "Lifecycle",
    "PeakTrack",
    "PeakTracker",
    "ReadBack",
    "Status",
    "Step",
    "Track",
    "VelocitySearch",
    "read_back",
]
