"""An emitter's place and its error ellipse as GeoJSON: geographic where an origin is known, else in local metres."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping

from elusive.contracts import Array
from elusive.io.atomic import atomic_path

LOCAL = "local metres: x east, y north"


def write_emitter_geojson(
    path: str | os.PathLike[str],
    place: Array,
    outline: Array | None,
    properties: Mapping[str, float | str | None],
    *,
    geographic: bool,
) -> None:
    """Write a Point and, where the ellipse is told, a Polygon.

    Parameters
    ----------
    path
        File to write.
    place
        ``(2,)``: longitude and latitude in degrees, WGS 84, or east and north in metres.
    outline
        The ellipse, ``(V, 2)`` in the same coordinates, counterclockwise; None where it is not told.
    properties
        Of the point.
    geographic
        Whether coordinates are longitude and latitude, as RFC 7946 has it. Otherwise a member ``coordinate_system``
        says that they are local metres: other programs would take them for degrees.
    """
    features = [_feature("Point", [float(each) for each in place], {"what": "emitter", **properties})]
    if outline is not None:
        ring = [[float(x), float(y)] for x, y in outline]
        features.append(_feature("Polygon", [[*ring, ring[0]]], {"what": "error ellipse"}))
    collection: dict[str, object] = {"type": "FeatureCollection"}
    if not geographic:
        collection["coordinate_system"] = LOCAL
    collection["features"] = features
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(collection, allow_nan=False) + "\n", encoding="utf-8", newline="\n")


def _feature(kind: str, coordinates: object, properties: Mapping[str, float | str | None]) -> dict[str, object]:
    return {
        "type": "Feature",
        "geometry": {"type": kind, "coordinates": coordinates},
        "properties": dict(properties),
    }
