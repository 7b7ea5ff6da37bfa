"""A live run as it is drawn while it goes on: the drawing it starts from, and what each step adds to that.

What is added is a drawing's own terms: layers have a ``key``, and their arrays go on; ``static/live.js`` takes it in.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from elusive.report import drawing as draw
from elusive.report.extents import Extent, about
from elusive.report.plots import track_colour

MOST = 3000  # steps that a page holds
SITE = {"marker": "square", "size": 5, "name": "sensors"}
ROOM = 0.1  # round what is shown when it grows, of its size
AT_LEAST = {"m": 5.0, "px": 16.0}


class LiveDrawing:
    """Draws the records of a live run, as its standard output tells them.

    Parameters
    ----------
    title
        Of the run.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._sites: Mapping[str, Any] = {"names": [], "x": [], "y": []}
        self._unit = ""
        self._size: Sequence[int] | None = None  # rows and columns of what is seen, at the resolution it was taken
        self._extent: Extent | None = None
        self._status: dict[int, str] = {}
        self._slowest = 1.0  # to be seen on the axis [ms]

    def take(self, record: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield what a line of a live run comes to: a drawing at first, then what is added to it.

        Raises
        ------
        KeyError, TypeError, ValueError
            If it is no such line.
        """
        if "sites" in record:
            self._sites = record["sites"]
        if "tracks" not in record:
            return
        if not self._unit:
            self._size = record.get("seen", {}).get("size")
            pixels = self._size is not None or any("x_px" in track for track in record["tracks"])
            self._unit = "px" if pixels else "m"
            yield self._start()
        yield self._more(record)

    def _start(self) -> dict[str, Any]:
        names, places = self._sites["names"], list(zip(self._sites["x"], self._sites["y"], strict=True))
        sites = draw.points(places, "--wall", texts=[str(name) for name in names], **SITE) if places else None
        if self._size is not None:
            rows, columns = self._size
            self._extent = (-0.5, columns - 0.5, -0.5, rows - 0.5)
            more: dict[str, Any] = {"down": True, "night": True, "bare": True}
        else:
            if places:
                self._extent = about(places, 0.1, AT_LEAST[self._unit])
            more = {}
        extent = self._extent or about([], least=AT_LEAST[self._unit])
        plane = draw.plane("Tracks", extent, [sites], unit=self._unit, span=7, rows=2, **more)
        panels = [
            plane,
            draw.chart("Is it there?", [0.0], [], axis="probability", reach=(0.0, 1.02), span=5),
            draw.chart("From coming to tracked", [0.0], [], axis="time", unit="ms", reach=(0.0, 1.0), span=5),
        ]
        status = [draw.numbers("confirmed tracks", [], digits=0), draw.numbers("dropped", [], digits=0)]
        return draw.drawing(
            self._title, [], panels, status=status, off=["whole paths"], live=True, most=MOST, log=12, blocks=[]
        )

    def _more(self, record: Mapping[str, Any]) -> dict[str, Any]:
        time_s, tracks = float(record["time_s"]), [_as_shown(track) for track in record["tracks"]]
        seen = record.get("seen", {})
        layers = [*self._seen(seen, time_s), *(self._track(track, time_s) for track in tracks)]
        places = [(track[f"x_{self._unit}"], track[f"y_{self._unit}"]) for track in tracks]
        if self._size is None:
            self._widen([*places, *zip(seen.get("x", ()), seen.get("y", ()), strict=True)])
        plane: dict[str, Any] = {"layers": layers}
        if self._extent is not None:
            plane["extent"] = self._extent
        there = [track for track in tracks if isinstance(track["existence"], int | float)]
        curves = [
            draw.line(
                [time_s], [track["existence"]], track_colour(track["track"]), 4, key=track["track"],
                text=f"track {track['track']}",
            )
            for track in there
        ]  # fmt: skip
        waited = draw.line([time_s], [record["latency_ms"]], "--mark", key="latency", name="latency")
        self._slowest = max(self._slowest, 1.2 * record["latency_ms"])
        wide: dict[str, Any] = {"layers": [waited], "extent": [time_s, time_s, 0.0, self._slowest]}
        confirmed = sum(track["status"] == "confirmed" for track in tracks)
        return {
            "times": [time_s], "panels": [plane, {"layers": curves}, wide],
            "events": self._events(record, tracks, time_s), "status": [[confirmed], [record.get("dropped", 0)]],
        }  # fmt: skip

    def _seen(self, seen: Mapping[str, Any], time_s: float) -> Iterator[draw.Layer]:
        at = {"times": [time_s], "show": "now"}
        if "picture" in seen:
            rows, columns = seen["shape"]
            yield {
                "key": "frame", "type": "image", "colours": "grey", "rows": rows, "columns": columns,
                "extent": self._extent, "low": seen["low"], "high": seen["high"], "down": True, "name": "frame",
                "unit": "", "picture": seen["picture"], "times": [time_s],
            }  # fmt: skip
        if "x" in seen:
            at["times"] = [time_s] * len(seen["x"])
            yield draw.points(
                list(zip(seen["x"], seen["y"], strict=True)), "--plot", key="plots", name="plots", marker="cross",
                size=4, **at,
            )  # fmt: skip
        if "from" in seen:
            far = 2.0 * math.dist(self._extent[::2], self._extent[1::2]) if self._extent is not None else 1e4
            ends = [
                (x, y, x + far * math.sin(angle), y + far * math.cos(angle))
                for (x, y), angle in zip(seen["from"], seen["azimuth_rad"], strict=True)
            ]
            at["times"] = [time_s] * len(ends)
            yield draw.segments(ends, "--plot", key="bearings", name="bearings", width=1.2, **at)

    def _track(self, track: Mapping[str, Any], time_s: float) -> draw.Layer:
        u, number = self._unit, int(track["track"])
        layer: draw.Layer = {
            "key": f"track {number}", "type": "track", "track": number, "colour": track_colour(number), "trail": 1e9,
            "times": [time_s], "sure": [int(track["status"] == "confirmed")],
            **{axis: [track[f"{axis}_{u}"]] for axis in "xy"},
        }  # fmt: skip
        if self._size is not None:
            layer["box"] = True
        elif track.get(f"sd_x_{u}") is not None:
            layer |= {"sx": [track[f"sd_x_{u}"]], "sy": [track[f"sd_y_{u}"]]}
            layer["cxy"] = [(track.get("correlation_xy") or 0.0) * track[f"sd_x_{u}"] * track[f"sd_y_{u}"]]
        return layer

    def _widen(self, places: Sequence[tuple[float, float]]) -> None:
        """Show all places, with room beyond them so that it is not widened at each step."""
        known = [place for place in places if None not in place]
        if self._extent is not None:
            west, east, south, north = self._extent
            if all(west <= x <= east and south <= y <= north for x, y in known):
                return
            known += [(west, south), (east, north)]
        if known:
            self._extent = about(known, ROOM, AT_LEAST[self._unit])

    def _events(
        self, record: Mapping[str, Any], tracks: Sequence[Mapping[str, Any]], time_s: float
    ) -> list[list[Any]]:  # fmt: skip
        now = {int(track["track"]): str(track["status"]) for track in tracks}
        found: list[list[Any]] = []
        if record.get("gap_s"):
            words = "gone on from the checkpoint" if record.get("resumed") else "nothing came"
            found.append([time_s, f"{words}, {record['gap_s']:g} s after the last", None])
        for number, status in now.items():
            if status == "confirmed" and self._status.get(number) != "confirmed":
                found.append([time_s, "confirmed", number])
        ended = [n for n, was in self._status.items() if was == "confirmed" and now.get(n, "deleted") == "deleted"]
        found += [[time_s, "ended", number] for number in ended]
        self._status = {number: status for number, status in now.items() if status != "deleted"}
        return found


def _as_shown(track: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a track as a candidate where its system follows it and does not show it."""
    return {**track, "status": "candidate"} if track["status"] == "confirmed" and track.get("shown") == 0 else track
