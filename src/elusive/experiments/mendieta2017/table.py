"""The experiments of Mendieta (2017), chapter 4: what its single runs gave, and scores over many runs beside them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from elusive.contracts import Array
from elusive.experiments.means import mean_and_error
from elusive.experiments.mendieta2017.scenario import MethodName
from elusive.experiments.mendieta2017.trial import ESTIMATORS, SHOWN
from elusive.systems.links.networks import GridNodes
from elusive.systems.links.presets import FIRST
from elusive.systems.links.simulate import LinkSimulation

AWGN = "simulation.radiation.voxel_noise_db"
COUNTS = ("misses", "false_positives", "mismatches")


class Single(NamedTuple):
    """One run of the thesis, as printed; NaN where it says nothing."""

    misses: float
    false_positives: float
    mismatches: float
    max_deviation_m: float  # the least of three estimators


class Experiment(NamedTuple):
    """One table of the thesis: what is varied, and by whom it is seen."""

    title: str
    label: str  # of what is varied
    axis: str  # the parameter's path
    values: tuple[int | float, ...]
    methods: tuple[MethodName, ...]
    thesis: tuple[tuple[str, Single], ...]  # value as text, run
    more: tuple[tuple[str, tuple[float, ...]], ...] = ()  # other parameters that are varied
    simulation: LinkSimulation = FIRST

    def parameters(self, method: MethodName) -> dict[str, Any]:
        """Parameters of a method's campaign that are not varied."""
        other = {} if self.simulation is FIRST else {"simulation": self.simulation.model_dump(mode="json")}
        return {"method": method, **other}

    @property
    def grid(self) -> dict[str, list[Any]]:
        """Grid of a method's campaign."""
        return {self.axis: list(self.values), **{name: [*given] for name, given in self.more}}


EXPERIMENTS = {
    "targets": Experiment(
        "Number of targets (section 4.2.1)", "targets", "simulation.walks.users", (1, 2, 4, 10),
        ("thesis", "image", "links", "binary"),
        (("1", Single(0, 0, 0, 0.695)), ("2", Single(0, 0, 0, 0.975)), ("4", Single(0, 0, 0, 1.0)),
         ("4", Single(3, 0, 9, 1.118)), ("10", Single(40, 2, 15, 2.0))),
    ),
    "table4_4": Experiment(
        "Fade level (table 4.4)", "change at the target [dB]", "simulation.radiation.amplitude_db", (5.0, 10.0, 20.0),
        ("thesis", "image", "links"),
        (("5", Single(62, 0, 9, 0.283)), ("10", Single(1, 1, 1, 1.573)), ("20", Single(0, 0, 0, 1.0))),
        ((AWGN, (0.25, 1.0)),),
    ),
    "table4_5": Experiment(
        "Tracking memory (table 4.5)", "memory [frames]", "memory_frames", (1, 3, 5), ("thesis", "image"),
        (("1", Single(45, 0, 24, 0.0)), ("3", Single(0, 1, 0, 1.0)), ("5", Single(0, 0, 0, 0.997))),
    ),
    "table4_6": Experiment(
        "Tracking radius (table 4.6)", "radius [m]", "radius_m", (1.0, 2.0, 3.0), ("thesis", "image"),
        (("1", Single(44, 1, 12, 0.707)), ("2", Single(0, 0, 0, 1.0)), ("3", Single(0, 0, 0, 0.986))),
    ),
    "table4_7": Experiment(
        "Number of sensors (table 4.7)", "sensors", "simulation.network.nodes", (41, 32, 9),
        ("thesis", "image", "links"),
        (("41", Single(0, 0, 0, 0.99)), ("32", Single(0, 0, 0, 1.0)), ("9", Single(1, 98, 36, 19.433))),
    ),
    "grid": Experiment(
        "Nine sensors on a grid (table 3.3)", "rows of three sensors", "simulation.network.rows", (3,),
        ("thesis", "image", "links"), (), simulation=FIRST.replace(network=GridNodes()),
    ),
    "bits": Experiment(
        "Quantisation bits (section 3.5)", "bits a value", "simulation.quantiser.bits", (5, 6, 8, 16),
        ("thesis", "image"), (),
    ),
    "ber": Experiment(
        "Bit error rate of the channel (section 3.6)", "bit error rate", "simulation.quantiser.bit_error_rate",
        (0.0, 1e-6, 1e-4, 1e-3, 1e-2), ("thesis", "image"), (),
    ),
}  # fmt: skip


class Cell(NamedTuple):
    """One row of a table: a score at a point, over all runs."""

    experiment: str
    value: str  # of what is varied
    awgn_db: float
    method: MethodName
    score: str
    runs: int
    mean: float
    standard_error: float
    p10: float
    p90: float
    thesis: str  # its single runs, as printed


def summarise(name: str, results: Mapping[MethodName, xr.Dataset]) -> list[Cell]:
    """Reduce the campaigns of all methods to the rows of a table."""
    experiment = EXPERIMENTS[name]
    cells = []
    noises = dict(experiment.more).get(AWGN, (0.25,))
    for value in experiment.values:
        for noise in noises:
            for method in results:
                at = results[method].sel({experiment.axis: value})
                at = at.sel({AWGN: noise}) if AWGN in at.dims else at
                for score, runs in _scores(at).items():
                    printed = _printed(experiment, f"{value:g}", score) if noise == noises[0] else ""
                    cells.append(Cell(name, f"{value:g}", noise, method, score, len(runs), *_band(runs), printed))
    return cells


def _scores(at: xr.Dataset) -> dict[str, Array]:
    """Return the scores of each run, ``(runs,)`` each."""
    found = {"targets": at["targets"].values.astype(np.float64)}
    for name in ("mota", *COUNTS, "idf1", "gospa_m"):
        values = at[name].transpose("trial", "shown").values
        for column, shown in enumerate(SHOWN):
            found[name if shown == "all" else f"{name}_{shown}"] = values[:, column]
    for name in ("mean_deviation_m", "max_deviation_m"):
        values = at[name].transpose("trial", "estimator").values
        for column, estimator in enumerate(ESTIMATORS):
            if not np.isnan(values[:, column]).all():
                found[f"{name}_{estimator}"] = values[:, column]
        if name == "max_deviation_m":
            found[f"{name}_least"] = np.where(np.isnan(values), np.inf, values).min(axis=1)
    return found


def _band(runs: Array) -> tuple[float, float, float, float]:
    """Mean, its standard error, and the band that holds 80 % of the runs; runs without the number are left out."""
    known = runs[np.isfinite(runs)]
    if not len(known):
        return math.nan, math.nan, math.nan, math.nan
    low, high = np.quantile(known, [0.1, 0.9]).tolist()
    return *mean_and_error(known), low, high


def _printed(experiment: Experiment, value: str, score: str) -> str:
    field = "max_deviation_m" if score == "max_deviation_m_least" else score
    runs = [run for text, run in experiment.thesis if text == value] if field in Single._fields else []
    return "; ".join(f"{getattr(run, field):g}" for run in runs)
