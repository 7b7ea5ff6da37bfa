"""Made-up results of a tracked log, cheap enough for a day of frames: two people, a ghost now and then, gaps."""

from __future__ import annotations

import math

import numpy as np

from elusive.io.path_truth import PathTruth
from elusive.sensors.radio_network import radio_nodes
from elusive.systems.links.link_tracks import LinkTrack
from elusive.systems.links.track import LinkResult
from elusive.tracking.people import Event

RATE_HZ = 4
CALIBRATION = 20
PERIOD = 512  # frames until a track is lost or exchanged: where pieces of the scores meet, too
NODES = radio_nodes(np.array([[-3.0, -3], [3, -3], [3, 3], [-3, 3]]))


def place(person, time_s):
    """Where a person truly is."""
    return 2 * math.cos(time_s / 9 + 2 * person), 1.5 * math.sin(time_s / 7 + person)


def truth(seconds):
    """Two people, the second from a third of the time on."""
    paths = []
    for person in range(2):
        times = np.arange(person * seconds / 3, seconds, 0.5)
        paths.append(np.array([(time_s, *place(person, time_s)) for time_s in times]))
    return PathTruth(("Ann", "Bob"), tuple(paths))


def results(frames, seed=5):
    """Yield a result a frame; the people's tracks are lost and found again, now and then exchanged."""
    rng = np.random.default_rng(seed)
    cloud = rng.normal(size=(500, 2))
    number, tracks, ghosts = 2, {0: 1, 1: 2}, []
    for frame in range(frames):
        time_s = frame / RATE_HZ
        if frame < CALIBRATION:
            yield LinkResult(time_s, [], (), None, None, {}, ("The room was not quite empty.",))
            continue
        shown, events = [], []
        if frame % PERIOD == 0:  # one is lost and becomes a new track, or both are exchanged
            if rng.random() < 0.5:
                number += 1
                events.append(Event(frame, tracks[0], "lost", place(0, time_s)))
                shown.append(LinkTrack(tracks[0], "deleted", 0.0, *place(0, time_s), 0.0, 0.0, np.nan, np.nan))
                tracks[0] = number
            else:
                tracks = {0: tracks[1], 1: tracks[0]}
        if frame % 300 == 7:
            number += 1
            ghosts.append((number, frame))
            events.append(Event(frame, number, "appeared", (0.1, 0.2)))
        for person, track in tracks.items():
            if rng.random() < 0.9:
                x, y = np.add(place(person, time_s), rng.normal(0, 0.8, 2))
                status = "confirmed" if frame % PERIOD > (30 if track == 1 else 5) else "candidate"
                shown.append(LinkTrack(track, status, float(rng.uniform(0.5, 1)), x, y, 0.1, -0.1, 0.3, 0.4))
        shown += [LinkTrack(k, "candidate", 0.6, 0.1, 0.2, 0.0, 0.0, 1.0, 1.0) for k, at in ghosts if frame < at + 4]
        ghosts = [one for one in ghosts if frame < one[1] + 4]
        clouds = {one.track: cloud + np.array([one.x_m, one.y_m]) for one in shown if one.status != "deleted"}
        yield LinkResult(time_s, shown, tuple(events), None, None, clouds, ())
