"""Radar video as a sensor: kernels against twins, what a look at noise and at a ship says."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import EvidenceSensor
from elusive.errors import DataError
from elusive.sensors import _radar_video_kernels as kernels
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from tests.reference import radar_video as twin
from tests.reference.radar_video import level_sea

RADAR = RadarVideo(beam_deg=9.0, pulse_m=40.0, start_m=100.0, step_m=10.0, samples=128)

NOTHING = *(np.zeros(shape) for shape in ((0, 4), (0, 4, 4), (0, 7), (0, 2), 0)), np.zeros(0, np.int64)


def turn_of(evidence, time_s=2.0, place=(0.0, 0.0)):
    rows, evidence = len(evidence), evidence.astype(np.float32)
    row_s, ones = time_s - 2.0 + 2.0 * np.arange(rows) / rows, np.ones_like(evidence)
    return EvidenceTurn(time_s, row_s, evidence, place, ones, ones, level_sea(ones))


def test_it_is_a_sensor_of_maps():
    assert isinstance(RADAR, EvidenceSensor)


def test_peaks_are_those_of_the_twin():
    rng = np.random.default_rng(2)
    evidence = rng.exponential(size=(20, 30)).astype(np.float32)
    claimed = (rng.random(evidence.shape) < 0.2).astype(np.float32)
    row, column = kernels.peaks(evidence, 1.0, claimed, 999)
    assert list(zip(row.tolist(), column.tolist(), strict=True)) == twin.peaks(evidence, 1.0, claimed)


def test_a_look_is_that_of_the_twin():
    rng = np.random.default_rng(3)
    evidence = rng.exponential(1.5, (40, 30))
    evidence[7, 3:6] = np.nan
    grid, sd, ratios = (105.0, 20.0, 0.08), (12.0, 0.04), np.array([1.5, 5.0, 30.0])
    claimed = np.where(rng.random(evidence.shape) < 0.2, rng.random(evidence.shape), 0.0).astype(np.float32)
    ones = np.ones(evidence.shape, np.float32)
    for azimuth, worth in ((0.01, 1.0), (1.1, 0.7), (3.1, 1.0), (6.2, 0.3)):
        mean = np.array([300 * np.sin(azimuth), 4.0, 300 * np.cos(azimuth), -3.0])
        root = rng.normal(0, 1, (4, 4)) * [[20.0], [3.0], [20.0], [3.0]]
        covariance, weights = root @ root.T + np.diag([50.0, 4.0, 50.0, 4.0]), np.array([0.5, 0.3, 0.2])
        ratio, middle, spread, after = twin.look(
            mean, covariance, weights, worth * evidence, grid, sd, ratios, 3.0, claimed
        )
        means, covariances, levels, log_ratio = mean[None].copy(), covariance[None].copy(), weights[None].copy(), [0.0]
        log_ratio = np.zeros(1)
        kernels.look(
            means, covariances, np.zeros(1), levels, np.full(1, worth), np.zeros(1, np.int64), np.zeros(1, np.int64),
            evidence.astype(np.float32), grid, sd, ratios, 3.0, -3.0, ones, tuple(level_sea(ones)), claimed.copy(),
            log_ratio,
        )  # fmt: skip
        np.testing.assert_allclose(log_ratio[0], ratio, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(means[0], middle, rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(covariances[0], spread, rtol=1e-3, atol=1e-2)
        beside = np.array([after[0] + after[1], after[0] + after[2], after[1] + after[2]])
        np.testing.assert_allclose(levels[0], 0.96 * after + 0.02 * beside, rtol=1e-4)


def test_a_target_is_looked_for_from_where_the_radar_was_as_the_beam_passed():
    radar, rng = RadarVideo(step_m=10.0, pulse_m=20.0, start_m=100.0, samples=200), np.random.default_rng(5)
    evidence = rng.exponential(size=radar.shape).astype(np.float32)
    row, column = 40, 90
    evidence[row, column] = 30.0
    ones, row_place = np.ones_like(evidence), np.linspace([-9.0, 6.0], [9.0, -6.0], len(evidence))
    stands, sails = (
        EvidenceTurn(0.0, np.zeros(len(ones)), evidence, (0.0, 0.0), ones, ones, level_sea(ones), places)
        for places in (None, row_place)
    )
    at, way = radar.places()[row, column], row_place[row]
    mean, covariance = np.zeros((1, 4)), np.diag([900.0, 25.0, 900.0, 25.0])[None]
    mean[0, [0, 2]] = at + np.array([20.0, -10.0])
    told = np.zeros((1, 2)), np.full(1, 0.5), np.zeros(1, np.int64)
    levels = np.full((1, len(radar.ratios)), 1 / len(radar.ratios))
    first = radar.look(mean, covariance, levels, *told, stands, 3.0)
    mean[0, [0, 2]] += way
    second = radar.look(mean, covariance, levels, *told, sails, 3.0)
    # the belief's middle was in another row
    np.testing.assert_allclose(second.mean[0, [0, 2]], first.mean[0, [0, 2]] + way, atol=0.5)
    np.testing.assert_allclose(second.log_ratio, first.log_ratio, atol=0.05)
    assert (radar.cells((at + way)[None], sails), radar.cells(at[None], stands)) == (([row], [column]),) * 2
    begun = radar.beginnings(sails, second._replace(claimed=np.zeros_like(evidence)), 13.0, 9)
    np.testing.assert_allclose(begun.places, [at + way])


def test_the_mean_about_a_target_is_that_of_the_twin():
    rng = np.random.default_rng(9)
    evidence, divided = rng.exponential(2.0, (23, 19)), rng.uniform(1, 3, (23, 19))
    evidence[3, 5] = evidence[6:18, :9] = np.nan
    row, column = (place.ravel() for place in np.indices(evidence.shape))
    found = kernels.mean_about(evidence.astype(np.float32), divided.astype(np.float32), row, column, 7, 3, 3.0)
    np.testing.assert_allclose(found, twin.mean_at(evidence * divided, row, column, 7, 3, 3.0), rtol=1e-5)
    assert np.isnan(found).any()


def test_what_one_target_explains_is_no_other_targets_and_its_own_parts_share_it():
    """Two parts of a target learn as much of an echo as either alone; of two targets the second learns nothing."""
    evidence = np.full(RADAR.shape, 0.5)
    evidence[9, 20] = 12.0
    mean = np.zeros((2, 4))
    mean[:, [0, 2]] = RADAR.range_m[20] * np.array([np.sin(RADAR.azimuth_rad[9]), np.cos(RADAR.azimuth_rad[9])])
    covariance = np.tile(np.diag([400.0, 25.0, 400.0, 25.0]), (2, 1, 1))
    levels = np.full((2, len(RADAR.ratios)), 1 / len(RADAR.ratios))

    def said(number):
        return RADAR.look(
            mean, covariance, levels, np.zeros((2, 2)), np.array([0.5, 0.4]), np.array(number), turn_of(evidence), 2.5
        )  # fmt: skip

    one, two = said([3, 3]), said([3, 4])
    assert one.log_ratio[0] == one.log_ratio[1] == two.log_ratio[0] > 3
    assert two.log_ratio[1] < 1
    ratio = np.exp(one.log_ratio[0])
    assert one.claimed[9, 20] == pytest.approx(0.9 * ratio / (0.1 + 0.9 * ratio), rel=1e-6)


def test_noise_alone_speaks_neither_for_nor_against_a_target():
    """The mean likelihood ratio over noise is 1, whatever is expected."""
    rng = np.random.default_rng(4)
    n, trials = 40, 400
    azimuth = np.linspace(0, 2 * np.pi, n, endpoint=False)
    mean = np.zeros((n, 4))
    mean[:, 0], mean[:, 2] = 700 * np.sin(azimuth), 700 * np.cos(azimuth)
    covariance = np.tile(np.diag([900.0, 25.0, 900.0, 25.0]), (n, 1, 1))
    weak = RADAR.replace(levels_db=(-3.0, 0.0))  # of stronger ones the ratio has no variance to be measured by
    levels, nothing, found = np.full((n, 2), 0.5), np.zeros((n, 2)), []
    for _ in range(trials):
        evidence = rng.exponential(size=RADAR.shape)
        found.append(
            np.exp(
                weak.look(
                    mean, covariance, levels, nothing, np.full(n, 1e-6), np.arange(n), turn_of(evidence), 3.5
                ).log_ratio
            )
        )
    means = np.mean(found, axis=1)  # of a map's targets, which share cells
    assert abs(means.mean() - 1) < 4 * means.std() / np.sqrt(trials)


def test_what_has_sailed_out_of_reach_is_no_target_in_view():
    reach = float(RADAR.range_m[-1])
    mean = np.zeros((3, 4))
    mean[:, 2] = 0.5 * reach, reach, reach + 4 * RADAR.cell_m
    covariance = np.tile(np.diag([900.0, 25.0, 900.0, 25.0]), (3, 1, 1))
    levels = np.full((3, len(RADAR.ratios)), 1 / len(RADAR.ratios))
    unknown = np.full(RADAR.shape, np.nan)
    looked = RADAR.look(
        mean, covariance, levels, np.zeros((3, 2)), np.full(3, 0.9), np.arange(3), turn_of(unknown), 2.5
    )
    np.testing.assert_allclose(looked.log_ratio, [0, 0, -np.inf], atol=1e-9)
    np.testing.assert_allclose(
        looked.covariance, covariance, rtol=0.02, atol=2.0
    )  # where nothing is seen, nothing is learnt


def test_one_that_may_be_in_any_cell_is_somewhere_in_view():
    """Its density integrates to 1, over rings of a cell's depth."""
    turn = turn_of(np.zeros(RADAR.shape), place=(30.0, -20.0))
    middles = RADAR.places()[:, 2:].reshape(-1, 2) + turn.place
    area = RADAR.cell_m * 2 * np.pi / RADAR.shape[0] * np.hypot(*(middles - turn.place).T)
    share = 1 - 2 / RADAR.shape[1]
    np.testing.assert_allclose(RADAR.density(middles, turn) @ area, share, rtol=1e-12)


