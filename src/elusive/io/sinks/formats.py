"""Lines of steps: NDJSON, GeoJSON (RFC 7946) and MOTChallenge."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from typing import Any

from elusive.io.sinks.seen import Seen, Told


def json_line(record: Mapping[str, Any]) -> str:
    """Write a record as a line; JSON has no infinities, and null stands for them."""
    try:
        return json.dumps(record, separators=(",", ":"), allow_nan=False)
    except ValueError:
        return json.dumps(_finite(record), separators=(",", ":"), allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def ndjson(told: Told) -> Iterator[bytes]:
    """Yield a step's record, with the tracks that ended and each one's age."""
    ages = {seen.track: round(seen.age_s, 6) for seen in told.seen}
    tracks = [{**track, "age_s": ages.get(track["track"])} for track in told.record.get("tracks", ())]
    ended = [seen.track for seen in told.ended]
    if told.record or ended:
        yield (json_line({**told.record, "tracks": tracks, "ended": ended}) + "\n").encode()


def geojson(told: Told) -> Iterator[bytes]:
    """Yield a step as a collection of points; a track that ended is there once, its status ``deleted``."""
    features = [_feature(seen, seen.status, told) for seen in told.seen]
    features += [_feature(seen, "deleted", told) for seen in told.ended]
    if told.record or features:
        time_s = told.record.get("time_s")
        whole = {"type": "FeatureCollection", "time_s": time_s, "unix_s": told.unix_s, "features": features}
        yield (json_line(whole) + "\n").encode()


def _feature(seen: Seen, status: str, told: Told) -> dict[str, Any]:
    properties = {
        "track": seen.track,
        "status": status,
        "existence": seen.existence,
        "age_s": round(seen.age_s, 6),
        "sd_m": seen.sd,
        "speed_mps": seen.speed_mps,
        "course_deg": seen.course_deg,
    }
    point = {"type": "Point", "coordinates": [round(seen.lon_deg, 8), round(seen.lat_deg, 8)]}
    return {"type": "Feature", "id": seen.track, "geometry": point, "properties": properties}


class Mot:
    """MOTChallenge lines, a step a frame, from 1; pixels count from 1 there."""

    def __init__(self, half_px: float) -> None:
        self._half_px = half_px
        self.state = 0
        """Frames written."""

    def __call__(self, told: Told) -> Iterator[bytes]:
        """Yield a step's lines."""
        self.state += 1
        for seen in sorted(told.seen, key=lambda seen: seen.track):
            corner, side = 1 - self._half_px, 2 * self._half_px
            sure = 1.0 if math.isnan(seen.existence) else seen.existence
            cells = (self.state, seen.track, seen.x + corner, seen.y + corner, side, side, sure, -1, -1, -1)
            yield (",".join(map(repr, cells)) + "\n").encode()
