"""A recording of bearings tracked as a whole, or live: each time as it comes, at constant memory."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from elusive.checks import Finding, broken, write_checks
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
from elusive.systems.bearings.checks import judged, track_findings
from elusive.systems.bearings.choices import Estimation, SeveralEmitters
from elusive.systems.bearings.deviation import errors_found
from elusive.systems.bearings.emitter import Emitter
from elusive.systems.bearings.found_norths import norths_of, with_norths
from elusive.systems.bearings.heard import have_elevations
from elusive.systems.bearings.live_fit import LiveFit
from elusive.systems.bearings.live_one import OneFit
from elusive.systems.bearings.mended import mended
from elusive.systems.bearings.norths import learnt_norths_finding
from elusive.systems.bearings.pairings import lowered, pairings, pairings_finding
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.persisting import less_sure
from elusive.systems.bearings.powers import powers_found
from elusive.systems.bearings.results import BearingOutcome, outcome_of, write_outcome
from elusive.systems.bearings.several import crowding_of, decided
from elusive.systems.bearings.several_checks import several_findings
from elusive.systems.bearings.several_fit import fitted
from elusive.systems.bearings.several_results import names_of, several_outcome
from elusive.systems.bearings.track import together, track, track_labelled
from elusive.tracking.memory import Memory
from elusive.tracking.track import Step

LIVE_FILES = ("tracks.csv", "checks.json", "config.yaml")
ONE_OF_MANY = (
    "bearings of a sensor lie apart, and are averaged as of one emitter. Do not rely on the track; --emitters several "
    "follows more than one."
)
LATEST, FIRST_CHECKED = 2000, 50  # times that are checked live, and after how many for the first time


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
    else:
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
                steps = list(track(heard, parameters, sites))
                pairs = pairings(steps, parameters, sites)
                findings = (*several_findings(steps, parameters, sites), pairings_finding(pairs))
                norths = norths_of(parameters, sites)
                steps = [less_sure(norths.wider(step, sites), parameters) for step in lowered(steps, pairs)]
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
        latest, named = deque[Step](maxlen=LATEST), set[str]()
        due, steps_done = FIRST_CHECKED, 0
        judged: Future[tuple[Finding, ...]] | None = None

        def learnt() -> LiveFit:
            fit: LiveFit = memory.held[-1]
            return fit

        def heeded(live: LiveStep) -> None:
            nonlocal alone, due, steps_done, judged
            step = live.step
            # nothing that is checked of several reads their clouds, which for all of these times would fill memory
            latest.append(step if isinstance(step.state, Emitter) else step._replace(state=None))
            steps_done += 1
            if alone and crowding_of([step.measurement], parameters.deviation_deg).several:
                remarks.append(f"{moment(step.time_s)}: {ONE_OF_MANY}")
                alone = False  # it is said once
            if steps_done == due:
                due *= 2
                judged = judged or beside.submit(live_checked, learnt(), sites, tuple(latest))
            if judged is not None and judged.done():
                new = [one for one in broken(judged.result()) if one.name not in named]
                named.update(one.name for one in new)
                remarks.extend(f"{one.sentence} {one.remedy}" for one in new)
                judged = None
            on_step(live._replace(remarks=(*remarks, *said(), *live.remarks)))
            remarks.clear()

        with (
            live_folder(out, parameters.to_yaml()) as folder,
            TrackLog(names_of(first, parameters), "m", path=folder / "tracks.csv", live=True, keeps=False) as log,
            ThreadPoolExecutor(1, "checks") as beside,  # what may be the cause is tracked again, for seconds
        ):
            end = follow_live(chain([first], steps), coming, log, heeded)
            findings = live_checked(learnt(), sites, latest)
            return finished(end._replace(findings=findings), log, partial(write_checks, folder, findings))


def checked(parameters: BearingTracking, sites: SensorSites, steps: Iterable[Step]) -> tuple[Finding, ...]:
    """Check the tracks of unlabelled bearings, of one emitter or of several."""
    known = list(steps)
    if isinstance(parameters.emitters, SeveralEmitters):
        paired = pairings_finding(pairings(known, parameters, sites))
        return (*several_findings(known, parameters, sites), paired)
    return track_findings(known, powers_found(parameters, sites, [[step.measurement for step in known]]), sites)


def live_checked(fit: LiveFit, sites: SensorSites, steps: Iterable[Step]) -> tuple[Finding, ...]:
    """Check tracks that are followed live, with what was learnt."""
    if not isinstance(fit, OneFit):
        return checked(with_norths(fit.parameters, fit.norths), sites, steps)
    flt, bias = fit.parameters.filter, fit.bias
    if bias is None or not isinstance(flt, Estimation) or flt.bias is not None:
        return checked(fit.parameters, sites, steps)
    # what was tracked before norths were known is not checked by these
    known = [step for step in steps if step.state.norths.alike(fit.norths, fit.parameters.deviation_deg)]
    biased = [step.state.biased(bias.sd_deg).step(step.measurement) for step in known]
    found = checked(fit.parameters.replace(filter=flt.replace(bias=bias)), sites, biased)
    learnt = learnt_norths_finding(fit.norths, fit.parameters, sites)
    return tuple(learnt if one.name == learnt.name else one for one in found)


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
