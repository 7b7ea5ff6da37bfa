"""What is done to recordings before a filter sees them."""

from elusive.preprocess.background import Whitened, Whitener, WhitenerState
from elusive.preprocess.psf import PointSpread, estimate_psf
from elusive.preprocess.registration import Registration, follow_scene, shift
from elusive.preprocess.stuck import StuckPixels

__all__ = [
    "PointSpread",
    "Registration",
    "StuckPixels",
    "Whitened",
    "Whitener",
    "WhitenerState",
    "estimate_psf",
    "follow_scene",
    "shift",
]
