"""How much is shown: what of a plane and its degrees, how far an axis reaches, each how-manyth of many."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike

from elusive.contracts import Array

Extent = tuple[float, float, float, float]  # least and greatest x, least and greatest y
DEGREE = 3  # of the polynomial that gives longitude and latitude: right to a metre over 100 km
BULK = 3.0  # an axis reaches so many times the 90 % quantile, where a first moment would flatten the rest


def about(places: ArrayLike, margin: float = 0.08, least: float = 1.0) -> Extent:
    """Return what shows all places ``(k, 2)``, with a margin of the longer side."""
    found = np.asarray(places, dtype=np.float64).reshape(-1, 2)
    found = found[np.isfinite(found).all(axis=1)]
    if not len(found):
        return -least, least, -least, least
    (west, south), (east, north) = found.min(axis=0), found.max(axis=0)
    room = margin * max(east - west, north - south, least)
    return float(west - room), float(east + room), float(south - room), float(north + room)


def top_of(curves: Iterable[ArrayLike]) -> float:
    """Return where an axis ends: the bulk of the values decides, for a first moment would flatten all that follows."""
    found = [np.asarray(one, dtype=np.float64).ravel() for one in curves]
    known = np.abs(np.concatenate([np.zeros(0), *found]))
    known = known[np.isfinite(known)]
    if not len(known):
        return 1.0
    return max(1e-3, 1.1 * min(float(known.max()), BULK * float(np.quantile(known, 0.9))))


def stride_of(count: int, most: int) -> int:
    """Return each how-manyth is drawn so that no more than so many are."""
    return max(1, math.ceil(count / most))


def lonlat_fit(lonlat: Callable[[Array], Array], extent: Extent) -> dict[str, object]:
    """Fit polynomials of x and y to longitude and latitude over four times what is shown."""
    west, east, south, north = extent
    x0, y0, half = 0.5 * (west + east), 0.5 * (south + north), 2.0 * max(east - west, north - south)
    u, v = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1.0, 1.0, 9)] * 2))
    degrees = lonlat(np.column_stack([x0 + half * u, y0 + half * v]))
    lon = degrees[len(u) // 2, 0] + np.mod(degrees[:, 0] - degrees[len(u) // 2, 0] + 180.0, 360.0) - 180.0
    terms = np.column_stack([u**i * v**j for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)])
    fitted, *_ = np.linalg.lstsq(terms, np.column_stack([lon, degrees[:, 1]]), rcond=None)
    ends = {"lon": fitted[:, 0].tolist(), "lat": fitted[:, 1].tolist()}
    return {"x": x0, "y": y0, "half": half, "degree": DEGREE, **ends}
