"""How targets move, straight, turning, accelerating or at anchor, and what they carry beside their motion."""

from elusive.motion.anchoring import MovingOrAnchored
from elusive.motion.carried import complete, kinematic_names
from elusive.motion.coast_error import WithCoastError
from elusive.motion.ctrv import ConstantTurnRateVelocity
from elusive.motion.intensity import KinematicMotion, WithIntensity
from elusive.motion.linear import (
    ConstantAcceleration,
    ConstantVelocity,
    CoordinatedTurn,
    LinearMotion,
    square_root,
    transition,
)
from elusive.motion.manoeuvring import ManoeuvringVelocity

__all__ = [
    "ConstantAcceleration",
    "ConstantTurnRateVelocity",
    "ConstantVelocity",
    "CoordinatedTurn",
    "KinematicMotion",
    "LinearMotion",
    "ManoeuvringVelocity",
    "MovingOrAnchored",
    "WithCoastError",
    "WithIntensity",
    "complete",
    "kinematic_names",
    "square_root",
    "transition",
]
