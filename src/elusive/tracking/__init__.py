"""From beliefs and detections to tracks."""

from elusive.tracking.lifecycle import Lifecycle, LifecycleState

__all__ = ["Lifecycle", "LifecycleState"]
