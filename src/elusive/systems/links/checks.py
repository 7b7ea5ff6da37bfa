"""Whether the model explains what people change, and tells how many they are; and what else a run says of its input."""

from __future__ import annotations

import math
from collections import deque

from elusive.checks import Fact, Finding
from elusive.preprocess.link_calibration import Calibration
from elusive.report.clock import moment
from elusive.sensors.radio_network import RadioNodes
from elusive.systems.links.beside import BESIDE, Pairs
from elusive.systems.links.by_links import LinksState
from elusive.systems.links.levels import LevelFacts
from elusive.systems.links.network import network_findings
from elusive.systems.links.standing import Stays
from elusive.systems.links.unseen import Unseen
from elusive.tracking.track import Step

MISFIT, LEARNED_FRAMES = 2.0, 20
FEWEST_PAIRS = 10  # frames with somebody, after each other, from which it is known how long readings err alike
# log likelihood a frame of one more person: to 2.2 where few nodes track all, else below .9; where two were one, above
# 3 in four of six runs, 1.6 and less in two
ONE_MORE = 3.0
# log likelihood a frame by which a second person is told from one: 3.4 to 6.6 of ten and twelve nodes in rooms of rays
# (.25 to 1 of the frames right), 2.6 in a basement; of eight nodes 1.0 to 1.7 (.0 to .5 right), of five .1 to .4
TELLS = 2.0
SEEN_THEN = 0.5  # share of the frames of a calibration with somebody, in which they have to be found
FOUND_S = 5.0  # within which somebody who comes is found


