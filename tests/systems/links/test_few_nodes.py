"""Whether a network tells two people apart is told by what a second one would bring it, and said where it is little."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from elusive.systems.links.checks import LEARNED_FRAMES, TELLS, LinkFacts
from elusive.systems.links.fit import fitted_at_the_start
from elusive.systems.links.track import LinkTracking, track
from tests.longer import longer
from tests.ray_room import EMPTY, ray_room
from tests.tracking.link_scenes import border


@pytest.mark.parametrize(("nodes", "told_apart"), longer([(5, False), (12, True)], (12, True)))
@pytest.mark.parametrize("seed", longer([0, 1], 1))
def test_a_network_says_whether_it_tells_two_apart(seed, nodes, told_apart):
    """Of two people five nodes track one, twelve nodes two."""
    room = ray_room(seed, (0.7, 0.5), nodes=nodes, frames=60)
    parameters, _ = fitted_at_the_start(room, room.nodes, LinkTracking(calibration_frames=EMPTY))
    facts, people = LinkFacts(room.nodes), list[int]()
    for step in track(room, room.nodes, parameters):
        facts.add(step)
        people.append(sum(one.status == "confirmed" for one in step.tracks))
    named = {one.name: one for one in facts.findings()}["links.several"]
    assert named.holds == told_apart
    assert np.median(people[EMPTY + 12 :]) == 1 + told_apart


def test_frames_that_tell_nothing_hide_it_from_nobody(monkeypatch):
    """A frame without a change, as one that is missing, has no likelihood at all."""
    facts = LinkFacts(border(8, 3.0))
    for part in ("_levels", "_stays", "_pairs_there", "_unseen"):
        monkeypatch.setattr(facts, part, SimpleNamespace(add=lambda *told: None))
    monkeypatch.setattr(facts, "_left_over", lambda step: None)
    monkeypatch.setattr("elusive.systems.links.checks.LinksState", SimpleNamespace)
    likeness = SimpleNamespace(misfit=1.0, pairs=20)
    for k in range(2 * LEARNED_FRAMES):
        people = SimpleNamespace(learns=True, tells=np.nan if k == 7 else 0.5 * TELLS, likeness=likeness, rests={})
        state = SimpleNamespace(rss=SimpleNamespace(calibration=None), people=people)
        facts.add(SimpleNamespace(state=state, tracks=[SimpleNamespace(status="confirmed")]))
    assert not facts._several().holds
    assert facts._several().seen == pytest.approx(0.5 * TELLS)
