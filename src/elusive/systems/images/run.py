"""A recording of frames tracked from end to end: its tables, its report, the configuration that repeats it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from elusive.contracts import Array
from elusive.io import FrameSource, atomic_folder
from elusive.results import known_truth, write_mot_csv, write_result
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.report import FrameKeeper, Tracked, write_html, write_png
from elusive.systems.images.results import ImageLog, tracked_of
from elusive.systems.images.track import track_images
from elusive.tracking import Step

FILES = ("tracks.csv", "tracks_mot.csv", "result.nc", "report.html", "report.png", "config.yaml")


class Outcome(NamedTuple):
    """What a tracked recording came to."""

    log: ImageLog
    tracked: Tracked


def follow(source: FrameSource, parameters: ImageTracking) -> Iterator[Step]:
    """Track through a source's frames at their times."""
    bound = parameters.bind(source.shape, source.interval_s)
    yield from track_images(source, bound, source.times_s())


def track_recording(
    source: FrameSource,
    parameters: ImageTracking,
    out: Path,
    *,
    truth: Array | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> Outcome:
    """Track a recording and write FILES.

    ``config.yaml`` repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_frames`.
    parameters
        What to do; the sensor takes its size from the source, and time its unit.
    out
        Folder for the results.
    truth
        ``(T, targets, 2)`` x, y in pixels of each frame of the file, NaN where a target is absent; scores only.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth has fewer rows than there are frames.
    """
    bound = parameters.bind(source.shape, source.interval_s)
    keeper, config = FrameKeeper(), bound.to_yaml()
    with atomic_folder(out) as folder:
        with ImageLog(bound, folder / "tracks.csv") as log:
            for number, step in enumerate(follow(source, bound)):
                log.take(step)
                keeper.offer(number, step.measurement)
                if on_frame is not None:
                    on_frame(number + 1)
        known = known_truth(truth, source.start, len(log.steps))
        tracked = tracked_of(source.name, log, source.shape, timed=source.timed, truth=known)
        write_mot_csv(folder / "tracks_mot.csv", log, sigma_px=bound.spread_px, first_frame=source.start)
        write_result(folder / "result.nc", log, title=source.name, config=config)
        (folder / "config.yaml").write_text(config, encoding="utf-8")
        write_png(folder / "report.png", tracked, keeper)
        write_html(folder / "report.html", tracked, keeper)
    return Outcome(log, tracked)
