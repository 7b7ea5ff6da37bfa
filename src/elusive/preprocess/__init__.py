"""What is done to recordings before a filter sees them."""

from elusive.preprocess.background import Whitened, Whitener, WhitenerState
from elusive.preprocess.psf import PointSpread, estimate_psf
from elusive.preprocess.registration import Registration, follow_scene, shift
from elusive.preprocess.sliding import Window, window_sums
from elusive.preprocess.stuck import StuckPixels
from elusive.preprocess.windows import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation

__all__ = [
    "ChiSquare",
    "DotProduct",
    "LikelihoodRatio",
    "LocalDeviation",
    "PointSpread",
    "Registration",
    "StuckPixels",
    "Whitened",
    "Whitener",
    "WhitenerState",
    "Window",
    "estimate_psf",
    "follow_scene",
    "shift",
    "window_sums",
]
