"""Tracks followed live, checked while bearings come: what was not checked, or does not hold, is not told as sure."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from copy import copy

import numpy as np

from elusive.checks import Finding, broken, grave
from elusive.errors import ElusiveError
from elusive.sensors.bearing_sets import SensorSites
from elusive.systems.bearings.checks import estimate_findings, track_findings
from elusive.systems.bearings.choices import Cruise, GraphFilter, Interacting, SeveralEmitters
from elusive.systems.bearings.deviation import errors_found
from elusive.systems.bearings.emitter import Emitter
from elusive.systems.bearings.faults import LEAST_TIMES
from elusive.systems.bearings.found_norths import with_norths
from elusive.systems.bearings.live_fit import LATEST, LiveFit
from elusive.systems.bearings.live_one import OneFit
from elusive.systems.bearings.pairings import pairings, pairings_finding
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.powers import powers_found
from elusive.systems.bearings.several_checks import crowd_scale, several_fault, several_findings
from elusive.systems.bearings.track import track
from elusive.tracking.track import Step

UNCHECKED = "Keep what comes in a file, and track that: it is checked as a whole."


class LiveChecks:
    """Checks the latest times after 12, 18, 27 and so on, and each 200 at least, beside the tracker, for seconds.

    On any computer it is over a quarter of the times later, a hundred at most: if need be it is waited for.

    Parameters
    ----------
    sites
        Where the sensors stand.
    """

    def __init__(self, sites: SensorSites) -> None:
        self._sites, self._latest = sites, deque[Step](maxlen=LATEST)
        self._count, self._due, self._over = 0, LEAST_TIMES, 0
        self._named, self._remarks, self._unsure = set[str](), list[str](), True
        self._beside = ThreadPoolExecutor(1, "checks")
        self._checked: Future[tuple[Finding, ...]] | None = None

    @contextmanager
    def checking(self) -> Iterator[None]:
        """Check while tracks are followed."""
        with self._beside:
            yield

    def told(self, step: Step, fit: LiveFit) -> Step:
        """Take a step in with what is learnt by then, and return it with its tracks as candidates unless all holds."""
        # nothing that is checked of several reads their clouds, which for all of these times would fill memory
        alone = isinstance(step.state, Emitter)
        self._latest.append(step if alone else step._replace(state=None, tracks=step.state.tracks))
        self._count += 1
        if self._checked is not None and self._count >= self._over:
            found = broken(self._checked.result())
            self._remarks += [f"{one.sentence} {one.remedy}" for one in found if one.name not in self._named]
            self._named, self._unsure, self._checked = {one.name for one in found}, grave(found), None
        if self._checked is None and self._count >= self._due:
            self._checked = self._beside.submit(live_findings, copy(fit), self._sites, tuple(self._latest))
            self._over = self._count + min(self._count // 4, LATEST // 2)
            self._due = self._count + min(self._count // 2, LATEST)
        if not self._unsure:
            return step
        tracks = (one._replace(status="candidate") if one.status == "confirmed" else one for one in step.tracks)
        return step._replace(tracks=tuple(tracks))

    def said(self) -> tuple[str, ...]:
        """Return what was found since the last call."""
        said = tuple(self._remarks)
        self._remarks.clear()
        return said

    def judged(self, fit: LiveFit) -> tuple[Finding, ...]:
        """Check the latest times, with what is learnt by then."""
        return live_findings(fit, self._sites, self._latest)


def live_findings(fit: LiveFit, sites: SensorSites, steps: Iterable[Step]) -> tuple[Finding, ...]:
    """Check one emitter's bearings as of a recording, and what its filter makes of them; or several emitters' tracks.

    What cannot be checked is a finding too: tracks are followed on, and not told as sure.
    """
    try:
        return _findings(fit, sites, steps)
    except (ElusiveError, np.linalg.LinAlgError) as error:
        sentence = f"What was heard could not be checked: {error}"
        return (Finding("bearings.unchecked", False, math.nan, math.nan, sentence, UNCHECKED),)


def _findings(fit: LiveFit, sites: SensorSites, steps: Iterable[Step]) -> tuple[Finding, ...]:
    """Check as :func:`live_findings` does; what a filter has learnt by the way hides what is wrong with a sensor."""
    known, given = list(steps), fit.given
    if not isinstance(fit, OneFit):
        righted = [step._replace(measurement=fit.norths.righted(step.measurement)) for step in known]
        return checked(with_norths(fit.parameters, fit.norths), sites, righted)
    if isinstance(given.filter, GraphFilter):
        return checked(fit.parameters, sites, known)
    heard = [step.measurement for step in known]
    asked = given.replace(motion=Cruise()) if isinstance(given.motion, Interacting) else given
    asked = powers_found(errors_found(asked.by("map"), sites, heard), sites, [heard])
    found = {one.name: one for one in track_findings(list(track(heard, asked, sites)), asked, sites)}
    own = {one.name: one for one in estimate_findings(known, fit.parameters, sites)}
    return tuple((found | own).values())


def checked(parameters: BearingTracking, sites: SensorSites, steps: Sequence[Step]) -> tuple[Finding, ...]:
    """Check the tracks of unlabelled bearings, of one emitter or of several."""
    if isinstance(parameters.emitters, SeveralEmitters):
        paired = pairings_finding(pairings(steps, parameters, sites))
        fault, scale = several_fault(steps, parameters, sites), crowd_scale(steps, sites, parameters)
        return (*several_findings(steps, parameters, sites, fault, scale), paired)
    return track_findings(steps, powers_found(parameters, sites, [[step.measurement for step in steps]]), sites)
