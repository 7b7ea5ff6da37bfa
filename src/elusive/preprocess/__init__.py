"""What is done to recordings before a filter sees them."""

from elusive.preprocess.background import Whitened, Whitener, WhitenerState
from elusive.preprocess.binary_links import BinaryLinks, LinkTests
from elusive.preprocess.blobs import Clusters, Heads
from elusive.preprocess.fade_level import RssChange, RssState
from elusive.preprocess.image_priors import ExponentialCovariance, Tikhonov
from elusive.preprocess.link_calibration import Calibrate, Calibration, fade_level
from elusive.preprocess.link_weights import EllipseWeights, coverage
from elusive.preprocess.peaks import PeakFinder, Peaks, PeakState
from elusive.preprocess.projectors import Projector
from elusive.preprocess.quantiser import Quantiser
from elusive.preprocess.registration import Registration, follow_scene, shift
from elusive.preprocess.sliding import Window, window_sums
from elusive.preprocess.stuck import StuckPixels
from elusive.preprocess.threshold import Threshold, ThresholdState
from elusive.preprocess.tomography import RegularisedImage
from elusive.preprocess.voxels import VoxelGrid
from elusive.preprocess.windows import ChiSquare, DotProduct, LikelihoodRatio, LocalDeviation

__all__ = [
    "BinaryLinks",
    "Calibrate",
    "Calibration",
    "ChiSquare",
    "Clusters",
    "DotProduct",
    "EllipseWeights",
    "ExponentialCovariance",
    "Heads",
    "LikelihoodRatio",
    "LinkTests",
    "LocalDeviation",
    "PeakFinder",
    "PeakState",
    "Peaks",
    "Projector",
    "Quantiser",
    "Registration",
    "RegularisedImage",
    "RssChange",
    "RssState",
    "StuckPixels",
    "Threshold",
    "ThresholdState",
    "Tikhonov",
    "VoxelGrid",
    "Whitened",
    "Whitener",
    "WhitenerState",
    "Window",
    "coverage",
    "fade_level",
    "follow_scene",
    "shift",
    "window_sums",
]
