"""Echoes that stay, before a straight coast: ranges that are too long bring them farther inland, and it is said."""

import numpy as np
import pytest

from elusive.systems.radar.registered import fixed_finding

EAST_M = 3000.0


class StraightCoast:
    """Land east of a line."""

    def known(self, places):
        return np.abs(places).max(axis=1) < 6000.0

    def probability(self, places):
        return (places[:, 0] < EAST_M).astype(float)


def buildings(inland_m, longer):
    rng = np.random.default_rng(4)
    places = np.column_stack([EAST_M + rng.uniform(*inland_m, 30), rng.uniform(-2000, 2000, 30)])
    far = np.hypot(*places.T)
    return places * (longer(far) / far)[:, None]


@pytest.mark.parametrize(
    ("longer", "said"),
    [
        (lambda far: far + 150.0, "if, for one, ranges are 150 m too long"),
        (lambda far: far / 0.9144, "if, for one, ranges are"),
    ],
)
def test_ranges_too_long_are_remarked_on(longer, said):
    finding = fixed_finding(buildings((1.0, 60.0), longer), np.zeros(2), StraightCoast())
    assert not finding.holds
    assert not finding.grave  # a bare coast before buildings looks the same
    assert said in finding.sentence
    assert "unless" in finding.sentence


@pytest.mark.parametrize("inland_m", [(1.0, 60.0), (1.0, 300.0)])
def test_buildings_from_the_coast_on_are_silent(inland_m):
    assert fixed_finding(buildings(inland_m, lambda far: far), np.zeros(2), StraightCoast()).holds
