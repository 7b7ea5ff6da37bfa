"""The page of a radio network's report: the floor over time, people and events."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.report import plots
from elusive.report.page import facts, picture_url, rounded, stored, track_table, write_page
from elusive.systems.links.report.contents import Happening, LinkPath, LinksTracked, Scene

TIMES_SHOWN = 2000
POINTS_SHOWN = 40_000  # of all tracks together
EVENTS_SHOWN = 1000


def write_links_html(path: Path, tracked: LinksTracked) -> None:
    """Write a page with the floor over time, the number of people, their existence, the error, and the events."""
    points = sum(len(one.frames) for one in tracked.paths)
    stride = max(1, -(-len(tracked.times_s) // TIMES_SHOWN), -(-points // POINTS_SHOWN))
    drawn = {one.track for one in tracked.paths}
    events = [event for event in tracked.events if event.track in drawn]
    true, error = tracked.true_places, tracked.error
    data = {
        "times": rounded(tracked.times_s[::stride], 3),
        "calibrated": float(tracked.times_s[tracked.calibrated - 1]) if tracked.calibrated else None,
        "extent": tracked.extent,
        "corners": rounded(tracked.corners),
        "nodes": rounded(tracked.nodes),
        "names": list(tracked.names),
        "paths": [_path(one, tracked.times_s, stride) for one in tracked.paths],
        "people": tracked.people[::stride].tolist(),
        "truth": None if tracked.truth is None else [rounded(one.points, 3) for one in tracked.truth],
        "called": [] if tracked.truth is None else [one.name for one in tracked.truth],
        "present": None if true is None else np.isfinite(true[::stride, :, 0]).sum(axis=1).tolist(),
        "error": None if error is None else rounded(error[::stride]),
        "events": [_event(event) for event in events[-EVENTS_SHOWN:]],
        "unlisted": max(0, len(events) - EVENTS_SHOWN) + tracked.unlisted,
        "scenes": {"times": [round(one.time_s, 3) for one in tracked.scenes], **_images(tracked)},
        "clouds": [_clouds(scene, drawn) for scene in tracked.scenes],
    }
    write_page(
        path,
        "report_links.html",
        data,
        {"title": tracked.title, "verdict": tracked.verdict},
        tracks=track_table(tracked.header, tracked.tracks, {str(one) for one in drawn}, "Highlight it"),
        table=facts(tracked.rows),
        floor=stored("report_links_floor.js"),
        player=stored("report_player.css"),
        script=stored("report_links.js"),
    )


def _path(path: LinkPath, times_s: Array, stride: int) -> dict[str, object]:
    """Lay a track out by column, at the times shown and at its last."""
    shown = path.frames % stride == 0
    shown[-1:] = True
    return {
        "track": path.track,
        "colour": plots.track_colour(path.track),
        "times": rounded(times_s[path.frames[shown]], 3),
        "x": rounded(path.places[shown, 0]),
        "y": rounded(path.places[shown, 1]),
        "sx": rounded(path.deviation[shown, 0]),
        "sy": rounded(path.deviation[shown, 1]),
        "existence": rounded(path.existence[shown], 3),
        "sure": path.confirmed[shown].astype(int).tolist(),
    }


def _event(event: Happening) -> list[object]:
    return [round(event.time_s, 3), event.track, event.what, round(event.x_m, 2), round(event.y_m, 2)]


def _clouds(scene: Scene, drawn: set[int]) -> dict[str, list[int]]:
    """Lay the particles of the tracks that are drawn out, x and y in turn in whole centimetres."""
    return {
        str(track): np.round(100 * cloud).astype(int).ravel().tolist()
        for track, cloud in scene.clouds.items()
        if track in drawn
    }


def _images(tracked: LinksTracked) -> dict[str, object]:
    """Write all images as tiles of one grey PNG in a data URL, north at the top; 255 is the brightest of them."""
    kept = [scene.image for scene in tracked.scenes if scene.image is not None]
    if tracked.grid is None or not kept:
        return {"url": None}
    (rows, columns), extent = tracked.grid
    brightest = max(scene.peak for scene in tracked.scenes)
    across = max(1, min(len(kept), round(math.sqrt(len(kept) * rows / columns))))
    picture = np.zeros((-(-len(kept) // across) * rows, across * columns), dtype=np.uint8)
    tile = 0
    number: list[int | None] = []  # of each scene's tile
    for scene in tracked.scenes:
        number.append(None if scene.image is None else tile)
        if scene.image is not None:
            down, along = divmod(tile, across)
            picture[down * rows : (down + 1) * rows, along * columns : (along + 1) * columns] = _grey(
                scene.image.reshape(rows, columns)[::-1], scene.peak / brightest if brightest else 0.0
            )
            tile += 1
    return {
        "url": picture_url(picture), "tile": number, "across": across, "rows": rows, "columns": columns,
        "extent": extent, "brightest": round(brightest, 3),
    }  # fmt: skip


def _grey(image: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    return np.asarray(np.round(image * share), dtype=np.uint8)