def test_a_map_of_another_size_is_refused():
    with pytest.raises(DataError, match="cells"):
        RADAR.look(*NOTHING, turn_of(np.zeros((3, 4))), 3.0)


def test_what_begins_is_where_the_peaks_are_with_the_ratio_of_their_neighbourhood():
    """Of cells that stand out: one in the others is not seen, and stays among those."""
    evidence = np.full(RADAR.shape, 0.1)
    evidence[5, 9], evidence[5, 10], evidence[6, 9] = 8.2, 8.0, 3.9
    turn = turn_of(evidence, place=(50.0, 0.0))
    none = RADAR.look(*NOTHING, turn, 3.0)
    new = RADAR.beginnings(turn, none, 4.0, 100)
    place = [50 + RADAR.range_m[9] * np.sin(RADAR.azimuth_rad[5]), RADAR.range_m[9] * np.cos(RADAR.azimuth_rad[5])]
    np.testing.assert_allclose(new.places, [place])
    np.testing.assert_allclose(new.time_s, [turn.row_s[5]])
    rho = RADAR.ratios
    cells = np.array([8.2, 8.0])[:, None]
    np.testing.assert_allclose(new.ratio[0], twin.ratio_of(cells, rho).sum(axis=0) / 9, rtol=1e-5)


def test_noise_begins_no_more_than_it_takes_of_those_that_nobody_follows():
    """Else their number grows from turn to turn: half as many again began as were taken."""
    weak, begun, taken = RADAR.replace(levels_db=(1.5, 4.0)), [], []
    rng, nothing = np.random.default_rng(6), (*NOTHING[:2], np.zeros((0, 2)), *NOTHING[3:])
    for _ in range(300):
        turn = turn_of(rng.exponential(size=RADAR.shape))
        new = weak.beginnings(turn, weak.look(*nothing, turn, 3.0), 3.0, 10_000)
        begun.append(new.share * new.ratio.sum(axis=0))
        taken.append(new.seen)
    error = np.std(begun, axis=0) / np.sqrt(len(begun))
    assert (np.mean(begun, axis=0) < np.mean(taken, axis=0) + 3 * error).all()
    assert (np.mean(begun, axis=0) > 0.5 * np.mean(taken, axis=0)).all()


