"""The scale of evidence along a way: of what is exponential, in clutter as it was learnt, in rain, about a ship."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.turn_evidence import as_in_turn
from elusive.sensors.evidence_scale import LEARNT, MOST, remembered, scale_along, scale_of
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from tests.reference.radar_video import level_sea

RADAR = RadarVideo(beam_deg=6.0, pulse_m=40.0, start_m=100.0, step_m=10.0, samples=160, levels_db=(0.0,))


@pytest.mark.parametrize("scale", [0.5, 1.0, 1.6, 4.0])
def test_the_scale_is_that_of_what_is_exponential(scale):
    drawn = scale * np.random.default_rng(0).exponential(size=200_000)
    mean = np.minimum(drawn, MOST).mean()
    assert scale_of(mean, 0.0, 1e-9) == pytest.approx(scale, rel=0.02)  # four errors, of a fifth of a turn's at most
    assert scale_of(mean, 100.0, 101.0) == 1.0
    assert scale_of(LEARNT, 0.0, 1e-9) == pytest.approx(1.0, rel=0.01)  # of the table


def test_what_was_not_received_is_not_remembered():
    before = np.array([[3.0, 2.0], [3.0, 2.0]])
    after = remembered(before, np.array([np.nan, 1.5]))
    np.testing.assert_allclose(after, [[2.7, 1.8], [4.2, 2.8]])
    assert scale_along(np.zeros((1, 2)))[0] == 1.0  # of a new target


def looked_at(scale, ship, turns=30):
    """Scale along the ways of forty targets that stand, and their ratios, in clutter of this scale under ships."""
    rng, n = np.random.default_rng(7), 40
    row, column = np.linspace(0, RADAR.shape[0], n, endpoint=False).astype(int), np.full(n, 35)
    mean = np.zeros((n, 4))
    mean[:, [0, 2]] = RADAR.places()[row, column]
    covariance, levels = np.tile(np.diag([400.0, 9.0, 400.0, 9.0]), (n, 1, 1)), np.ones((n, 1))
    background, scales, ratios = np.zeros((n, 2)), [], []
    for _ in range(turns):
        evidence = scale * rng.exponential(size=RADAR.shape).astype(np.float32)
        if ship:
            for down in range(-2, 3):
                for right in range(-2, 3):
                    evidence[(row[::4] + down) % len(evidence), column[::4] + right] += ship
        seen = as_in_turn(evidence)
        ones = np.ones_like(evidence)
        turn = EvidenceTurn(
            0.0, np.zeros(len(ones)), seen.evidence, (0.0, 0.0), seen.divided, ones, level_sea(ones)
        )  # fmt: skip
        looked = RADAR.look(mean, covariance, levels, background, np.full(n, 1e-6), np.arange(n), turn, 2.5)
        background = looked.background
        scales.append(scale_along(background))
        ratios.append(np.exp(looked.log_ratio))
    return np.array(scales), np.array(ratios)


def test_clutter_as_it_was_learnt_is_not_divided():
    """A mean of 56 cells of .95 has a deviation of .11, along ten turns of .025: four of these to where it begins."""
    scales, ratios = looked_at(1.0, 0.0)
    assert (scales == 1.0).mean() > 0.99
    assert scales.max() < 1.1
    assert ratios.mean() == pytest.approx(1.0, abs=0.02)


def test_a_strong_ship_fills_none_of_the_cells_that_count():
    assert looked_at(1.0, 25.0)[0][:, ::4].max() < 1.05


def test_rain_that_a_turn_does_not_show_speaks_for_no_target():
    """Of six tenths more. By their turns alone ratios were 1.4 on the mean, turn after turn: a sure ship of chance."""
    scales, ratios = looked_at(1.6, 0.0)
    assert np.median(scales[15:]) == pytest.approx(1.6, rel=0.15)  # two of twelve turns are supposed to be as learnt
    assert ratios[:2].mean() > 1.2
    assert ratios[15:].mean() == pytest.approx(1.0, abs=0.12)
