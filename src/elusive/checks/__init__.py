"""Does the data look as the models say? What a system claimed against what came, as findings of one sentence each."""

from elusive.checks.files import write_checks
from elusive.checks.finding import Fact, Finding, Looked, broken, doubted, grave
from elusive.checks.residuals import Scale, lag_of, scale_of, share_of, whole_step

__all__ = [
    "Fact",
    "Finding",
    "Looked",
    "Scale",
    "broken",
    "doubted",
    "grave",
    "lag_of",
    "scale_of",
    "share_of",
    "whole_step",
    "write_checks",
]
