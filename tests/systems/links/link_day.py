"""Made-up steps of a tracked log, cheap enough for a day of frames: two people, a ghost now and then, gaps."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from elusive.io import Truth
from elusive.preprocess.link_calibration import Calibration
from elusive.preprocess.link_drift import no_drift
from elusive.sensors.radio_network import RssFrame, radio_nodes
from elusive.tracking.lifecycle import Life
from elusive.tracking.people import TrackEvent
from elusive.tracking.superposed_state import Target
from elusive.tracking.track import Step, Track

RATE_HZ = 4
CALIBRATION = 20
PERIOD = 512  # frames until a track is lost or exchanged
NODES = radio_nodes(np.array([[-3.0, -3], [3, -3], [3, 3], [-3, 3]]))
SPREAD = np.diag([0.09, 0.01, 0.16, 0.01])
EVEN = np.full(500, 1 / 500)
QUIET = np.full((12, 1), -60.0)
REMARKS = ("The room was not quite empty.",)


def place(person, time_s):
    """Where a person truly is."""
    return 2 * math.cos(time_s / 9 + 2 * person), 1.5 * math.sin(time_s / 7 + person)


def truth(seconds):
    """Two people, the second from a third of the time on."""
    paths = []
    for person in range(2):
        times = np.arange(person * seconds / 3, seconds, 0.5)
        paths.append(np.array([(time_s, *place(person, time_s)) for time_s in times]))
    return Truth(("Ann", "Bob"), tuple(paths))


def step_of(time_s, tracks, events, cloud, calibrating=False):
    targets = tuple(
        Target(Life(one.track, one.status), one.existence, cloud + one.mean, EVEN, one.mean, one.covariance)
        for one in tracks
    )
    people = SimpleNamespace(belief=SimpleNamespace(targets=targets), events=tuple(events))
    rss = SimpleNamespace(
        calibration=Calibration(0.0, QUIET, np.zeros_like(QUIET), ()),
        settled_share=0.0,
        gains_db=np.zeros((0, 2)),
        drift=no_drift(len(NODES.names), 1),
        bursts=np.zeros(1, bool),
    )
    state = SimpleNamespace(people=people, events=tuple(events), calibrating=calibrating, remarks=REMARKS, rss=rss)
    return Step(time_s, RssFrame(time_s, QUIET), state, tuple(tracks))


def steps(frames, seed=5):
    """Yield a step a frame; the people's tracks are lost and found again, now and then exchanged."""
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(500, 4))
    number, tracks, ghosts = 2, {0: 1, 1: 2}, []

    def shown_at(track, status, existence, x, y):
        return Track(track, status, existence, np.array([x, 0.1, y, -0.1]), SPREAD)

    for frame in range(frames):
        time_s = frame / RATE_HZ
        if frame < CALIBRATION:
            yield step_of(time_s, [], [], cloud, calibrating=True)
            continue
        shown, events = [], []
        if frame % PERIOD == 0:  # one is lost and becomes a new track, or both are exchanged
            if rng.random() < 0.5:
                number += 1
                events.append(TrackEvent(time_s, tracks[0], "lost", place(0, time_s)))
                shown.append(shown_at(tracks[0], "deleted", 0.0, *place(0, time_s)))
                tracks[0] = number
            else:
                tracks = {0: tracks[1], 1: tracks[0]}
        if frame % 300 == 7:
            number += 1
            ghosts.append((number, frame))
            events.append(TrackEvent(time_s, number, "appeared", (0.1, 0.2)))
        for person, track in tracks.items():
            if rng.random() < 0.9:
                x, y = np.add(place(person, time_s), rng.normal(0, 0.8, 2))
                status = "confirmed" if frame % PERIOD > (30 if track == 1 else 5) else "candidate"
                shown.append(shown_at(track, status, float(rng.uniform(0.5, 1)), x, y))
        shown += [shown_at(k, "candidate", 0.6, 0.1, 0.2) for k, at in ghosts if frame < at + 4]
        ghosts = [one for one in ghosts if frame < one[1] + 4]
        yield step_of(time_s, shown, events, cloud)
