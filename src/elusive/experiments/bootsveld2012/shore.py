"""The shoreline of Bootsveld (2012), chapter 6: a real one from a file, or a seeded synthetic delta.

The thesis takes the cell US5LA26M, Port Fourchon and approaches, which is not to be had any more. The synthetic delta
is the zero contour of Gaussian noise of several scales on a slope: land in the north, sea in the south, islands and
creeks between.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

from elusive.errors import DataError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

WIDTH_M, HEIGHT_M = 10_000.0, 9_000.0  # of the thesis's map
PORT_FOURCHON = (-90.2, 29.13)  # longitude and latitude of the map's middle [degrees]
SPACING_M = 20.0  # of the noise that makes the synthetic delta
SCALES_M = (800.0, 400.0, 200.0, 100.0, 50.0)  # deviations of the kernels that smooth it
ROUGHNESS = 0.4  # the amplitude of a scale grows with this power of it
SLOPE = 0.2  # of the mean from south to north, in deviations of the noise a kilometre


@cache
def shoreline(path: Path | None, seed: int) -> Sequence[BaseGeometry]:
    """Return the land of the map as polygons in metres about the map's middle.

    Parameters
    ----------
    path
        GeoJSON or shapefile of land polygons, cut to 10 by 9 km: round Port Fourchon if the file reaches there, else
        round the middle of what it covers. None draws the synthetic delta.
    seed
        Of the synthetic delta.

    Raises
    ------
    DataError
        If the file cannot be read, or shows no land there.
    """
    import shapely

    from elusive.charts.chart import as_geometries, polygons_of

    window = shapely.box(-WIDTH_M / 2, -HEIGHT_M / 2, WIDTH_M / 2, HEIGHT_M / 2)
    if path is None:
        return polygons_of(synthetic_delta(seed))
    from elusive.charts.outlines import read_outline
    from elusive.geometry.local_frame import LocalFrame

    chart = read_outline(path)
    west, south, east, north = chart.extent_deg
    at_port = west < PORT_FOURCHON[0] < east and south < PORT_FOURCHON[1] < north
    frame = LocalFrame.at(*PORT_FOURCHON) if at_port else LocalFrame.about([chart])
    near = shapely.intersects(frame.unproject(as_geometries([window]))[0], chart.land)
    land = polygons_of(shapely.intersection(shapely.union_all(frame.project(chart.land[near])), window))
    if not land:
        raise DataError(f"{path}: shows no land near {frame.lat_deg:g}, {frame.lon_deg:g}; give another shoreline.")
    return land


def synthetic_delta(seed: int) -> BaseGeometry:
    """Draw land with islands, lakes and creeks, in metres about the map's middle."""
    import shapely
    from contourpy import FillType, contour_generator

    rng = np.random.default_rng(seed)
    x, y = (np.arange(-size / 2, size / 2 + 1, SPACING_M) for size in (WIDTH_M, HEIGHT_M))
    height = np.zeros((len(y), len(x)))
    for scale in SCALES_M:
        octave = gaussian_filter(rng.standard_normal(height.shape), scale / SPACING_M)
        height += (scale / SCALES_M[0]) ** ROUGHNESS * octave / octave.std()
    height = height / height.std() + SLOPE * y[:, None] / 1000
    filled = contour_generator(x, y, height, fill_type=FillType.OuterOffset).filled(0.0, np.inf)
    polygons = []
    for points, offsets in zip(*filled, strict=True):
        rings = [points[a:b] for a, b in pairwise(offsets)]
        polygons.append(shapely.Polygon(rings[0], rings[1:]))
    return shapely.union_all(polygons)
