"""A scene of ships near a coast: routes, a radar, and what the tracker takes the chart to say; the page's example."""

from __future__ import annotations

import json
from typing import Any, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from elusive.charts import WATER_MODELS, HardWater
from elusive.charts.charted_area import ChartedAreaParameters
from elusive.charts.delta import synthetic_delta
from elusive.charts.quality import Imprecision
from elusive.errors import DataError, ParameterError
from elusive.filters.particle.coast_error import CoastError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.routes import Route
from elusive.model import Model
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.parameters import NoMap, RadarTracking, UnderWay
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.simulate import MID_OCEAN_DEG, RadarSimulation
from elusive.systems.radar.voyage import Voyage, voyage

Method = Literal["none", "hard", "nearest", "grid", "exact", "field"]
METHODS: tuple[Method, ...] = get_args(Method)
SCANS_MOST = 2000
EXAMPLE_NAME = "synthetic-delta.geojson"
EXAMPLE_SEED = 2012
RADAR_M = (1500.0, -4800.0)  # about the middle of the delta
AROUND_M = 600.0  # of the delta, round the route
# a way along the delta's shore, through its narrows, in metres about the delta's middle
WAY_M = (
    (1699, 478), (1715, 463), (1734, 439), (1748, 405), (1749, 365), (1739, 327), (1721, 295), (1703, 269), (1686, 245),
    (1676, 221), (1676, 194), (1680, 164), (1677, 133), (1659, 104), (1630, 87), (1597, 82), (1565, 88), (1535, 96),
    (1507, 94), (1481, 83), (1455, 69), (1428, 57), (1399, 54), (1371, 63), (1349, 83), (1330, 107), (1310, 127),
    (1285, 134), (1262, 124), (1248, 102), (1248, 76), (1262, 52), (1283, 30), (1299, 7), (1307, -21), (1308, -51),
    (1311, -81),
)  # fmt: skip


def example_chart() -> bytes:
    """Return the ready example's coast as GeoJSON: the synthetic delta of the thesis's reproduction, round the route.

    Bootsveld (2012), chapter 6, whose cell is not to be had any more.
    """
    import shapely

    frame, way = LocalFrame.at(*MID_OCEAN_DEG), np.array(WAY_M, np.float64)
    window = shapely.box(*(way.min(axis=0) - AROUND_M), *(way.max(axis=0) + AROUND_M))
    land = shapely.intersection(synthetic_delta(EXAMPLE_SEED), window)
    west, south = frame.to_lonlat(way.min(axis=0) - AROUND_M)[0].tolist()
    east, north = frame.to_lonlat(way.max(axis=0) + AROUND_M)[0].tolist()
    features = [
        {"type": "Feature", "properties": {}, "geometry": json.loads(shapely.to_geojson(part))}
        for part in shapely.transform(shapely.get_parts(land), frame.to_lonlat)
        if part.geom_type == "Polygon"
    ]
    collection = {"type": "FeatureCollection", "bbox": [west, south, east, north], "features": features}
    return json.dumps(collection).encode()


def _example_degrees(places: Any) -> tuple[tuple[float, float], ...]:
    found = LocalFrame.at(*MID_OCEAN_DEG).to_lonlat(np.array(places, np.float64).reshape(-1, 2))
    return tuple(map(tuple, np.round(found, 7).tolist()))


class Place(Model):
    """Where the radar stands."""

    lon_deg: float = Field(0.0, ge=-180, le=180, description="Longitude, WGS 84 [deg]")
    lat_deg: float = Field(0.0, ge=-90, le=90, description="Latitude, WGS 84 [deg]")

    @property
    def named(self) -> dict[str, Any]:
        """Longitude and latitude, as simulation and tracking call them."""
        return {"radar_lon_deg": self.lon_deg, "radar_lat_deg": self.lat_deg}


