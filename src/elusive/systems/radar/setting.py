"""What a radar's recording is tracked with: its frame, its charts, its sensor and its tracker."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from elusive.charts import HardWater, Water, WaterModel
from elusive.charts.charted_area import ChartedArea, lay_charts, read_charts
from elusive.errors import DataError, ParameterError
from elusive.geometry.local_frame import LocalFrame
from elusive.io import RadarSource
from elusive.sensors.radar import RadarSensor
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import RadarSurvey
from elusive.tracking.detections import DetectionTracker


def frame_of(
    source: RadarSource, place_deg: tuple[float, float] | None = None, needs_place: str = ""
) -> LocalFrame | None:
    """Return the frame of a recording: about a place, longitude and latitude, or about the source's own.

    Without one places are metres east and north of the radar alone; ``needs_place`` names what does not do with that.

    Raises
    ------
    ParameterError
        If there are two, or none and one is needed.
    """
    if place_deg is None:
        place_deg = source.place_deg
    elif source.place_deg not in (None, place_deg):
        raise ParameterError(f"radar_lon_deg: {source.name} was opened with another place; leave the two out.")
    if place_deg is None and needs_place:
        raise ParameterError(
            f"{needs_place}: {source.name} does not say where the radar is; give --radar-lat-deg and --radar-lon-deg, "
            "or a log of its ship."
        )
    return None if place_deg is None else LocalFrame.at(*place_deg)


def charts_in(
    parameters: RadarTracking, charts: Sequence[str | Path], frame: LocalFrame | None
) -> tuple[Surroundings, Water | None]:
    """Return the charts in a frame, and where they draw water; the frame may be None where there are none."""
    if not charts:
        parameters.check_uncharted()
        return Surroundings(frame), None
    assert frame is not None
    charted = lay_charts(read_charts(*charts), parameters.charted, frame)
    return Surroundings(frame, charted), HardWater().bind(charted.coast)


def check_place(name: str, seen: RadarSurvey, around: Surroundings) -> None:
    """Refuse a recording of which nothing falls on a chart."""
    if around.charted is None or seen.on_chart:
        return
    lon, lat = around.charted.frame
    advice = (
        "exchange the two: then it lies on a chart."
        if _exchanged(around.charted)
        else "check its place and the charts."
    )
    raise DataError(
        f"{name}: none of its {seen.plots} plots falls on a chart, seen from a radar at longitude {lon:g}, latitude "
        f"{lat:g}; {advice}"
    )


def bind_all(
    parameters: RadarTracking, seen: RadarSurvey, around: Surroundings, outline: Water | None
) -> tuple[RadarSensor, DetectionTracker, Surroundings]:
    """Return sensor and tracker of a recording that was looked through, and its surroundings with what is water."""
    sensor, charted = parameters.radar.bind(seen), around.charted
    land_plots = seen.land_plots(sensor, outline)
    coast = None if charted is None else charted.coast
    tracker = parameters.bind(sensor, coast, land_plots, seen.way[:, 1:], hulls=seen.hulls)
    assert isinstance(tracker.sensor, RadarSensor)
    return tracker.sensor, tracker, around._replace(water=_water(parameters, tracker, charted))


def _exchanged(charted: ChartedArea) -> bool:
    """Whether the radar's place lies on a chart if longitude and latitude change places."""
    lon, lat = charted.frame.lat_deg, charted.frame.lon_deg
    return any(w <= lon <= e and s <= lat <= n for w, s, e, n in (chart.extent_deg for chart in charted.charts))


def _water(parameters: RadarTracking, tracker: DetectionTracker, charted: ChartedArea | None) -> Water | None:
    """Return P(water) whatever the coast's error; None without a map."""
    if charted is None or not isinstance(parameters.knowledge, WaterModel):
        return None
    known = (member for member in tracker.knowledge if isinstance(member, Water))
    return next(known, None) or parameters.knowledge.bind(charted.coast)
