"""Run time and memory of each method beside those of Bootsveld (2012), section 7.1: 6 hours, and 90 million cells.

One run of trial C, 6000 particles, on the whole map of 10 by 9 km. The thesis's times are of its own machine and
MATLAB; ratios between methods are what can be compared.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import NamedTuple

from numpy.random import SeedSequence, default_rng

from elusive.charts import Coast, CoastPart, ExactWater, FieldWater, GridWater, HardWater, NearestWater, Water
from elusive.charts.water import WaterModel
from elusive.contracts import Array
from elusive.experiments.bootsveld2012.case import scenery
from elusive.experiments.bootsveld2012.shore import shoreline
from elusive.experiments.bootsveld2012.trial import ShipTrial, draw, filter_of
from elusive.report import plots

METHODS: dict[str, tuple[WaterModel | None, str]] = {
    "no chart": (None, ""),
    "hard": (HardWater(), ""),
    "nearest edge of all": (NearestWater(boundary=None), "6 hours"),
    "nearest edge within 3 s": (NearestWater(), "about a tenth of it"),
    "grid, cells of .2 s": (GridWater(), "fast; 90 million cells"),
    "exact": (ExactWater(), ""),
    "field": (FieldWater(), ""),
}
ENOUGH_S = 20.0  # of a method so slow that the rest of its run is reckoned


class RunTime(NamedTuple):
    """One row of ``runtimes.csv``."""

    method: str
    prepare_s: float  # of the processor, all three; indexing, convolving, fitting: once a chart
    run_s: float  # all of the filter, every step
    chart_s: float  # of this, for P(water)
    steps_timed: int  # of the run's; the rest is reckoned
    steps: int
    megabytes: float  # that the prepared chart takes
    thesis: str


class Timed:
    """Knowledge that counts the time spent on it."""

    def __init__(self, water: Water, moved: Array) -> None:
        self.water, self.moved, self.seconds = water, moved, 0.0
        self.floor = water.floor

    def log_probability(self, states: Array) -> Array:
        """Log P(water) of ``(N, d)`` states, in the frame of the radar."""
        started = time.process_time()
        there = states.copy()
        there[:, [0, 2]] -= self.moved
        found = self.water.log_probability(there)
        self.seconds += time.process_time() - started
        return found


def run_times(case: ShipTrial, seed: int, enough_s: float = ENOUGH_S) -> list[RunTime]:
    """Time every method on the same run past the port; one over ``enough_s`` is broken off and its rest reckoned."""
    coast = Coast.of(CoastPart(list(shoreline(case.shoreline, case.delta_seed)), case.sigma))
    run = draw(case, default_rng(SeedSequence(seed, spawn_key=(0,))))
    scene = scenery(case)
    rows = []
    for name, (model, thesis) in METHODS.items():
        if model is not None:
            model.bind(scene.coast)  # so that compilation is not timed, nor that of a step below
        started = time.process_time()
        known = None if model is None else Timed(model.bind(coast), scene.moved)
        prepare = time.process_time() - started if known is not None else 0.0
        filter = filter_of(case, run, () if known is None else (known,), case.particles)
        filter.step(filter.init(default_rng(0), 0.0), 1.0, run.scans[1], default_rng(0))
        rng = default_rng(run.seed)
        state = filter.init(rng, run.scans[0].time_s)
        if known is not None:
            known.seconds = 0.0
        started, steps = time.process_time(), 0
        for scan in run.scans[1:]:
            state = filter.step(state, scan.time_s, scan, rng)
            steps += 1
            if time.process_time() - started > enough_s:
                break
        whole = (len(run.scans) - 1) / steps
        took = whole * (time.process_time() - started)
        in_chart, size = (whole * known.seconds, known.water.nbytes / 1e6) if known is not None else (0.0, 0.0)
        rows.append(RunTime(name, prepare, took, in_chart, steps, len(run.scans) - 1, size, thesis))
    return rows


def draw_run_times(path: Path, rows: list[RunTime]) -> None:
    """Draw seconds of a run and megabytes of the chart, a bar for each method."""
    with plots.figure(path, 9.0, 3.4, 1, 2) as (_, grid):
        left, right = grid[0]
        names = [row.method for row in rows][::-1]
        for axes, values, unit in (
            (left, [row.run_s for row in rows][::-1], "s"),
            (right, [row.megabytes for row in rows][::-1], "MB"),
        ):
            bars = axes.barh(names, values, color=plots.TRACKS[1], height=0.6)
            axes.bar_label(bars, [f" {value:.3g}" if value else "" for value in values], fontsize=8)
            axes.set_xscale("log")
            axes.set_xlim(0.5 * min(value for value in values if value), 8 * max(values))
            axes.set_xlabel(f"one run of {rows[0].steps} s [s]" if unit == "s" else "memory of the prepared chart [MB]")
            axes.grid(visible=False, axis="y")
        left.set_title(f"Run time, {rows[0].steps} steps")
        right.set_title("Memory")
        right.set_yticklabels([])