class LinkFacts:
    """What the steps of a run say of its input, at constant memory.

    Parameters
    ----------
    nodes
        The network.
    recorded
        The calibration that the log has itself, where another has been learned from it.
    """

    def __init__(self, nodes: RadioNodes, recorded: Calibration | None = None) -> None:
        self._nodes, self._recorded = nodes, recorded
        self._then, self._seen = 0, 0  # frames of that calibration, and of them with somebody
        self._calibration: Calibration | None = None
        self._confirmed = 0
        self._misfit = math.nan
        self._pairs = 0
        self._one_more, self._looked = 0.0, 0
        self._tells, self._told = 0.0, 0
        self._late: deque[tuple[float, float]] = deque()  # time and what was left over, of the last seconds
        self._found: frozenset[int] = frozenset()
        self._stays, self._pairs_there, self._unseen = Stays(), Pairs(), Unseen()
        self._levels = LevelFacts(nodes)

    def add(self, step: Step) -> None:
        """Take in a step."""
        if self._calibration is None:
            self._calibration = step.state.rss.calibration
        self._levels.add(step)
        if self._recorded is not None and not step.state.calibrating and step.time_s <= self._recorded.time_s:
            self._then += 1
            self._seen += any(track.status == "confirmed" for track in step.tracks)
        people = step.state.people
        if isinstance(people, LinksState) and people.learns:
            sure = any(track.status == "confirmed" for track in step.tracks)
            self._confirmed += sure
            if sure and math.isfinite(people.tells):
                self._tells, self._told = self._tells + people.tells, self._told + 1
            self._misfit = people.likeness.misfit
            self._pairs = int(people.likeness.pairs)
            self._stays.add(step, {number for number, rest in people.rests.items() if number > 0 and not rest.came})
            self._pairs_there.add(step)
            self._unseen.add(step)
            self._left_over(step)

    def _left_over(self, step: Step) -> None:
        """Sum up what is left over, but for the seconds before somebody is found: that was theirs."""
        found = frozenset(track.track for track in step.tracks if track.status == "confirmed")
        if found - self._found:
            self._late.clear()
        self._found = (self._found | found) & {track.track for track in step.tracks}
        log_ratio = step.state.people.unexplained.log_ratio
        if math.isfinite(log_ratio):
            self._late.append((step.time_s, log_ratio))
        while self._late and step.time_s - self._late[0][0] > FOUND_S:
            self._one_more += self._late.popleft()[1]
            self._looked += 1

    def findings(self) -> tuple[Finding, ...]:
        """Return what was checked."""
        if self._calibration is None:
            return ()
        mean = self._calibration.mean_dbm
        found = [self._inside(), *self._levels.findings(), self._model(), self._alike(), self._people()]
        found += [self._several(), self._rests(), self._unseen.finding()]
        return (*found, self._beside(), *network_findings(self._nodes, mean))

    def _inside(self) -> Finding:
        then = self._recorded or self._calibration
        assert then is not None
        learned = ""
        if self._recorded is not None:
            learned = (
                " The levels of the empty room are taken from the whole log, as they are most of the time, and "
                f"somebody is found in {self._seen} of the {self._then} frames."
            )
        return Fact(0.0, then.wanders, not then.inside, self._then).finding(
            "links.calibration",
            f"Somebody was there throughout the calibration: both directions of links wander alike.{learned} Who rests "
            "where they were is not seen.",
            "Calibrate on frames in which nobody is (--empty FILE).",
            grave=not self._seen > SEEN_THEN * self._then,
        )

    def _model(self) -> Finding:
        known = self._confirmed >= LEARNED_FRAMES
        off = known and self._misfit > MISFIT
        return Fact(1.0, self._misfit, not off, self._confirmed).finding(
            "links.model",
            f"Under the people who are tracked all readings of a link err together, {self._misfit:.2g} times as much "
            "as in a real basement: the model of what people change does not hold here, and tracks may be nobody's.",
            "Fit the site: elusive fit links, then --config; for sums over voxels, as simulated logs are, "
            "--effect radiation.",
        )

    def _alike(self) -> Finding:
        few = self._confirmed > 0 and self._pairs < FEWEST_PAIRS
        return Fact(float(FEWEST_PAIRS), float(self._pairs), not few, self._confirmed).finding(
            "links.alike",
            f"Only {self._pairs} frames tell how alike the readings of a link err, and for how long: that is taken "
            "from a basement instead, and ellipses may be too small or too large.",
            "Track a log in which somebody walks for a minute.",
            grave=False,
        )

    def _rests(self) -> Finding:
        least, first = self._stays.least, self._stays.first
        when_s, (x, y) = (math.nan, (math.nan, math.nan)) if first is None else (first.time_s, first.place)
        seen = math.nan if least is None else least.spread
        return Fact(1.0, seen, first is None, math.nan).finding(
            "links.rests",
            f"A track has stayed at x {x:.1f}, y {y:.1f} m for half a minute, at {moment(when_s)}. Links do not tell "
            "who stands there from furniture or a node that was moved, a door that was opened, or somebody who stood "
            "there in the calibration and has gone: then the track is nobody.",
            "Look who is there; calibrate on frames of the room as it is, with nobody in it (--empty FILE).",
            grave=False,
        )

    def _beside(self) -> Finding:
        pair = self._pairs_there.closest
        share, frames = (0.0, 0) if pair is None else (pair.share, pair.frames)
        when_s, (x, y) = (math.nan, (math.nan, math.nan)) if pair is None else (pair.began_s, pair.place)
        return Fact(0.0, share, not share > BESIDE, frames).finding(
            "links.beside",
            f"Two tracks that were there together from {moment(when_s)}, last at x {x:.1f}, y {y:.1f} m, are not told "
            f"apart in {share:.0%} of {frames} frames: they may be one person, who is counted twice.",
            "Track as many as there are (--most-targets), or each second or fifth frame alone: what errs in the "
            "levels for seconds is then not taken for somebody.",
        )

    def _people(self) -> Finding:
        looked = self._looked + len(self._late)
        summed = self._one_more + sum(log_ratio for _, log_ratio in self._late)
        mean = summed / looked if looked >= LEARNED_FRAMES else math.nan
        return Fact(0.0, mean, not mean > ONE_MORE, looked).finding(
            "links.people",
            f"What the tracked people leave over is likelier with one more person, by {mean:.2g} a frame (log "
            "likelihood): two may be tracked as one, or somebody is not tracked, and ellipses are too sure.",
            "Let as many be tracked as come (--most-targets); more nodes or channels tell people apart.",
        )

    def _several(self) -> Finding:
        tells = self._tells / self._told if self._told >= LEARNED_FRAMES else math.nan
        return Fact(TELLS, tells, not tells < TELLS, self._told).finding(
            "links.several",
            f"A second person would be told from one by {tells:.2g} a frame only (log likelihood, tempered as readings "
            "err alike): this network does not tell two people apart, and counts two as one.",
            "More nodes or channels; take the number of people for whether anybody is there.",
            grave=False,
        )
