"""Whether the levels of a log are those that radios in a room tell: how finely, down to which, and by what they change.

Levels in coarse steps, at the radios' floor, of a radio whose gain has changed, or of another room than was calibrated,
as a whole or where something in it was moved.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_drift import of_drift
from elusive.preprocess.link_settled import ANOTHER_ROOM
from elusive.report.clock import moment
from elusive.sensors.radio_network import RadioNodes, directed_links_of, links_of, undirected_of
from elusive.systems.links.by_links import LinksState
from elusive.systems.links.resting import Changed
from elusive.tracking.track import Step

COARSE_DB = 2.5  # steps of readings
GAIN_STEP_DB = 1.0  # by which a node's gain has changed anew
MANY_BURSTS = 0.01  # of the frames of a channel
NAMED = 3  # links that have changed most


class LevelFacts:
    """What the levels of a run's steps say, at constant memory."""

    def __init__(self, nodes: RadioNodes) -> None:
        self._nodes = nodes
        self._calibration: Calibration | None = None
        self._step_db = math.nan
        self._settled, self._settled_s = 0.0, math.nan
        self._bursts, self._looked = 0, 0
        self._gain_db, self._gain_of, self._gain_s = 0.0, "", math.nan
        self._drift_db, self._drift_of, self._drift_s = 0.0, "", math.nan
        self._changes, self._changed, self._changed_s = 0, "", math.nan

    def add(self, step: Step) -> None:
        """Take in a step."""
        if self._calibration is None:
            self._calibration = step.state.rss.calibration
            self._step_db = _least_step(step.measurement.rss_dbm)
        if step.state.rss.settled_share > self._settled:
            self._settled = step.state.rss.settled_share
            self._settled_s = step.time_s
        self._bursts += int(step.state.rss.bursts.sum())
        self._looked += len(step.state.rss.bursts)
        self._gain(step)
        self._drifts(step)
        people = step.state.people
        if isinstance(people, LinksState) and people.changed is not None:
            if not self._changes:
                self._changed, self._changed_s = self._told(people.changed), step.time_s
            self._changes += 1

    def _told(self, changed: Changed) -> str:
        """Say where something has changed, and which links most."""
        ends = links_of(len(self._nodes.names))
        heard = np.isfinite(changed.level_db).sum(axis=1)
        total = np.abs(np.nan_to_num(changed.level_db)).sum(axis=1)
        link = undirected_of(len(self._nodes.names))
        readings = np.maximum(np.bincount(link, heard, len(ends)), 1)
        most = np.argsort(-np.bincount(link, total, len(ends)) / readings)[:NAMED]
        links = ", ".join("-".join(self._nodes.names[k] for k in ends[one]) for one in most)
        places = " and ".join(f"x {x:.1f}, y {y:.1f} m" for x, y in changed.places)
        return f"at {places} (the links {links} most)"

    def _gain(self, step: Step) -> None:
        """Keep the greatest change of a node's own gain, and when it was first as great."""
        gains = step.state.rss.gains_db
        if gains.size and (greatest := float(np.abs(gains).max())) > abs(self._gain_db):
            node, side = np.unravel_index(int(np.abs(gains).argmax()), gains.shape)
            if not self._gain_db or greatest > abs(self._gain_db) + GAIN_STEP_DB:
                self._gain_s = step.time_s
            self._gain_db = float(gains[node, side])
            does = "sends and hears" if gains[node, 0] == gains[node, 1] else ("sends", "hears")[side]
            self._gain_of = f"what {self._nodes.names[node]} {does}"

    def _drifts(self, step: Step) -> None:
        """Keep by how much gains have drifted, on which link most, and when they were first known to."""
        drift = step.state.rss.drift
        if drift.chosen < 0:
            return
        if math.isnan(self._drift_s):
            self._drift_s = step.time_s
        added = of_drift(drift.gain_db, len(self._nodes.names))
        link, channel = np.unravel_index(int(np.abs(added).argmax()), added.shape)
        if abs(added[link, channel]) > abs(self._drift_db):
            self._drift_db = float(added[link, channel])
            sender, receiver = directed_links_of(len(self._nodes.names))[link]
            self._drift_of = f"{self._nodes.names[sender]}-{self._nodes.names[receiver]}-{channel}"

    def findings(self) -> tuple[Finding, ...]:
        """Return what was checked."""
        return (
            self._rounding(),
            self._floor(),
            self._radio(),
            self._drifting(),
            self._burst(),
            self._room(),
            self._moved(),
        )

    def _rounding(self) -> Finding:
        return Fact(1.0, self._step_db, not self._step_db > COARSE_DB, math.nan).finding(
            "links.rounding",
            f"Readings come in steps of {self._step_db:.3g} dB: most of what a person changes is lost in rounding.",
            "Export levels in steps of 1 dB or finer, in dB.",
            grave=False,
        )

    def _floor(self) -> Finding:
        assert self._calibration is not None
        floor_dbm, unheard = self._calibration.floor_dbm, np.isnan(self._calibration.mean_dbm).mean()
        seen = float(unheard) if math.isfinite(floor_dbm) else 0.0
        return Fact(0.0, seen, seen == 0.0, math.nan).finding(
            "links.floor",
            f"Many readings keep to the least level, {floor_dbm:g} dBm, which radios write of all that is fainter: it "
            f"is taken for not heard. {seen:.0%} of the readings are not heard in the empty room.",
            "Put nodes closer, or let them send louder; export what is not heard as missing.",
            grave=False,
        )

    def _radio(self) -> Finding:
        same = self._gain_db == 0.0
        return Fact(0.0, abs(self._gain_db), same, math.nan).finding(
            "links.gain",
            f"From {moment(self._gain_s)} on {self._gain_of} reads {self._gain_db:+.1f} dB on all links alike, which "
            "nobody does who walks: a radio's own gain has changed, and is taken out of its levels.",
            "See to the radio's supply and antenna, or calibrate again.",
            grave=False,
        )

    def _drifting(self) -> Finding:
        return Fact(0.0, abs(self._drift_db), math.isnan(self._drift_s), math.nan).finding(
            "links.drift",
            f"From {moment(self._drift_s)} on levels drift alike on all links of a radio, or of a channel, as nobody "
            f"makes them: by {self._drift_db:+.1f} dB where most ({self._drift_of}). It is taken out of them.",
            "See to the radios' supplies and clocks, or calibrate again.",
            grave=False,
        )

    def _burst(self) -> Finding:
        share = self._bursts / max(self._looked, 1)
        return Fact(0.0, share, not share > MANY_BURSTS, self._looked).finding(
            "links.bursts",
            f"In {share:.0%} of the frames of a channel both directions of most links differ by far more than in the "
            "empty room, as when another network sends: these readings are taken for not heard.",
            "Take channels that others use less.",
            grave=False,
        )

    def _room(self) -> Finding:
        return Fact(0.0, self._settled, not self._settled > ANOTHER_ROOM, math.nan).finding(
            "links.room",
            f"At {moment(self._settled_s)} {self._settled:.0%} of the readings keep quietly to another level than in "
            "the empty room, as when a door was opened, furniture moved or radios drift. The levels were taken for "
            "those of the empty room from then on; tracks of the time before may be nobody's.",
            "Calibrate again on the room as it is then, or track each part of the log with its own.",
        )

    def _moved(self) -> Finding:
        return Fact(0.0, float(self._changes), not self._changes, math.nan).finding(
            "links.changed",
            f"By {moment(self._changed_s)} what was taken for somebody {self._changed} had never moved, and the levels "
            "there kept as steady as beside nobody: a door, furniture or a fan has changed them. They were taken for "
            "those of the room from then on; the track until then was nobody. Who stands there and had come unseen, "
            "without any motion, is missed." + (f" So it was {self._changes} times." if self._changes > 1 else ""),
            "Look who is there; calibrate again on the room as it is then (--empty FILE).",
            grave=False,
        )


def _least_step(levels: Array) -> float:
    """Least difference between readings [dB]."""
    values = np.unique(levels[np.isfinite(levels)])
    return float(np.diff(values).min()) if len(values) > 2 else math.nan
