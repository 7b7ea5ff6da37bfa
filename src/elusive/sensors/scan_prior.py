"""Where a ship may be before a particle filter's first measurement: about the plots of an earlier scan.

After births drawn from measurements: Ristic, Clark, Vo and Vo (2012), IEEE Trans. Aerosp. Electron. Syst. 48(2), 1656.
"""

from __future__ import annotations

from typing import NamedTuple

from numpy.random import Generator

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.sensors.radar_scans import RadarScan
from elusive.sensors.radar_view import RadarView


class ScanPrior(NamedTuple):
    """The belief before a filter's first measurement, drawn from an earlier scan: a particle filter's prior."""

    radar: RadarView
    scan: RadarScan
    speed_sd_mps: float = 5.0

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states at the scan's time, ``(n, 4)``, each of a plot in view taken at random.

        See :meth:`RadarView.draw_from_plots`.

        Raises
        ------
        DataError
            If a plot is no measurement, or none lies in the field of view.
        """
        scan = self.radar.detections_in_view(self.scan)
        if not scan.detections:
            raise DataError(f"scan at {scan.time_s:g} s: has no plot in the field of view; draw from one that has.")
        return self.radar.draw_from_plots(scan, rng.integers(scan.detections, size=n), rng, self.speed_sd_mps)
