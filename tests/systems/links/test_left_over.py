"""What is left over before somebody is found was theirs, and is not told of those who are found."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from elusive.systems.links.checks import FOUND_S, ONE_MORE, LinkFacts
from tests.tracking.link_scenes import border

INTERVAL_S, LOUD = 0.1, 20.0


def steps(found_s, frames=200):
    """Somebody from the start, somebody else tracked from a time on; before it much is left over."""
    for k in range(frames):
        both = k * INTERVAL_S >= found_s
        tracks = [SimpleNamespace(track=name, status="confirmed") for name in range(1 + both)]
        left = SimpleNamespace(log_ratio=-1.0 if both else LOUD)
        yield SimpleNamespace(
            time_s=k * INTERVAL_S, tracks=tracks, state=SimpleNamespace(people=SimpleNamespace(unexplained=left))
        )


@pytest.mark.parametrize(("found_s", "named"), [(0.9 * FOUND_S, False), (3 * FOUND_S, True), (1e9, True)])
def test_who_is_found_in_seconds_is_not_missing(found_s, named):
    facts = LinkFacts(border(8, 3.0))
    for step in steps(found_s):
        facts._left_over(step)
    assert (facts._people().seen > ONE_MORE) == named
    assert facts._people().holds != named
