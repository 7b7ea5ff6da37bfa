"""A recording of bearings tracked as a whole, or live: each time as it comes, at constant memory."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from elusive.checks import Finding, write_checks
from elusive.errors import DataError
from elusive.io import atomic_folder
from elusive.io.arrivals import Coming
from elusive.io.bearings import BearingSource
from elusive.io.truth import Truth
from elusive.report.clock import moment
from elusive.results import TrackLog
from elusive.results.live import LiveEnd, LiveStep, finished, follow_live, live_folder
from elusive.sensors.bearing_sets import SensorSites
from elusive.sensors.bearing_table import PlaceSet
from elusive.systems.bearings.checks import judged
from elusive.systems.bearings.choices import SeveralEmitters
from elusive.systems.bearings.deviation import errors_found
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.live_checks import LiveChecks
from elusive.systems.bearings.mended import mended
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found
from elusive.systems.bearings.results import BearingOutcome, outcome_of, write_outcome
from elusive.systems.bearings.several import crowding_of, decided
from elusive.systems.bearings.several_mended import several_told
from elusive.systems.bearings.several_results import names_of, several_outcome
from elusive.systems.bearings.track import together, track, track_labelled
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

LIVE_FILES = ("tracks.csv", "checks.json", "config.yaml")
ONE_OF_MANY = (
    "bearings of a sensor lie apart, and are averaged as of one emitter. Do not rely on the track; --emitters several "
    "follows more than one."
)


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
    if not isinstance(emitters, SeveralEmitters):
        parameters = errors_found(parameters, sites, max(by_label.values(), key=len))
        parameters = parameters if labels else powers_found(parameters, sites, [heard])
    remarks = [*said(), *parameters.remarks(elevations=elevated)]
    with nullcontext() if out is None else atomic_folder(out) as folder:
        outcome: BearingOutcome[Any]
        findings: tuple[Finding, ...]
        if labels or isinstance(emitters, SeveralEmitters):
            if labels:
                alone = track_labelled(by_label, parameters, sites)
                each, found = list[list[Step]](), dict[str, Finding]()
                for label, (its, own) in alone.items():
                    of_label, fault = judged(its, own, sites, label)
                    found |= {one.sentence: one for one in of_label}
                    each.append(mended(its, fault, own, sites))
                steps, findings = together(each), tuple(found.values())
            else:
                steps, parameters, findings, fault = several_told(heard, parameters, sites)
                remarks += [f"Places are told as of what fits best: {fault.what}."] if fault else []
            outcome = several_outcome(
                source.name, steps, sites, parameters, why, remarks, truth, cutoff_m, labels, findings
            )
        else:
            steps = list(track(heard, parameters, sites))
            outcome = outcome_of(source.name, steps, sites, parameters, why, remarks, truth, cutoff_m)
        if folder is not None:
            write_outcome(folder, outcome, parameters.to_yaml(), sites.frame)
    return outcome


def follow_bearings(
    coming: Coming[PlaceSet],
    sites: SensorSites,
    parameters: BearingTracking,
    out: Path,
    on_step: Callable[[LiveStep], None],
    memory: Memory | None = None,
) -> LiveEnd:
    """Track emitters while their bearings come: a time's rows stand in the file before the next is taken.

    The first time decides whether there are elevations and, where that is left to what is heard, several emitters. A
    time is complete when a later one comes.

    Parameters
    ----------
    coming
        :class:`~elusive.io.arrivals.Arrivals` of a table opened with ``follow``, or of standard input.
    sites
        Where the sensors stand.
    parameters
        What to do.
    out
        Folder for LIVE_FILES.
    on_step
        Called after each time.
    memory
        Where the tracker keeps its state.

    Returns
    -------
    LiveEnd
        How it ended, and what was checked of the latest times, in ``checks.json`` too. What does not hold is said while
        it is tracked.

    Raises
    ------
    ParameterError
        If the estimator cannot do what is asked.
    DataError
        If the folder holds an earlier run's track, or a line of the first times cannot be used.
    """
    parameters.check(live=True)
    with warnings_heard() as said:
        memory = memory or Memory()
        heard = memory.new(coming)
        earliest = next(heard, None)
        if earliest is None:
            raise DataError("no bearing came.")
        parameters, why = decided(parameters, [memory.first])
        steps = track(chain([earliest], heard), parameters, sites, live=True, memory=memory)
        first = next(steps)
        remarks = [f"Emitters: {why}.", *parameters.remarks(elevations=have_elevations([memory.first]))]
        alone = not isinstance(parameters.emitters, SeveralEmitters)
        checks = LiveChecks(sites)

        def told() -> Iterator[Step]:
            for step in chain([first], steps):
                yield checks.told(step, memory.held[-1])

        def heeded(live: LiveStep) -> None:
            nonlocal alone
            step = live.step
            if alone and crowding_of([step.measurement], parameters.deviation_deg).several:
                remarks.append(f"{moment(step.time_s)}: {ONE_OF_MANY}")
                alone = False  # it is said once
            on_step(live._replace(remarks=(*remarks, *checks.said(), *said(), *live.remarks)))
            remarks.clear()

        with (
            live_folder(out, parameters.to_yaml()) as folder,
            TrackLog(names_of(first, parameters), "m", path=folder / "tracks.csv", live=True, keeps=False) as log,
            checks.checking(),
        ):
            end = follow_live(told(), coming, log, heeded)
            findings = checks.judged(memory.held[-1])
            return finished(end._replace(findings=findings), log, partial(write_checks, folder, findings))


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
