"""Radar video as a sensor: kernels against twins, spokes to turns, what a look at noise and at a ship says."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.contracts import EvidenceSensor
from elusive.errors import DataError
from elusive.sensors import _radar_video_kernels as kernels
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo, TurnGatherer
from elusive.sensors.spokes import Spokes
from tests.reference import radar_video as twin

RADAR = RadarVideo(beam_deg=9.0, pulse_m=40.0, start_m=100.0, step_m=10.0, samples=128)

NOTHING = *(np.zeros(shape) for shape in ((0, 4), (0, 4, 4), (0, 7), 0)), np.zeros(0, np.int64)


def turn_of(evidence, time_s=2.0, place=(0.0, 0.0)):
    rows = len(evidence)
    return EvidenceTurn(time_s, time_s - 2.0 + 2.0 * np.arange(rows) / rows, evidence.astype(np.float32), place)


def test_it_is_a_sensor_of_maps():
    assert isinstance(RADAR, EvidenceSensor)


@pytest.mark.parametrize("width", [0.0, 0.4, 2.7])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_spokes_are_gathered_as_by_the_twin(kind, width):
    rng = np.random.default_rng(1)
    amplitude, place = rng.integers(0, 200, (50, 13)).astype(kind), rng.uniform(0, 8, 50)
    place = np.floor(1000 * place) / 1000 + 0.0005  # between the points that the twin deals out
    time_s, received = rng.uniform(0, 2, 50), rng.random(50) < 0.8
    (total, roots), counted = np.zeros((2, 8, 4), np.float32), np.zeros((3, 8))
    kernels.gather(amplitude, time_s, received, place, width, 3, total, roots, counted)
    expected = twin.gathered(amplitude, time_s, received, place, width, 3, total.shape)
    for found, one in zip((total, roots, counted), expected, strict=True):
        np.testing.assert_allclose(found, one, rtol=1e-5 if width == 0 else 0.01)
    spokes = counted[0].copy()
    spokes[3] = 0
    found = kernels.overlap(total, spokes, 2, 2)
    np.testing.assert_allclose(found, twin.overlapped(total.astype(float), spokes, 2, 2), rtol=2e-5)


def test_clutter_averages_out_alike_in_all_rows():
    """Some rows held one spoke and others two: strong clutter was three times as frequent in those as in the others."""
    radar, rng = RadarVideo(beam_deg=2.0, step_m=10.0, pulse_m=20.0, samples=1600), np.random.default_rng(0)
    azimuth, nothing = 2 * np.pi * np.arange(512) / 512, np.full(512, np.nan)
    gatherer, turns = TurnGatherer(radar, 2 * np.pi / 512), []
    for number in range(6):
        amplitude = np.sqrt(rng.exponential(size=(512, 1600))).astype(np.float32)
        read = Spokes(
            2.0 * number + azimuth / 4, azimuth, True, 0.0, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1)
        )  # fmt: skip
        turns += gatherer.add(read, azimuth, (0.0, 0.0))
    power = np.concatenate([turn.power[:, :-1:2] for turn in turns], axis=1)
    np.testing.assert_allclose(power.mean(axis=1), 1.0, atol=0.06)  # 4000 cells of some 3 looks: six errors
    spread = power.var(axis=1)
    assert spread.max() < 1.4 * spread.min()  # 1.15, and errors of .04; it was 1.5, and these
    assert np.isfinite(turns[0].row_s).all()
    assert np.diff(turns[1].row_s).min() > 0


def test_rows_finer_than_spokes_are_all_received():
    """Cells of a beam told at half of what spokes are apart were all unknown."""
    radar = RadarVideo(beam_deg=1.0, step_m=10.0, pulse_m=20.0, samples=64)
    azimuth, nothing = 2 * np.pi * np.arange(300) / 300, np.full(300, np.nan)
    gatherer = TurnGatherer(radar, 2 * np.pi / 300)
    read = Spokes(
        azimuth, azimuth, True, 0.0, 10.0, np.ones((300, 64), np.float32), 0, nothing, np.stack([nothing] * 2, 1)
    )  # fmt: skip
    gatherer.add(read, azimuth, (0.0, 0.0))
    (turn,) = gatherer.rest((0.0, 0.0))
    np.testing.assert_allclose(turn.power[:, :-1], 1.0, rtol=1e-5)


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
    grid, sd, ratios = (105.0, 20.0, 0.08, 30.0, -20.0), (12.0, 0.04), np.array([1.5, 5.0, 30.0])
    claimed = np.where(rng.random(evidence.shape) < 0.2, rng.random(evidence.shape), 0.0).astype(np.float32)
    for azimuth in (0.01, 1.1, 3.1, 6.2):
        mean = np.array([30 + 300 * np.sin(azimuth), 4.0, -20 + 300 * np.cos(azimuth), -3.0])
        root = rng.normal(0, 1, (4, 4)) * [[20.0], [3.0], [20.0], [3.0]]
        covariance, weights = root @ root.T + np.diag([50.0, 4.0, 50.0, 4.0]), np.array([0.5, 0.3, 0.2])
        ratio, middle, spread, after = twin.look(mean, covariance, weights, evidence, grid, sd, ratios, 3.0, claimed)
        means, covariances, levels, log_ratio = mean[None].copy(), covariance[None].copy(), weights[None].copy(), [0.0]
        log_ratio = np.zeros(1)
        kernels.look(
            means, covariances, np.zeros(1), levels, np.zeros(1, np.int64), np.zeros(1, np.int64),
            evidence.astype(np.float32), grid, sd, ratios, 3.0, -3.0, claimed.copy(), log_ratio,
        )  # fmt: skip
        np.testing.assert_allclose(log_ratio[0], ratio, rtol=1e-4, atol=1e-5)
        np.testing.assert_allclose(means[0], middle, rtol=1e-4, atol=1e-3)
        np.testing.assert_allclose(covariances[0], spread, rtol=1e-3, atol=1e-2)
        np.testing.assert_allclose(levels[0], 0.98 * after + 0.02 / 3, rtol=1e-4)


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
            mean, covariance, levels, np.array([0.5, 0.4]), np.array(number), turn_of(evidence), 2.5
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
    levels, found = np.full((n, 2), 0.5), []
    for _ in range(trials):
        evidence = rng.exponential(size=RADAR.shape)
        found.append(
            np.exp(
                weak.look(mean, covariance, levels, np.full(n, 1e-6), np.arange(n), turn_of(evidence), 3.5).log_ratio
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
    looked = RADAR.look(mean, covariance, levels, np.full(3, 0.9), np.arange(3), turn_of(unknown), 2.5)
    np.testing.assert_allclose(looked.log_ratio, [0, 0, -np.inf], atol=1e-9)
    np.testing.assert_allclose(
        looked.covariance, covariance, rtol=0.02, atol=2.0
    )  # where nothing is seen, nothing is learnt


def test_turns_are_told_apart_and_a_point_is_where_it_is():
    radar, spokes, period = RADAR, 360, 2.0
    azimuth = 2 * np.pi * (np.arange(spokes) + 0.5) / spokes
    towards, distance = np.radians(77.0), 640.0
    off = (azimuth - towards + np.pi) % (2 * np.pi) - np.pi
    beam = np.exp(-4 * np.log(2) * (off / np.radians(9.0)) ** 2)
    pulse = np.exp(-0.5 * ((radar.start_m + 10.0 * np.arange(128) - distance) / 17.0) ** 2)
    amplitude = (1 + 100 * beam[:, None] * pulse).astype(np.float32)
    gatherer, turns = TurnGatherer(radar), []
    for number in range(3):
        for part in np.array_split(np.arange(spokes), 7):
            times = period * (number + part / spokes)
            nothing = np.full(len(part), np.nan)
            read = Spokes(
                times, azimuth[part], True, radar.start_m, 10.0, amplitude[part], 0, nothing, np.stack([nothing] * 2, 1)
            )  # fmt: skip
            turns += gatherer.add(read, azimuth[part], (5.0, 6.0))
    assert len(turns) == 2
    last = gatherer.rest((5.0, 6.0))[0]  # a recording of exactly one turn was refused
    np.testing.assert_allclose(last.row_s - turns[1].row_s, period)
    np.testing.assert_allclose(last.power, turns[1].power)
    assert not gatherer.rest((5.0, 6.0))
    assert turns[0].place == (5.0, 6.0)
    np.testing.assert_allclose(turns[1].row_s - turns[0].row_s, period)
    assert turns[0].time_s < period <= turns[1].row_s[0] + 0.1
    s_r, s_t = radar.deviations
    for power in (turns[0].power, turns[0].even):
        row, column = np.unravel_index(np.nanargmax(power), power.shape)
        assert abs(radar.range_m[column] - distance) < 1.5 * s_r
        assert abs(radar.azimuth_rad[row] - towards) < 1.5 * s_t
    assert (turns[0].even <= turns[0].power * (1 + 1e-5))[:, :-1].all()  # Jensen's inequality
    assert np.isnan(turns[0].even).all(axis=0).nonzero()[0].tolist() == [RADAR.shape[1] - 1]  # half a pulse is no cell


@pytest.mark.parametrize(("first", "last", "turns"), [(0, 360, 1), (6, 356, 1), (30, 360, 0), (0, 330, 0)])
def test_what_is_left_is_a_turn_from_north_to_north(first, last, turns):
    azimuth, gatherer, nothing = (
        np.radians(np.arange(first, last) + 0.5),
        TurnGatherer(RADAR),
        np.full(last - first, np.nan),
    )
    amplitude = np.ones((last - first, 128), np.float32)
    read = Spokes(
        azimuth, azimuth, True, RADAR.start_m, 10.0, amplitude, 0, nothing, np.stack([nothing] * 2, 1)
    )  # fmt: skip
    assert not gatherer.add(read, azimuth, (0.0, 0.0))
    assert len(gatherer.rest((0.0, 0.0))) == turns


def test_a_blanked_sector_is_not_received():
    """It was taken for calm, and its edges were sure ships; where others have no noise either it may be calm."""
    azimuth = 2 * np.pi * (np.arange(360) + 0.5) / 360
    for noise in (True, False):
        gatherer, turns = TurnGatherer(RADAR), []
        for number in range(2):
            amplitude = np.random.default_rng(number).integers(0 if noise else 1, 4, (360, 128)).astype(np.uint8)
            amplitude *= noise
            amplitude[:, 60] = 9
            amplitude[60:120] = 0
            times, nothing = 2.0 * (number + azimuth), np.full(360, np.nan)
            read = Spokes(
                times, azimuth, True, RADAR.start_m, 10.0, amplitude, 8, nothing, np.stack([nothing] * 2, 1)
            )  # fmt: skip
            turns += gatherer.add(read, azimuth, (0.0, 0.0))
        blank = (RADAR.azimuth_rad > np.radians(66)) & (RADAR.azimuth_rad < np.radians(114))
        assert (np.isnan(turns[0].power).all(axis=1) == (blank & noise)).mean() > 0.95
        assert not np.isnan(turns[0].power[~blank & (np.abs(RADAR.azimuth_rad - np.pi / 2) > 0.6), :-1]).any()
        assert np.isnan(turns[0].even[blank]).all() == noise
        assert np.isfinite(turns[0].row_s).all()


def test_spokes_full_of_another_radars_pulses_are_not_received():
    """They hid ships. A coast that fills a sector, or a ship, is received."""
    azimuth = 2 * np.pi * (np.arange(720) + 0.5) / 720
    gatherer, turns = TurnGatherer(RADAR), []
    for number in range(2):
        rng = np.random.default_rng(number)
        amplitude = rng.integers(0, 6, (720, 128)).astype(np.uint8)
        amplitude[200:300] *= 8
        amplitude[500:508, 60] = 200
        for spoke in (100, 400, 650):
            amplitude[spoke, rng.random(128) < 0.5] = 200
        nothing = np.full(720, np.nan)
        read = Spokes(
            2.0 * (number + azimuth), azimuth, True, RADAR.start_m, 10.0, amplitude, 8, nothing,
            np.stack([nothing] * 2, 1),
        )  # fmt: skip
        turns += gatherer.add(read, azimuth, (0.0, 0.0))
    assert turns[0].spoilt == 3
    lost = np.isnan(turns[0].power).all(axis=1)
    near = np.abs(RADAR.azimuth_rad[:, None] - azimuth[[100, 400, 650]]).min(axis=1)
    assert lost.any()
    assert near[lost].max() < 2 * RADAR.grid[2]
    assert np.isfinite(turns[0].row_s).all()


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