@pytest.mark.parametrize("strongest", [12.0, 20.0, 40.0])
def test_one_cell_is_no_sure_ship_however_rare(strongest):
    """Where the law of clutter is extrapolated: single spikes of evidence 15 to 40 were ships of .98 and more."""
    evidence = np.full(RADAR.shape, 1.0)
    evidence[5, 9] = strongest
    turn = turn_of(evidence)
    new = RADAR.beginnings(turn, RADAR.look(*NOTHING, turn, 3.0), 4.0, 100)
    odds = new.share * float(new.ratio[0].mean())
    assert 0.02 < odds < 1.5
    weaker = turn_of(np.where(evidence == strongest, strongest - 1, evidence))
    before = RADAR.beginnings(weaker, RADAR.look(*NOTHING, weaker, 3.0), 4.0, 100)
    assert (new.ratio > before.ratio).all()  # the stronger of two is still told


@pytest.mark.parametrize("level_db", [-3.0, 0.0, 6.0])
def test_what_a_target_says_is_the_law_of_two_exponentials(level_db):
    """What begins at a peak, and how many do, are Bayes': against evidence that is drawn."""
    radar = RADAR.replace(levels_db=(level_db,))
    rng = np.random.default_rng(8)
    n = 200_000
    drawn = rng.exponential(size=n) + np.where(rng.random(n) < 0.02, 0.0, rng.exponential(radar.ratios[0], n))
    none = RADAR.look(*NOTHING, turn_of(np.ones(RADAR.shape)), 3.0)
    seen = radar.beginnings(turn_of(np.zeros(RADAR.shape)), none, 4.0, 100).seen
    np.testing.assert_allclose(seen, (drawn > 4.0).mean(), atol=4 * np.sqrt(0.25 / n) + 0.02 * np.exp(-4))
    edges = np.array([0.0, 0.5, 1.0, 2.0, 3.0])
    to_noise = np.histogram(drawn, edges)[0] / n / -np.diff(np.exp(-edges))
    fine = np.linspace(0, 3, 3000, endpoint=False) + 0.0005
    number, weight = np.digitize(fine, edges) - 1, np.exp(-fine)
    within = np.bincount(number, weight * twin.ratio_of(fine, radar.ratios[0])) / np.bincount(number, weight)
    np.testing.assert_allclose(within, to_noise, rtol=0.05)


