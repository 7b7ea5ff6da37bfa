"""Window 2 and 3: what is assumed of motion and noise, and the estimators that run side by side."""

from __future__ import annotations

from collections.abc import Callable

from elusive.systems.bearings.page.panels import watch_spec
from elusive.systems.bearings.page.run import Flown, fly
from elusive.systems.bearings.page.state import BearingsState
from elusive.workbench.jobs import Job
from elusive.workbench.side_by_side import Ways

MAIN = tuple(
    ("tracking", name) for name in ("motion", "sigma_deg", "q", "q_jerk", "q_speed", "q_turn", "stay_s", "loss")
)
OUTSIDE = (("tracking", "filter"), ("tracking", "elevations"), ("tracking", "q_vertical"))
NAMES = {
    "fg-eks": "fg-eks: Jiang's smoother", "fg-ekf": "fg-ekf: Jiang's filter", "ekf": "ekf: extended Kalman",
    "iekf": "iekf: iterated EKF", "rts": "rts: RTS smoother", "map": "map: batch MAP",
    "fixed-lag": "fixed-lag: smoother with a lag",
}  # fmt: skip


def prepare(state: BearingsState) -> Callable[[Job], Flown]:
    """Return the work of a tab's scene."""
    scene = state.scene

    def work(job: Job) -> Flown:
        job.total = len(scene.estimators)
        flown = fly(scene, job.advance)
        job.advance(job.total)
        return flown

    return work


WAYS = Ways(
    "Estimators side by side", NAMES, "estimators", "time", MAIN, OUTSIDE, prepare, watch_spec,
    ("The whole path", "Close to the emitter"),
)  # fmt: skip
