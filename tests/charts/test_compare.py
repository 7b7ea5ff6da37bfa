"""Where charts disagree, against strips whose width is known, and on the real pair."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.compare import disagreements
from elusive.geometry.local_frame import LocalFrame

from .scenes import FRAME, drawn, real_cell

SEA = shapely.box(-3000, -3000, 3000, 3000)
WEST = shapely.box(-3000, -3000, 0, 3000)


def compare(land, other, sigma=10.0, **coverage):
    """Compare two charts of one imprecision."""
    charts = [
        drawn("fine", land, coverage.get("fine", SEA), 12_000),
        drawn("coarse", other, coverage.get("coarse", SEA), 80_000),
    ]
    return disagreements(charts, FRAME, ChartedAreaParameters(imprecision={"coast_sigma_m": sigma}))


@pytest.mark.parametrize("offset", [0.0, 20.0, 27.0, 28.5, 35.0, 50.0])
def test_a_coast_moved_by_more_than_the_imprecision(offset):
    """Of a strip of width d, what lies further than t from one of the two coasts is 2 (d - t) wide, t < d < 2t."""
    allowed = 1.96 * np.hypot(10, 10)  # 27.7 m
    (found,) = compare([WEST], [shapely.box(-3000, -3000, offset, 3000)])
    expected = 6000 * 2 * max(offset - allowed, 0.0)
    assert found.area_m2 == pytest.approx(expected, abs=6000 * 0.02 * allowed)
    assert (len(found.regions) > 0) == (offset > allowed)
    assert found.overlap_m2 == pytest.approx(36e6, rel=1e-5)
    assert ("agree within" in found.sentence) == (offset <= allowed)


def test_distances_along_the_finer_coast():
    (found,) = compare([shapely.box(-1000, -1000, 0, 1000)], [shapely.box(-1000, -1000, 40, 1000)])
    # a third of the outline is moved, the rest coincides
    assert found.median_m == pytest.approx(0.0, abs=0.02)
    assert found.percentile_95_m == pytest.approx(40, rel=1e-3)
    assert found.coast_share == pytest.approx(0.333, abs=0.01)


def test_a_pier_and_a_creek_that_one_chart_lacks():
    pier = shapely.box(0, 0, 300, 5)
    creek = shapely.box(-400, 1000, 0, 1010)
    (found,) = compare([WEST, pier], [shapely.difference(WEST, creek)])
    kinds = [shapely.intersection(shapely.union_all(found.regions), one).area for one in (pier, creek)]
    allowed = 1.96 * np.hypot(10, 10)
    assert kinds == pytest.approx([5 * (300 - allowed), 10 * (400 - allowed)], rel=0.02)
    assert found.area_m2 == pytest.approx(sum(kinds))


def test_only_what_both_cover_is_compared():
    (found,) = compare([WEST], [], fine=shapely.box(-3000, 0, 3000, 3000), coarse=shapely.box(-3000, -3000, 3000, 1000))
    assert found.overlap_m2 == pytest.approx(6e6, rel=1e-5)
    assert found.area_m2 <= 3e6 * 1.0001
    assert not compare([WEST], [WEST], fine=shapely.box(-3000, 0, 0, 10), coarse=shapely.box(0, 0, 3000, 10))


def test_a_chart_agrees_with_itself():
    (found,) = compare([WEST], [WEST], sigma=0.1)
    assert (found.area_m2, found.coast_share, found.percentile_95_m) == (0, 0, pytest.approx(0, abs=1e-6))


@pytest.mark.validate
def test_the_real_pair():
    charts = [real_cell("US5MD1MC"), real_cell("US4MD81M")]
    frame = LocalFrame.about(charts)
    (found,) = disagreements(charts, frame, ChartedAreaParameters(imprecision={"coast_sigma_m": 8.2}))
    assert (found.finer, found.coarser) == ("US5MD1MC", "US4MD81M")
    assert found.median_m == pytest.approx(4, abs=0.3)
    assert found.percentile_95_m == pytest.approx(40, abs=3)
    assert 0.05 < found.coast_share < 0.2
    assert found.overlap_m2 == pytest.approx(54.1e6, rel=0.01)
    assert 0 < found.area_m2 < 0.01 * found.overlap_m2
    land = [shapely.union_all(frame.project(chart.land)) for chart in charts]
    places = shapely.point_on_surface(found.regions[shapely.area(found.regions) > 100])
    first, second = (shapely.intersects(one, places) for one in land)
    assert len(places) > 20
    assert (first != second).mean() > 0.95  # the rest: islets, drawn with a width