class RadarScene(Model):
    """Ships' routes past a coast, the radar that sees them, and the uses of the chart that they are tracked with."""

    system: Literal["radar"] = Field("radar", description="What kind of scene this is")
    chart: str = Field("", description="File of the chart, beside the scene's own; none: a synthetic delta")
    routes_deg: tuple[tuple[tuple[float, float], ...], ...] = Field(
        (), description="Waypoints of each ship, longitude and latitude [deg]"
    )
    radar: Place = Field(Place(), description="Where the radar stands")
    simulation: RadarSimulation = Field(RadarSimulation(), description="The voyage, and what the radar sees")
    tracking: RadarTracking = Field(RadarTracking(), description="How it is tracked")
    methods: tuple[Method, ...] = Field(METHODS, description="Uses of the chart, side by side")

    @classmethod
    def example(cls) -> Self:
        """Return the ready example's."""
        lon, lat = _example_degrees(RADAR_M)[0]
        seen = {"range_sd_m": 10.0, "bearing_sd_mrad": 4.0, "detection_probability": 0.95}
        return cls(
            routes_deg=(_example_degrees(WAY_M),),
            radar=Place(lon_deg=lon, lat_deg=lat),
            simulation=RadarSimulation(speed_mps=10.0, seed=3, radar=RadarSensor(**seen)),
            tracking=RadarTracking(
                charted=ChartedAreaParameters(imprecision=Imprecision(coast_sigma_m=5.0)),
                radar=RecordedRadar(**seen, false_alarms=1.0),
                motion=UnderWay(q=(5 / 3) ** 2),
            ),
        )

    @model_validator(mode="after")
    def _few_scans(self) -> Self:
        for route in self.routes_deg:
            corners = LocalFrame.at(*route[0]).to_local(np.array(route)) if route else np.zeros((0, 2))
            scans = np.hypot(*np.diff(corners, axis=0).T).sum() / self.simulation.speed_mps / self.simulation.interval_s
            if scans > SCANS_MOST:
                raise ParameterError(
                    f"RadarSimulation.interval_s: the route takes {scans:.0f} scans, more than {SCANS_MOST} of a "
                    "scene; give a longer interval, a greater speed or a shorter route."
                )
        return self

    def with_radar_followed(self, before: RadarScene) -> RadarScene:
        """Return it with the tracker's radar following the simulated one in what the two agreed on before."""
        simulated, assumed = self.simulation.radar, {}
        for name in type(simulated).model_fields:
            old = getattr(before.simulation.radar, name)
            new = getattr(simulated, name)
            if new != old and getattr(before.tracking.radar, name, None) == old:
                assumed[name] = new
        if not assumed:
            return self
        return self.replace(tracking=self.tracking.replace(radar=self.tracking.radar.replace(**assumed)))

    def routes(self) -> list[Route]:
        """Return the routes as a reader gives them.

        Raises
        ------
        DataError
            If there is none, or it has a single waypoint.
        """
        if not self.routes_deg or any(len(route) < 2 for route in self.routes_deg):
            raise DataError("routes_deg: has no route of two waypoints or more; draw or write a route.")
        return [Route(np.array(route, np.float64), np.full(len(route), np.nan)) for route in self.routes_deg]

    def tracking_by(self, method: str) -> RadarTracking:
        """Return the parameters of tracking with a use of the chart."""
        if method == "none":  # nothing of the coast's error takes effect
            return self.tracking.replace(knowledge=NoMap(), coast=CoastError())
        if method == "hard":
            return self.tracking.replace(knowledge=HardWater(), coast=CoastError(coast_error="fresh"))
        return self.tracking.replace(knowledge=WATER_MODELS[method]())

    def voyage(self) -> Voyage:
        """Return where the ships are at each scan, in the radar's frame.

        Raises
        ------
        DataError
            If a route is too short or leads too far away.
        """
        return voyage(self.routes(), self.frame, self.simulation)

    @property
    def frame(self) -> LocalFrame:
        """The radar's frame."""
        return LocalFrame.at(self.radar.lon_deg, self.radar.lat_deg)
