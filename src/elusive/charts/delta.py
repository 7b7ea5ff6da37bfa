"""A seeded synthetic river delta: a shore to try things on where no chart is at hand.

The zero contour of Gaussian noise of several scales on a slope: land in the north, sea in the south, islands and
creeks between.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

WIDTH_M, HEIGHT_M = 10_000.0, 9_000.0
SPACING_M = 20.0  # of the noise
SCALES_M = (800.0, 400.0, 200.0, 100.0, 50.0)  # deviations of the kernels that smooth it
ROUGHNESS = 0.4  # the amplitude of a scale grows with this power of it
SLOPE = 0.2  # of the mean from south to north, in deviations of the noise a kilometre


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
