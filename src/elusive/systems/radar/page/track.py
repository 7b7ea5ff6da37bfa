"""Window 3 and 4: what the tracker assumes, and the uses of the chart that run side by side."""

from __future__ import annotations

from collections.abc import Callable

from elusive.errors import DataError
from elusive.systems.radar.page.panels import watch_spec
from elusive.systems.radar.page.state import ChartsState
from elusive.systems.radar.scene_run import Sailed, sail
from elusive.workbench.jobs import Job
from elusive.workbench.side_by_side import Ways

TRACKING = ("tracking",)
MAIN = (
    *((*TRACKING, name) for name in ("particles", "motion", "estimate", "seed", "coast")),
    *((*TRACKING, "radar", name) for name in ("detection_probability", "false_alarms")),
    *((*TRACKING, "radar", name) for name in ("range_sd_m", "bearing_sd_mrad")),
)  # fmt: skip
OUTSIDE = ((*TRACKING, "knowledge"), (*TRACKING, "charted"))
NAMES = {
    "none": "none: no chart", "hard": "hard: charted land is never sailed", "nearest": "nearest: the nearest coast",
    "grid": "grid: the thesis's, convolved on cells", "exact": "exact: convolved without cells",
    "field": "field: exact, kept as a spline",
}  # fmt: skip


def prepare(state: ChartsState) -> Callable[[Job], Sailed]:
    """Return the work of a tab's scene.

    Raises
    ------
    DataError
        If no chart is open.
    """
    scene = state.scene
    if state.chart is None:
        raise DataError("chart: none is open; open one under Chart.")
    chart = state.chart.file

    def work(job: Job) -> Sailed:
        job.total = len(scene.voyage().times_s) * len(scene.methods)
        return sail(scene, chart, job.advance)

    return work


WAYS = Ways(
    "Uses of the chart side by side", NAMES, "methods", "scan", MAIN, OUTSIDE, prepare, watch_spec,
)  # fmt: skip
