"""Clutter that lasts for scans is told from ships by how long its tracks live."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.sensors.range_bands import BANDS
from elusive.systems.radar.first_pass import fitted
from elusive.systems.radar.lives import ERRORS, Lives, as_lived, gone_on, lasting_finding, short_lives
from elusive.systems.radar.moving import Ways
from elusive.systems.radar.parameters import RadarTracking
from elusive.systems.radar.recorded import RecordedRadar
from elusive.systems.radar.setting import bind_all
from elusive.systems.radar.ships import Surroundings
from elusive.systems.radar.survey import survey
from elusive.systems.radar.track import track_radar
from elusive.tracking.detection_targets import Target
from elusive.tracking.lifecycle import Life
from elusive.tracking.track import Track

WATCHED = 100  # scans
STRAIGHT = Ways(np.array([[0.0, 0.0, 0.0, 0.0, 1.0]]), np.zeros((1, 3, 4)), np.zeros((1, 3, 4, 4)))
ANYHOW = {3: STRAIGHT, 4: STRAIGHT}  # as the tracker lets tracks move


def lived(rng, clutter, ships, mean):
    """Band, scans of life and whether they ended, of tracks that begin at any time of a watch."""
    left = rng.uniform(1, WATCHED, clutter + ships)
    until = np.concatenate([rng.exponential(mean, clutter), np.full(ships, np.inf)])
    band = np.concatenate([rng.integers(0, 2, clutter), rng.integers(0, BANDS, ships)])
    return band, np.minimum(left, until), (until < left).astype(float)


def moved(rng, clutter, ships, known_mps=0.5):
    """Velocities of clutter, nine in ten alike, and of ships, as they are known to half a metre a second."""
    ways = np.where(rng.random((clutter, 1)) < 0.9, rng.normal([3.0, 4.0], 1.0, (clutter, 2)), 0.0)
    ways[ways[:, 0] == 0] = rng.normal(0, 8, ((ways[:, 0] == 0).sum(), 2))
    ways = np.concatenate([ways, rng.normal(0, 8, (ships, 2))])
    return ways + rng.normal(0, known_mps, ways.shape), np.tile(known_mps**2 * np.eye(2), (len(ways), 1, 1))


def test_short_lives_are_told_from_ships():
    rng = np.random.default_rng(2)
    band, scans, ended = lived(rng, 300, 24, 5.0)
    lives, short = short_lives(band, scans, ended, *moved(rng, 300, 24))
    drift, mean, ratio = lives[:4], lives[4], lives[5:]
    assert abs(mean - 5.0) < 4 * 5.0 / np.sqrt(300)
    assert np.abs(np.array(drift[:2]) - [3.0, 4.0]).max() < 4 * np.hypot(1.0, 0.5) / np.sqrt(270)
    assert abs(drift[2] - 1.0) < 4 * np.hypot(1.0, 0.5) ** 2 / np.sqrt(4 * 270)
    assert abs(drift[3] - 0.1) < 4 * np.sqrt(0.09 / 300)
    assert sum(ratio[2:]) < 1.0  # all of them came near the radar
    expected = (1 - ERRORS / np.sqrt(300)) * 150 / (4 + 1)
    assert expected / 3 < np.mean(ratio[:2]) < 3 * expected  # of four ships each
    assert short[:300][ended[:300] > 0].min() > 0.9
    assert short[300:][scans[300:] > 50].max() < 0.1


@pytest.mark.parametrize("seed", range(5))
def test_of_ships_alone_and_of_a_few_lost_ones_nothing_is_told(seed):
    rng = np.random.default_rng(seed)
    band, scans, ended = lived(rng, 6, 30, 5.0)
    assert short_lives(band, scans, ended, *moved(rng, 6, 30))[0] == ()
    assert lasting_finding(()).holds
    nothing = (np.zeros(0, kind) for kind in (np.int64, float, float))
    assert short_lives(*nothing, np.zeros((0, 2)), np.zeros((0, 2, 2)))[0] == ()


def test_existence_is_the_share_of_ships_among_those_that_lived_as_long():
    rng, mean, ratio = np.random.default_rng(3), 6.0, 8.0
    lives = 0, 0, 8, 1, mean, ratio, 0, 0, 0, 0, 0  # of any velocity
    life = np.where(rng.random(40_000) < 1 / (1 + ratio), np.inf, rng.exponential(mean, 40_000))
    for age in (0, 6, 12, 24):
        there = life[life >= age]
        share, error = np.mean(there == np.inf), np.sqrt(0.25 / len(there))
        track = Track(3, "confirmed", 1.0, np.zeros(4), np.eye(4))
        near, far = as_lived((track, track._replace(track=4)), {3: (age, 0), 4: (age, 5)}, lives, ANYHOW)
        assert abs(near.existence - share) < 4 * error
        assert near.status == ("confirmed" if near.existence > 0.9 else "candidate")
        assert (far.existence, far.status) == (1.0, "confirmed")
    assert "live 6 scans on the mean are as many as 8 to one" in lasting_finding(lives).sentence


def test_what_moves_otherwise_than_clutter_does_is_a_ship_sooner():
    """Existence is the share of ships among those of its velocity."""
    rng, ratio, n = np.random.default_rng(4), 8.0, 400_000
    lives = 3.0, 4.0, 1.0, 0.1, 6.0, ratio, 0, 0, 0, 0, 0
    ship = rng.random(n) < 1 / (1 + ratio)
    alike = ~ship & (rng.random(n) < 0.9)
    ways = np.where(alike[:, None], rng.normal([3.0, 4.0], 1.0, (n, 2)), rng.normal(0, 8, (n, 2)))
    ways += rng.normal(0, 0.5, (n, 2))
    for place in ([3.0, 4.0], [-4.0, 2.0]):
        near = np.hypot(*(ways - place).T) < 0.5
        track = Track(3, "confirmed", 1.0, np.array([0, place[0], 0, place[1]]), 0.25 * np.eye(4))
        (told,) = as_lived((track,), {3: (0, 0)}, lives, ANYHOW)
        share = ship[near].mean()
        assert abs(told.existence - share) < 4 * np.sqrt(0.25 / near.sum()) + 0.1 * share  # over half a metre a second


def test_a_ship_that_is_begun_anew_lives_on_and_groups_of_waves_do_not():
    """Six ships far apart, each lost and found 100 m away a scan later, and groups anywhere within a mile."""
    ships = np.column_stack([np.repeat(np.arange(0.0, 120.0, 12.0), 6), np.tile(np.arange(6) * 2e4, 10), np.zeros(60)])
    ships[:, 2] = 400.0 * (ships[:, 0] // 12)
    last = ships + np.array([11.0, 0.0, 300.0])
    assert (gone_on(ships, last)[:-6] == 1.0).all()
    assert (gone_on(ships, last)[-6:] == 0.0).all()
    found = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        groups = np.column_stack([np.sort(rng.uniform(0, 300, 150)), rng.uniform(-900, 900, (150, 2))])
        found.append(gone_on(groups, groups + np.array([4.0, 0.0, 0.0])).mean())
    # chance is known from some hundred and more ends: a share of them to a tenth
    assert np.mean(found) < 0.1


def test_lives_are_whole():
    for lives in ((3.0, 1.0), (0, 0, 8, 1, 0.0, *[1.0] * BANDS), (0, 0, 0, 1, 3.0, *[1.0] * BANDS)):
        with pytest.raises(ParameterError, match="scans above zero"):
            RecordedRadar(false_alarm_lives=lives)


def wave_groups(rng, scans):
    """Scans of groups of waves about the radar that last for two to six, and where two ships are then."""
    start, sail = np.array([[-1200.0, 500.0], [900.0, -1500.0]]), np.array([[6.0, 1.0], [-3.0, 5.0]])
    plots = [[] for _ in range(scans)]
    for k in range(-6, scans):
        for _ in range(rng.poisson(6)):
            place = (150 + rng.exponential(500)) * np.exp(1j * rng.uniform(0, 2 * np.pi))
            for j in range(rng.integers(2, 7)):
                if 0 <= k + j < scans and rng.random() < 0.7:
                    at = place + (3 + 4j) * 2.5 * j
                    plots[k + j].append((at.real, at.imag))
    for k in range(scans):
        plots[k] += [tuple(one) for one in start + 2.5 * k * sail if rng.random() < 0.9]
    found = []
    for k, places in enumerate(plots):
        far, angle = np.hypot(*np.array(places).T), np.arctan2(*np.array(places).T)
        far, angle = far + rng.normal(0, 10, len(far)), angle + rng.normal(0, 3e-3, len(far))
        each = [
            RadarPlot(2.5 * k, r, b % (2 * np.pi), np.nan) for r, b in zip(far.tolist(), angle.tolist(), strict=True)
        ]
        found.append(scan_of(2.5 * k, each))
    return found, lambda time_s: start + time_s * sail


def shown(scans, truth, parameters, faster_mps=0.0):
    """Rows of confirmed tracks of no ship, and the share of the scans in which ships have a track, confirmed or not."""
    seen = survey(scans)
    parameters, seen = fitted(parameters, scans, seen, Surroundings(), None)
    _, tracker, _ = bind_all(parameters, seen, Surroundings(), None)
    wrong, found = 0, []
    for step in track_radar(scans, tracker, parameters):
        places = np.array([track.mean[[0, 2]] for track in step.tracks]).reshape(-1, 1, 2)
        off = np.hypot(*(places - truth(step.time_s)).transpose(2, 0, 1))
        fast = [np.hypot(*track.mean[[1, 3]]) >= faster_mps for track in step.tracks]
        sure = np.array([track.status == "confirmed" for track in step.tracks], dtype=bool) & np.array(fast, dtype=bool)
        wrong += int((off.min(axis=1, initial=np.inf)[sure] > 100).sum())
        found.append((off.min(axis=0, initial=np.inf) < 100).mean())
    return wrong, np.mean(found)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", range(2))
def test_groups_of_waves_are_hardly_ships(seed):
    """Of rows of confirmed tracks that are of no ship, a tenth is left at most."""
    scans, truth = wave_groups(np.random.default_rng(seed), 60)
    before, _ = shown(scans, truth, RadarTracking(particles=400, radar={"false_alarm_lives": ()}))
    wrong, found = shown(scans, truth, RadarTracking(particles=400))
    assert wrong < before / 10
    assert found > 0.8


@pytest.mark.parametrize("stands", [0.0, 1.0])
def test_what_stands_does_not_say_how_often_ships_are_seen(stands):
    """A ship that is seen in nine of ten scans, and an echo that is in three."""
    lives, none = Lives(1.0), (np.zeros((0, 4)), np.zeros(0))
    for k in range(100):
        seen = (k % 10 > 0, k % 10 < 3)
        there = [
            Target(Life(n, "confirmed"), 1.0, *none, np.zeros(4), np.eye(4), none[1], hit - 1, 0.0, 1.0, False, 0.0)
            for n, hit in zip((3, 4), seen, strict=True)
        ]
        lives.add({3: (k, 0), 4: (k, 0)}, there, ANYHOW, {4: stands})
    detected, trials, _ = lives.sorted_out(every=True)
    assert trials == pytest.approx(200 - 100 * stands)
    assert detected == pytest.approx(0.9 if stands else 0.6, abs=0.01)
