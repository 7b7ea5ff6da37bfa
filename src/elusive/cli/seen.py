"""What a live measurement looks like, for a page that draws it as it comes: pixels, plots, bearings."""

from __future__ import annotations

import base64
import math
import time
from typing import Any, Protocol

import numpy as np

from elusive.contracts import Array

SIDE_PX = 320  # of a picture, at most
EVERY_S = 1.0 / 40.0  # between two pictures, at least
DARK, BRIGHT = 0.5, 99.8  # percentiles of its pixels that are its ends


class Sites(Protocol):
    """Where sensors stand."""

    @property
    def names(self) -> tuple[str, ...]:
        """What they are called."""
        ...

    @property
    def positions_m(self) -> Array:
        """``(n, 2)`` or more, east and north first."""
        ...


class Seeing:
    """Tells what was measured, beside each step's record.

    Parameters
    ----------
    sites
        Where the sensors stand, of systems that have several.
    """

    def __init__(self, sites: Sites | None) -> None:
        self._sites = sites
        self._latest_s = -math.inf

    @property
    def first(self) -> dict[str, Any]:
        """What is told before the first step."""
        if self._sites is None:
            return {"sites": {"names": [], "x": [], "y": []}}
        x, y = np.asarray(self._sites.positions_m, dtype=np.float64)[:, :2].T
        return {"sites": {"names": [str(name) for name in self._sites.names], "x": x.tolist(), "y": y.tolist()}}

    def __call__(self, measurement: Any) -> dict[str, Any]:
        """Return what a page draws of a measurement: nothing of one it knows no picture of."""
        if isinstance(measurement, np.ndarray):
            return self._pixels(measurement) if measurement.ndim == 2 else {}
        if hasattr(measurement, "bearing_rad"):
            x = measurement.own.x_m + measurement.range_m * np.sin(measurement.bearing_rad)
            y = measurement.own.y_m + measurement.range_m * np.cos(measurement.bearing_rad)
            return {"x": np.round(x, 2).tolist(), "y": np.round(y, 2).tolist()}
        angles = getattr(measurement, "bearings", measurement)
        if hasattr(angles, "azimuth_rad") and self._sites is not None:
            moving = getattr(angles, "places_m", None)
            places = self._sites.positions_m[angles.sensor] if moving is None else moving
            return {
                "from": np.round(places[:, :2], 2).tolist(),
                "azimuth_rad": np.round(angles.azimuth_rad, 5).tolist(),
            }
        return {}

    def _pixels(self, pixels: Array) -> dict[str, Any]:
        if time.monotonic() - self._latest_s < EVERY_S:
            return {"size": list(pixels.shape)}
        self._latest_s = time.monotonic()
        step = max(1, math.ceil(max(pixels.shape) / SIDE_PX))
        small = np.asarray(pixels[::step, ::step], dtype=np.float32)
        known = small[np.isfinite(small)]
        low, high = np.percentile(known[:: max(1, known.size // 4096)], (DARK, BRIGHT)) if known.size else (0.0, 1.0)
        share = np.nan_to_num((small - low) / max(high - low, 1e-9), nan=0.0)
        octets = (255.0 * np.clip(share, 0.0, 1.0)).astype(np.uint8)
        return {
            "size": list(pixels.shape), "shape": list(octets.shape), "low": float(low), "high": float(high),
            "picture": base64.b64encode(octets.tobytes()).decode("ascii"),
        }  # fmt: skip
