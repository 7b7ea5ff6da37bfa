"""Window 2 and 3: what is assumed of motion and noise, and the estimators that run side by side; their files."""

from __future__ import annotations

import io
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path

from elusive.systems.bearings.page.panels import watch_spec
from elusive.systems.bearings.page.state import BearingsState
from elusive.systems.bearings.scene import BearingScene, Flown, track_bearing_scene
from elusive.workbench.jobs import Job
from elusive.workbench.side_by_side import Ways

MAIN = (("tracking", "motion"), ("tracking", "sigma_deg"), ("tracking", "filter", "loss"))
OUTSIDE = (("tracking", "elevations"), ("tracking", "arrivals"))
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
        flown = track_bearing_scene(scene, on_estimator=job.advance)
        job.advance(job.total)
        return flown

    return work


WAYS = Ways(
    "Estimators side by side", NAMES, "estimators", "time", MAIN, OUTSIDE, prepare, watch_spec,
)  # fmt: skip


def archive(scene: BearingScene, *, still: bool = False) -> bytes:
    """Pack a recording, the scene and the settings of each estimator, as the commands read them."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        files = scene.record(Path(folder), still=still)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as into:
            for path in files:
                into.write(path, path.name)
            into.writestr("scene.yaml", scene.to_yaml())
            if still:
                into.writestr("config.yaml", scene.still.method.to_yaml())
            for name in () if still else scene.estimators:
                into.writestr(f"config-{name}.yaml", scene.tracking.by(name).to_yaml())
    return packed.getvalue()
