"""What one tab holds of charts: the chart, the scene, the plots, the run, and what of the map is in view."""

from __future__ import annotations

import tempfile
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.charts.chart import Chart
from elusive.charts.charted_area import read_charts
from elusive.geometry.local_frame import LocalFrame
from elusive.report.drawing import Layer
from elusive.report.extents import Extent
from elusive.systems.radar.scene import EXAMPLE_NAME, RadarScene, example_chart
from elusive.systems.radar.scene_run import ChartFile, Recorded, Sailed
from elusive.workbench.files import PLAIN
from elusive.workbench.opener import read_named
from elusive.workbench.side_by_side import TrackedState

KINDS = (".000", ".geojson", ".json")


class OpenedChart(NamedTuple):
    """A chart and what it says."""

    file: ChartFile
    charts: tuple[Chart, ...]


def opened(path: Path) -> OpenedChart:
    """Read a chart whole, so that the file is not needed any more.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    charts = read_charts(path)
    return OpenedChart(ChartFile(path.name, path.read_bytes()), charts)


def example() -> OpenedChart:
    """Return the ready example's chart."""
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / EXAMPLE_NAME
        path.write_bytes(example_chart())
        return opened(path)


class ChartsState(TrackedState[RadarScene, Sailed]):
    """Changes of the scene throw away plots that no longer follow from it; a run stays, with its scene."""

    def __init__(self) -> None:
        super().__init__(RadarScene.example())
        self.chart: OpenedChart | None = None
        self.recorded: Recorded | None = None
        self.raster: tuple[Any, Layer] | None = None  # what it is of, and what a map draws
        self.view: Extent | None = None  # None: all of a map
        self.shows_water = False

    def open(self, name: str, chart: OpenedChart, scene: RadarScene | None = None) -> None:
        """Take another chart; a route drawn on the last one is gone with it.

        One that states its quality is taken at its word, until a deviation of the coast is given.
        """
        self.chart = chart._replace(file=chart.file._replace(name=name if PLAIN.fullmatch(name) else chart.file.name))
        self.__dict__.pop("frame", None)
        self.view = None
        if scene is None:
            x0, x1, y0, y1 = self.chart_extent
            lon, lat = self.frame.to_lonlat(np.array([[0.5 * (x0 + x1), 0.5 * (y0 + y1)]]))[0]
            radar = self.scene.radar.replace(lon_deg=round(float(lon), 6), lat_deg=round(float(lat), 6))
            tracking = self.scene.tracking
            if any(len(one.zones) for one in chart.charts):
                stated = tracking.charted.imprecision.replace(coast_sigma_m=None)
                tracking = tracking.replace(charted=tracking.charted.replace(imprecision=stated))
            scene = self.scene.replace(routes_deg=(), radar=radar, tracking=tracking)
        self.scene = scene
        self.recorded = None
        self.forget_run()

    def open_scene(self, path: Path) -> None:
        """Take a scene from its file, and the chart beside it.

        Raises
        ------
        DataError
            If the scene or its chart cannot be read, or the chart lies elsewhere.
        """
        scene = RadarScene.from_yaml(path)
        if scene.chart:
            self.open(scene.chart, read_named(path.parent, scene.chart, KINDS, opened), scene)
        else:
            self.open(EXAMPLE_NAME, example(), scene)

    @cached_property
    def frame(self) -> LocalFrame:
        """Frame of the maps, about the middle of the chart."""
        assert self.chart is not None
        return LocalFrame.about(self.chart.charts)

    @property
    def chart_extent(self) -> Extent:
        """What the chart covers, x and y [m]."""
        import shapely

        assert self.chart is not None
        places = np.concatenate(
            [shapely.get_coordinates(self.frame.project(one.coverage)) for one in self.chart.charts]
        )
        (west, south), (east, north) = places.min(axis=0), places.max(axis=0)
        return float(west), float(east), float(south), float(north)

    def take(self, scene: RadarScene) -> RadarScene:
        """Take a changed scene; return it as it is kept."""
        before = self.scene
        scene = scene.with_radar_followed(before)
        here, there = ((one.simulation, one.radar, one.routes_deg) for one in (scene, before))
        if here != there:
            self.recorded = None
        return super().take(scene)
