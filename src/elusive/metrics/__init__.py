"""Scores of estimates against truth, from arrays and datasets alone: no filter is imported here."""

from __future__ import annotations

from elusive.metrics._trials import Estimate
from elusive.metrics.calibration import Calibration, calibration_curve
from elusive.metrics.clear_mot import ClearMot, clear_mot
from elusive.metrics.consistency import Nees, nees
from elusive.metrics.cramer_rao import Bound, bound_covariance, posterior_bound, uniform_prior_information
from elusive.metrics.errors import bias, position_errors, rmse_by_frame, rmse_over_window
from elusive.metrics.existence import DetectionDelay, false_alarm_rate, missed_detection_rate, time_to_detection
from elusive.metrics.identity_scores import Identity, identity
from elusive.metrics.path_bound import PathBound, path_bound
from elusive.metrics.pixels import pixel_information
from elusive.metrics.roc import Roc, roc_curve
from elusive.metrics.set_distances import Gospa, gospa, ospa
from elusive.metrics.target_table import Sightings, sightings, sightings_of

__all__ = [
    "Bound",
    "Calibration",
    "ClearMot",
    "DetectionDelay",
    "Estimate",
    "Gospa",
    "Identity",
    "Nees",
    "PathBound",
    "Roc",
    "Sightings",
    "bias",
    "bound_covariance",
    "calibration_curve",
    "clear_mot",
    "false_alarm_rate",
    "gospa",
    "identity",
    "missed_detection_rate",
    "nees",
    "ospa",
    "path_bound",
    "pixel_information",
    "position_errors",
    "posterior_bound",
    "rmse_by_frame",
    "rmse_over_window",
    "roc_curve",
    "sightings",
    "sightings_of",
    "time_to_detection",
    "uniform_prior_information",
]
