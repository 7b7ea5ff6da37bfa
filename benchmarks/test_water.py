"""P(water) near real coasts, side by side with shapely, the nearest edge and the grid; and within a particle filter."""

from __future__ import annotations

import functools
import math
import time

import numpy as np
import pytest
import shapely

from elusive import run
from elusive.charts import ExactWater, FieldWater, GridWater, NearestWater
from elusive.filters.particle.sir import ParticleFilter
from elusive.filters.priors import GaussianPrior
from elusive.motion import ConstantVelocity
from tests.charts.shapes import CELLS, cell, near, port_fourchon, shapely_land
from tests.reference.water import water_probability

PARTICLES = 6000
STEPS = 100


class Position:
    """Positions with noise: the cheapest of sensors, so that the map's share of a step is the largest."""

    def log_likelihood(self, states, measurement):
        return -0.005 * ((states[:, 0] - measurement[0]) ** 2 + (states[:, 2] - measurement[1]) ** 2)


@functools.cache
def rival(coast):
    """Shapely's distance to the coastline and inside or outside, both prepared."""
    polygon = shapely_land(coast)
    outline = polygon.boundary
    shapely.prepare([polygon, outline])

    def both(points):
        return shapely.distance(outline, shapely.points(points)), shapely.contains_xy(polygon, *points.T)

    return both


def covered(coast, n):
    points = near(coast, 2 * n, np.random.default_rng(0))
    return points[ExactWater().bind(coast).known(points)][:n]


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize(("model", "target"), [(ExactWater(), 30), (FieldWater(), 1000)], ids=["exact", "field"])
def test_against_shapely(benchmark, best_of, report, name, model, target):
    coast = cell(name)
    water, points, shapely_both = model.bind(coast), covered(coast, PARTICLES), rival(coast)
    states = np.insert(points, 1, 0.0, axis=1)
    few = points[:300]
    mine, theirs = best_of(lambda: water.log_probability(states), lambda: shapely_both(few))
    report(
        f"{name}, {model.kind}, {PARTICLES} points, against shapely distance + contains",
        theirs / len(few) / (mine / PARTICLES),
        target,
    )
    benchmark(water.log_probability, states)


@pytest.mark.parametrize("name", CELLS)
def test_accuracy_and_memory(benchmark, report, name):
    coast = cell(name)
    exact, points = ExactWater().bind(coast), covered(coast, 100_000)
    start = time.perf_counter()
    index = ExactWater().bind(coast)
    indexed = time.perf_counter() - start
    field = benchmark.pedantic(FieldWater().bind, (coast,), rounds=1)
    few = points[:100]
    found = exact.probability(points)
    report(f"{name}, exact: 1e-7 over its error", 1e-7 / np.abs(found[:100] - water_probability(coast, few)).max(), 1)
    report(f"{name}, exact: 300 bytes a vertex over its own", 300 / (index.nbytes / len(coast.land.vertices)), 1)
    report(
        f"{name}, field: 1e-3 over its error at 100 000 points",
        1e-3 / np.abs(field.probability(points) - found).max(),
        1,
    )
    per_sigma = field.nbytes / (coast.length_m / coast.sigma_m[0])
    report(f"{name}, field: 200 bytes a deviation of coast over its own", 200 / per_sigma, 1)
    report(f"{name}, one second over the exact method's index", 1 / indexed, 1 if name == CELLS[0] else 0.1)


@pytest.mark.parametrize("name", CELLS)
def test_a_filter_along_the_coast(benchmark, best_of, report, name):
    coast = cell(name)
    field = FieldWater().bind(coast)
    start = covered(coast, 400)
    start = start[np.argmin(np.abs(field.probability(start) - 0.5))]
    free = ParticleFilter(
        motion=ConstantVelocity(q=0.1),
        sensor=Position(),
        prior=GaussianPrior(mean=(start[0], 0.0, start[1], 0.0), covariance=np.diag([100.0, 1.0, 100.0, 1.0]).tolist()),
        particles=PARTICLES,
    )
    charted = free.replace(knowledge=(field,))
    rng = np.random.default_rng(1)
    measurements = start + 10.0 * rng.standard_normal((STEPS, 2))

    def follow(model):
        *_, state = run(model, measurements, np.random.default_rng(2), start_s=-1.0)
        assert math.isfinite(state.log_evidence)

    without, within = best_of(lambda: follow(free), lambda: follow(charted), seconds=0.4)
    report(
        f"{name}, {PARTICLES} particles, {STEPS} steps: time without a map over with the field", without / within, 0.5
    )
    benchmark.pedantic(follow, (charted,), rounds=3)


def test_against_the_thesis(benchmark, best_of, report):
    """The thesis: six hours a run for the nearest edge without cells, 90 million cells of a metre for the grid."""
    coast = port_fourchon()
    points = near(coast, 200, np.random.default_rng(3))
    whole, cells, field = (model.bind(coast) for model in (NearestWater(boundary=None), NearestWater(), FieldWater()))
    a_point = [
        seconds / len(points)
        for seconds in best_of(*(functools.partial(water.probability, points) for water in (whole, cells, field)))
    ]
    report("Port Fourchon, nearest edge: its cells against every edge", a_point[0] / a_point[1], 10)
    report("Port Fourchon, field against the nearest of every edge", a_point[0] / a_point[2], 1000)
    report(
        "the thesis's six hours over this nearest edge's run without cells, 6000 x 100",
        6 * 3600 / (a_point[0] * PARTICLES * STEPS),
        1,
    )
    fine = cell(CELLS[0])
    grid, spline = GridWater().bind(fine), benchmark.pedantic(FieldWater().bind, (fine,), rounds=3)
    report(f"{CELLS[0]}, bytes of the thesis's grid over the field's", grid.nbytes / spline.nbytes, 20)
