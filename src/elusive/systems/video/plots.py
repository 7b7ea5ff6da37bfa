"""Plots out of radar video: a threshold on the clutter map, land left out by the chart, a centroid for each blob.

Constant false-alarm rate (Finn and Johnson, 1968), the rate that of the recording's own clutter.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.charts.charted_area import lay_charts, read_charts
from elusive.contracts import Array
from elusive.io.atomic import atomic_path
from elusive.io.csv_files import write_csv
from elusive.io.radar_video import RadarVideoSource
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.parameters import PlotFinding
from elusive.systems.video.start import start_of
from elusive.systems.video.turns import Heard, heard, turns_of, water_map

MANY = 3.0  # times the peaks that are asked, about, at the evidence where they are counted
COLUMNS = ("time_s", "range_m", "bearing_deg", "extent_m", "snr_db")


class VideoPlots(NamedTuple):
    """What plots came to."""

    turns: int
    plots: int
    lonlat_deg: tuple[float, float] | None  # of the radar, as it began
    deviations: tuple[float, float]  # of a plot's range [m] and bearing [rad]


class Threshold:
    """The evidence above which clutter has as many peaks a turn as are asked.

    A cell of clutter exceeds an evidence e with probability exp(-e), and high peaks fall off alike. How many cells make
    a peak hangs on the clutter: it is counted, over all turns so far, where peaks are a few times as many as asked.

    Parameters
    ----------
    false_alarms
        Asked, a turn.
    """

    def __init__(self, false_alarms: float) -> None:
        self._asked = false_alarms
        self._turns = self._peaks = 0

    def of(self, evidence: NDArray[np.floating]) -> float:
        """Return it for one more turn's evidence, ``(A, R)``."""
        many = math.log(max(evidence.size / 2 / (MANY * self._asked), 1.0))
        top = evidence == ndimage.maximum_filter(evidence, 3, mode=("wrap", "nearest"))
        self._peaks += int(ndimage.label(top & (evidence > many), np.ones((3, 3)))[1])
        self._turns += 1
        return max(many + math.log(max(self._peaks, 1) / (self._turns * self._asked)), 0.0)


def plots_of(one: Heard, sensor: RadarVideo, threshold: Threshold, land: NDArray[np.bool_] | None) -> Array:
    """Return a turn's plots in the order of time, ``(k, 5)``, by the columns of :data:`COLUMNS`.

    Neighbouring cells above the threshold are one plot, unless ``land`` says that its middle is of land.
    """
    evidence = np.nan_to_num(one.turn.evidence)
    strong = evidence > threshold.of(evidence)
    rows = len(strong)
    labels, _ = ndimage.label(strong, np.ones((3, 3)))
    for above, below in zip(labels[-1], labels[0], strict=True):  # round the turn
        if above and below and above != below:
            labels[labels == below] = above
    row, column = np.nonzero(labels)
    blob = np.unique(labels[row, column], return_inverse=True)[1]
    count = int(blob.max()) + 1 if len(blob) else 0
    weight = evidence[row, column].astype(np.float64)
    total = np.bincount(blob, weight, count)
    azimuth = sensor.azimuth_rad[row]
    turn = np.bincount(blob, weight * np.cos(azimuth), count) + 1j * np.bincount(blob, weight * np.sin(azimuth), count)
    bearing = np.mod(np.angle(turn), 2 * math.pi)
    distance = np.bincount(blob, weight * sensor.range_m[column], count) / total
    cells = np.bincount(blob, minlength=count)
    extent = np.sqrt(cells * sensor.cell_m * sensor.grid[2] * distance)
    top = np.zeros(count)
    np.maximum.at(top, blob, weight)
    at = np.round(bearing / sensor.grid[2] - 1).astype(np.int64) % rows
    times = np.where(np.isfinite(one.turn.row_s[at]), one.turn.row_s[at], one.turn.time_s)
    kept = np.ones(count, np.bool_)
    if land is not None:
        nearest = np.clip(np.round((distance - sensor.grid[0]) / sensor.cell_m).astype(np.int64), 0, len(land[0]) - 1)
        kept = ~land[at, nearest]
    found = np.column_stack([times, distance, np.degrees(bearing), extent, 10 * np.log10(np.maximum(top, 1e-9))])
    return np.asarray(found[kept][np.argsort(times[kept], kind="stable")])


def write_video_plots(
    source: RadarVideoSource,
    parameters: PlotFinding,
    path: Path,
    *,
    radar_lon_deg: float | None = None,
    radar_lat_deg: float | None = None,
    charts: Sequence[str | Path] = (),
    on_start: Callable[[str], None] = lambda sentence: None,
    on_turn: Callable[[int], None] | None = None,
) -> VideoPlots:
    """Write the plots of a recording as CSV, which :func:`~elusive.io.open_radar_plots` reads.

    ``on_start`` is told the memory that is needed, before it is taken.

    ``snr_db`` is ten times the logarithm of the evidence: in Rayleigh clutter, of power to the clutter's mean.

    Raises
    ------
    DataError
        If the recording or a chart cannot be used, or the file cannot be written.
    ParameterError
        If the parameters do not fit the recording.
    """
    start = start_of(source, parameters, radar_lon_deg, radar_lat_deg, "chart" if charts else "")
    on_start(start.sentence)
    sensor, threshold = start.sensor, Threshold(parameters.false_alarms)
    map_at = None
    if charts and start.frame is not None:
        coast = lay_charts(read_charts(*charts), parameters.charted, start.frame).coast
        map_at = water_map(sensor, parameters.water.bind(coast).probability)
    counts: Counter[str] = Counter()
    turns = turns_of(source, start, parameters.azimuth_bias_deg, counts, moves=radar_lon_deg is None)
    water = None if map_at is None else lambda place: map_at(place) >= parameters.least_water
    done, written = 0, 0

    def lines() -> Iterator[list[float]]:
        nonlocal done, written
        latest = -math.inf
        for one in heard(turns, parameters.clutter, parameters.learning_turns, water, on_turn):
            land = None if map_at is None else map_at(one.turn.place) < parameters.least_water
            done += 1
            for plot in plots_of(one, sensor, threshold, land).tolist():
                latest = max(latest, plot[0])  # at the seam of a turn times may be a spoke apart
                written += 1
                yield [latest, *plot[1:]]

    with atomic_path(path) as temporary:
        write_csv(temporary, COLUMNS, lines())
    frame = start.frame
    place = None if frame is None else (frame.lon_deg, frame.lat_deg)
    return VideoPlots(done, written, place, sensor.deviations)
