"""A recording of bearings tracked as a whole, or live: each time as it comes, at constant memory."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from elusive.errors import DataError
from elusive.io import atomic_folder, existing_folder
from elusive.io.bearings import BearingSource
from elusive.io.truth import Truth
from elusive.results import TrackLog
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.results import BearingOutcome, outcome_of, write_outcome
from elusive.systems.bearings.several import crowding_of, decided, fitted
from elusive.systems.bearings.several_results import names_of, several_outcome
from elusive.systems.bearings.track import track, track_labelled
from elusive.tracking.track import Step

ONE_OF_MANY = (
    "bearings of a sensor lie apart, and are averaged as of one emitter. Do not rely on the track; --emitters several "
    "follows more than one."
)


class LiveFix(NamedTuple):
    """A time that has been tracked and written."""

    step: Step
    latency_s: float  # from the time's last line to its row in the file
    remarks: tuple[str, ...]  # that are new


def track_bearings_recording(
    source: BearingSource,
    parameters: BearingTracking,
    out: Path | None,
    *,
    truth: Truth | None = None,
    cutoff_m: float | None = None,
    on_time: Callable[[int], None] | None = None,
) -> BearingOutcome[Any]:
    """Track emitters through a recording and write ``tracks.csv``, ``result.nc`` and the report.

    The report is ``report.html`` and ``report.png``; ``config.yaml`` repeats the run. Nothing is left in ``out`` if
    the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`~elusive.io.bearings.open_bearings`.
    parameters
        What to do.
    out
        Folder for the results; None writes nothing.
    truth
        Where emitters truly were; scores only.
    cutoff_m
        Distance up to which a track can stand for an emitter, and c of GOSPA; None: a tenth of the widest
        distance between sensors.
    on_time
        Called with the number of times read.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If a line cannot be used.
    """
    parameters.check(live=False)
    by_label = dict[str, list[PlaceSet]]()
    with warnings_heard() as said:
        for count, (label, measurement) in enumerate(source.labelled(), start=1):
            by_label.setdefault(label, []).append(measurement)
            if on_time is not None:
                on_time(count)
    heard, sites = [measurement for measurements in by_label.values() for measurement in measurements], source.sites
    labels = {number: label for number, label in enumerate(by_label, start=1) if label}
    parameters, why = decided(parameters, heard, labelled=bool(labels))
    emitters, elevated = parameters.emitters, have_elevations(heard)
    if isinstance(emitters, SeveralEmitters):
        parameters = fitted(parameters, sites, heard)
    remarks = [*said(), *parameters.remarks(elevations=elevated)]
    with nullcontext() if out is None else atomic_folder(out) as folder:
        outcome: BearingOutcome[Any]
        if labels:
            steps = track_labelled(by_label, parameters, sites)
            outcome = several_outcome(source.name, steps, sites, parameters, why, remarks, truth, cutoff_m, labels)
        elif isinstance(emitters, SeveralEmitters):
            steps = list(track(heard, parameters, sites))
            outcome = several_outcome(source.name, steps, sites, parameters, why, remarks, truth, cutoff_m, {})
        else:
            steps = list(track(heard, parameters, sites))
            outcome = outcome_of(source.name, steps, sites, parameters, why, remarks, truth, cutoff_m)
        if folder is not None:
            write_outcome(folder, outcome, parameters.to_yaml())
    return outcome


def follow_bearings(
    source: BearingSource, parameters: BearingTracking, out: Path, on_fix: Callable[[LiveFix], None]
) -> None:
    """Track emitters while their bearings come: a time's rows stand in the file before the next is read.

    The first time decides whether there are elevations and, where that is left to what is heard, several emitters. A
    time is complete when a later one comes.

    Parameters
    ----------
    source
        Opened with ``follow``, or standard input.
    parameters
        What to do.
    out
        Folder for ``tracks.csv`` and ``config.yaml``.
    on_fix
        Called after each time. What it raises ends the run; what is written by then stays.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If the folder holds an earlier run's track, or a line cannot be used.
    """
    parameters.check(live=True)
    if (out / "tracks.csv").exists():
        raise DataError(f"{out / 'tracks.csv'}: is there already, of an earlier run; name another folder.")
    came_s = 0.0

    def coming() -> Iterator[PlaceSet]:
        nonlocal came_s
        for measurement in source:
            came_s = time.perf_counter()
            yield measurement

    with warnings_heard() as said:
        heard = coming()
        earliest = next(heard)
        parameters, why = decided(parameters, [earliest])
        steps = track(chain([earliest], heard), parameters, source.sites, live=True)
        first = next(steps)
        remarks = (f"Emitters: {why}.", *parameters.remarks(elevations=have_elevations([earliest])))
        alone = not isinstance(parameters.emitters, SeveralEmitters)
        folder = existing_folder(out)
        (folder / "config.yaml").write_text(parameters.to_yaml(), encoding="utf-8")
        with TrackLog(names_of(first, parameters), "m", path=folder / "tracks.csv") as log:
            for step in chain([first], steps):
                if alone and crowding_of([step.measurement], parameters.sigma_deg).several:
                    remarks = (*remarks, f"{step.time_s:g} s: {ONE_OF_MANY}")
                    alone = False  # it is said once
                log.append(step)
                log.flush()
                on_fix(LiveFix(step, time.perf_counter() - came_s, (*remarks, *said())))
                remarks = ()


@contextmanager
def warnings_heard() -> Iterator[Callable[[], tuple[str, ...]]]:
    """Gather what a reader warns of; gives what is to be called for the sentences since the last call."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UserWarning)

        def said() -> tuple[str, ...]:
            sentences = tuple(str(warning.message) for warning in caught)
            caught.clear()
            return sentences

        yield said
