"""GeoJSON (RFC 7946) read: the geometries of one kind in features and collections, with their properties."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from elusive.errors import DataError
from elusive.io._opened import readable

GEOJSON = (".geojson", ".json")


def geometries(path: Path, kind: str, otherwise: str) -> list[tuple[Any, dict[str, Any]]]:
    """Return coordinates and properties of each geometry of a kind; a feature's ``id`` is one of them.

    Raises
    ------
    DataError
        If the file cannot be read or is no JSON; ``otherwise`` says what else it may be.
    """
    with readable(path):
        octets = path.read_bytes()
    try:
        found = json.loads(octets.decode())
    except (ValueError, RecursionError):
        raise DataError(f"{path}: is no GeoJSON; write a {kind}, or {otherwise}.") from None
    return list(_of(found, kind, {}))


def _of(found: Any, kind: str, properties: dict[str, Any]) -> Iterator[tuple[Any, dict[str, Any]]]:
    if not isinstance(found, dict):
        return
    if found.get("type") == kind and isinstance(found.get("coordinates"), list):
        yield found["coordinates"], properties
    elif found.get("type") == "Feature":
        own = found.get("properties")
        named = {"id": found["id"]} if "id" in found else {}
        yield from _of(found.get("geometry"), kind, named | (own if isinstance(own, dict) else {}))
    elif found.get("type") == "FeatureCollection" and isinstance(found.get("features"), list):
        for feature in found["features"]:
            yield from _of(feature, kind, {})