def echoes_of(shape, ships):
    """Power of echoes (row, column, decibels, rows and columns to half of it), and of a sea of 1 that is drawn."""
    rng = np.random.default_rng(12)
    row, column = np.indices(shape)
    wave = (rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2)
    for middle, near, level, across, along in ships:
        down = (row - middle + shape[0] / 2) % shape[0] - shape[0] / 2
        fall = 0.5 ** ((down / across) ** 2 + ((column - near) / along) ** 2)
        wave += np.sqrt(10 ** (level / 10) * fall) * np.exp(2j * np.pi * rng.random())
    return (np.abs(wave) ** 2).astype(np.float32)


def claimed_by(power, spots, existence=0.9, ratio=1.0):
    """Cells that targets claim one after the other, found at these spots."""
    claimed, n = np.zeros(power.shape, np.float32), len(spots)
    for k in range(n):
        kernels.claim(
            np.array([k]), np.full(n, existence), np.full(n, np.log(ratio)), np.array(spots), power,
            tuple(level_sea(power)), claimed,
        )  # fmt: skip
    return claimed


@pytest.mark.parametrize("spot", [(10, 33), (12, 30), (0, 40), (59, 2), (31, 62), (31, 71), (40, 20)])
def test_what_a_target_claims_is_that_of_the_twin(spot):
    """Across north, at an end of range, on a strong echo's flank, in the sea, beside a cell that was not received."""
    ships = [(11, 32, 30, 1.2, 3.0), (59.6, 41, 24, 0.8, 2.0), (0.5, 1, 26, 1.0, 2.5), (31, 64, 33, 1.0, 4.0)]
    power = echoes_of((60, 80), ships)
    power[12, 36] = np.nan
    expected = 0.9 * twin.claimed(power, *spot)
    np.testing.assert_allclose(claimed_by(power, [spot]), expected, rtol=1e-6)


def test_a_strong_echo_is_its_targets_as_far_as_it_shows_and_a_ship_beside_it_is_not():
    """What stood beyond two cells began ships beside the ship: 22 tracks too many in six recordings of two each."""
    ships = [(30, 40, 30, 1.5, 3.0), (30, 61, 24, 1.5, 3.0)]
    row, column = np.indices((60, 80))
    echo = 1000 * 0.5 ** (((row - 30) / 1.5) ** 2 + ((column - 40) / 3.0) ** 2)
    claimed = claimed_by(echoes_of((60, 80), ships[:1]), [(31, 42)]) > 0.5
    assert claimed[echo > 16].all()  # the sea's amplitude is four and more once in exp(16) cells
    assert claimed[echo > 16].sum() > 2 * 25
    assert not claimed[echo < 0.25].any()
    assert not (claimed_by(echoes_of((60, 80), ships), [(31, 42)]) > 0.5)[28:33, 58:65].any()
    faint = claimed_by(echoes_of((60, 80), []), [(30, 40)])
    assert (faint[28:33, 38:43] > 0).all()


def test_a_target_claims_as_much_as_it_is_likely():
    """Parts of one exclude each other; what hardly exists claims nothing."""
    power = echoes_of((60, 80), [(30, 40, 20, 1.0, 2.0)])
    np.testing.assert_allclose(claimed_by(power, [(30, 40)], 0.2, 3.0).max(), 0.6 / 1.4, rtol=1e-6)
    assert not claimed_by(power, [(30, 40)], 0.04).any()
    np.testing.assert_allclose(claimed_by(power, [(30, 40), (31, 40)], 0.7).max(), 1.0)
