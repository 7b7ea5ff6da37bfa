"""Scores of several targets against motmetrics, Stone Soup and cases counted by hand."""

from __future__ import annotations

import datetime
import itertools
import warnings

import numpy as np
import pytest

from elusive.errors import DataError, ParameterError
from elusive.metrics import clear_mot, gospa, identity, ospa, sightings, sightings_of

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import motmetrics

GATE = 2.0


def scene(seed, frames=60, targets=5):
    """Walkers that come and go, followed by tracks that err, break off, swap and are invented."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.normal(0, 0.7, (frames, targets, 2)), axis=0) + rng.uniform(-4, 4, (targets, 2))
    truth[rng.random((frames, targets)) < 0.1] = np.nan
    found = truth + rng.normal(0, 0.8, truth.shape)
    found[rng.random((frames, targets)) < 0.15] = np.nan
    for when in rng.integers(frames, size=4):
        found[when:] = found[when:, rng.permutation(targets)]
    invented = rng.uniform(-6, 6, (frames, 2, 2))
    invented[rng.random((frames, 2)) < 0.7] = np.nan
    return truth, np.concatenate([found, invented], axis=1)


def by_motmetrics(truth, tracks):
    accumulator = motmetrics.MOTAccumulator(auto_id=True)
    for true, placed in zip(truth, tracks, strict=True):
        rows, columns = (np.flatnonzero(np.isfinite(one[:, 0])) for one in (true, placed))
        apart = np.linalg.norm(true[rows, None] - placed[None, columns], axis=2)
        accumulator.update(rows, 100 + columns, np.where(apart <= GATE, apart, np.nan))
    names = ["num_misses", "num_false_positives", "num_switches", "mota", "motp"]
    names += ["idf1", "idp", "idr", "idtp", "idfp", "idfn"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return motmetrics.metrics.create().compute(accumulator, metrics=names, name="own").loc["own"]


@pytest.mark.parametrize("seed", range(20))
def test_equal_to_motmetrics(seed):
    truth, tracks = scene(seed)
    theirs = by_motmetrics(truth, tracks)
    ours = clear_mot(sightings_of(truth), sightings_of(tracks), GATE)
    counts = [int(part.sum()) for part in (ours.misses, ours.false_positives, ours.mismatches)]
    assert counts == [theirs.num_misses, theirs.num_false_positives, theirs.num_switches]
    assert min(counts) > 0
    assert ours.mota == pytest.approx(theirs.mota, abs=1e-12)
    assert ours.motp == pytest.approx(theirs.motp, abs=1e-12)
    pairs = identity(sightings_of(truth), sightings_of(tracks), GATE)
    assert list(pairs) == [theirs.idtp, theirs.idfp, theirs.idfn]
    assert [pairs.idf1, pairs.precision, pairs.recall] == pytest.approx([theirs.idf1, theirs.idp, theirs.idr])


def test_by_hand():
    """Two targets; the tracks swap in frame 2, one is lost in 3, and something is invented in 4."""
    truth = np.array([[[0.0, 0.0], [10.0, 0.0]]] * 5)
    a, b = [0.5, 0.0], [10.0, 1.0]
    none = [np.nan, np.nan]
    tracks = np.array([[a, b, none], [a, b, none], [b, a, none], [b, none, none], [b, a, [5.0, 5.0]]])
    scored = clear_mot(sightings_of(truth), sightings_of(tracks), GATE)
    assert scored.targets.tolist() == [2] * 5
    assert scored.misses.tolist() == [0, 0, 0, 1, 0]
    assert scored.mismatches.tolist() == [0, 0, 2, 0, 0]
    assert scored.false_positives.tolist() == [0, 0, 0, 0, 1]
    assert scored.mota == pytest.approx(1 - 4 / 10)
    assert scored.motp == pytest.approx((4 * 0.5 + 5 * 1.0) / 9)
    assert scored.max_deviation == 1.0
    pairs = identity(sightings_of(truth), sightings_of(tracks), GATE)
    assert list(pairs) == [5, 5, 5]


def test_a_pair_is_kept_though_another_is_nearer():
    truth = np.array([[[0.0, 0.0]]] * 2)
    tracks = np.array([[[0.1, 0.0], [5.0, 0.0]], [[1.9, 0.0], [0.0, 0.0]]])
    scored = clear_mot(sightings_of(truth), sightings_of(tracks), GATE)
    assert scored.mismatches.sum() == 0
    assert scored.deviations.tolist() == pytest.approx([0.1, 1.9])


def test_rows_in_any_order_are_the_same():
    _, tracks = scene(3)
    table = sightings_of(tracks)
    order = np.random.default_rng(0).permutation(len(table.frame))
    shuffled = sightings(table.frame[order], table.identity[order], table.place[order])
    for ours, theirs in zip(table, shuffled, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def by_every_pairing(true, placed, cutoff, order):
    """OSPA and GOSPA by trying every assignment."""
    small, large = sorted((true, placed), key=len)
    best_ospa, best_gospa = np.inf, np.inf
    for choice in itertools.permutations(range(len(large)), len(small)):
        apart = np.array([np.linalg.norm(small[i] - large[j]) for i, j in enumerate(choice)])
        cut = (np.minimum(apart, cutoff) ** order).sum()
        best_ospa = min(best_ospa, cut + cutoff**order * (len(large) - len(small)))
        for paired in itertools.product([False, True], repeat=len(small)):
            used = np.array(paired, dtype=bool)
            single = len(large) + len(small) - 2 * used.sum()
            best_gospa = min(best_gospa, (apart[used] ** order).sum() + cutoff**order / 2 * single)
    most = len(large)
    return (best_ospa / most) ** (1 / order) if most else 0.0, best_gospa ** (1 / order)


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_set_distances_by_trying_every_assignment(order):
    rng = np.random.default_rng(5)
    for _ in range(60):
        true, placed = (rng.uniform(-2, 2, (1, rng.integers(5), 2)) for _ in range(2))
        tables = sightings_of(true), sightings_of(placed)
        expected = by_every_pairing(true[0], placed[0], 1.5, order)
        assert ospa(*tables, 1.5, order, frames=1)[0] == pytest.approx(expected[0])
        found = gospa(*tables, 1.5, order, frames=1)
        assert found.distance[0] == pytest.approx(expected[1])
        parts = found.localisation[0] + found.missed[0] + found.false[0]
        assert parts ** (1 / order) == pytest.approx(found.distance[0])


@pytest.mark.parametrize("seed", range(3))
def test_set_distances_equal_stone_soup(seed):
    from stonesoup.metricgenerator.ospametric import GOSPAMetric, OSPAMetric
    from stonesoup.types.state import State

    truth, tracks = scene(seed, frames=25)
    now = datetime.datetime(2017, 1, 1, tzinfo=datetime.UTC)
    # of order 1: for others Stone Soup assigns by the distance, not by its power, which is not the least
    ours = ospa(sightings_of(truth), sightings_of(tracks), GATE, 1.0, frames=25)
    parts = gospa(sightings_of(truth), sightings_of(tracks), GATE, 2.0, frames=25)
    for frame in range(25):
        true, placed = (
            [State(place[:, None], timestamp=now) for place in one[frame] if np.isfinite(place[0])]
            for one in (truth, tracks)
        )
        theirs = OSPAMetric(c=GATE, p=1.0).compute_OSPA_distance(placed, true).value
        assert ours[frame] == pytest.approx(theirs, abs=1e-9)
        metric, _ = GOSPAMetric(c=GATE, p=2.0).compute_gospa_metric(placed, true)
        assert parts.distance[frame] == pytest.approx(metric.value["distance"], abs=1e-9)
        assert parts.missed[frame] == pytest.approx(metric.value["missed"], abs=1e-9)
        assert parts.false[frame] == pytest.approx(metric.value["false"], abs=1e-9)


def test_nobody_and_nothing():
    nobody = sightings_of(np.full((3, 2, 2), np.nan))
    one = sightings([0, 1], [7, 7], [[0.0, 0.0], [1.0, 0.0]])
    scored = clear_mot(nobody, one, frames=3)
    assert np.isnan(scored.mota)
    assert scored.false_positives.tolist() == [1, 1, 0]
    assert ospa(nobody, one, frames=3).tolist() == [2.0, 2.0, 0.0]
    missed = clear_mot(one, sightings([], [], np.empty((0, 2))))
    assert missed.mota == 0.0
    assert np.isnan(missed.motp)
    assert identity(one, nobody).idf1 == 0.0
    assert np.isnan(identity(nobody, nobody).idf1)


TABLE = sightings([0], [0], [[0.0, 0.0]])


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: sightings([0, 0], [1, 1], [[0, 0], [1, 1]]), "1 is twice in frame 0"),
        (lambda: sightings([0], [1, 2], [[0, 0]]), "1 frames, 2 identities, 1 places"),
        (lambda: sightings([0.5], [1], [[0, 0]]), "frame holds what is no whole number"),
        (lambda: sightings([0], [np.nan], [[0, 0]]), "identity holds what is no whole number"),
        (lambda: sightings([-1], [1], [[0, 0]]), "frame -1 is below zero"),
        (lambda: sightings([0], [1], [[0, np.nan]]), "row 0: the place is not finite"),
        (lambda: sightings_of(np.zeros((3, 2))), r"has shape \(3, 2\)"),
        (lambda: clear_mot(TABLE, sightings([0], [0], [[0, 0, 0]])), "3 components, those of the truth 2"),
        (lambda: clear_mot(TABLE, sightings([4], [0], [[0, 0]]), frames=4), "a row is in frame 4"),
    ],
)
def test_refused_data(call, sentence):
    with pytest.raises(DataError, match=sentence):
        call()


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: clear_mot(TABLE, TABLE, 0.0), "gate: must be above zero"),
        (lambda: identity(TABLE, TABLE, -1.0), "gate: must be above zero"),
        (lambda: ospa(TABLE, TABLE, 0.0), "cutoff: must be above zero"),
        (lambda: gospa(TABLE, TABLE, 1.0, 0.5), "order: must be 1 or more"),
    ],
)
def test_refused_parameters(call, sentence):
    with pytest.raises(ParameterError, match=sentence):
        call()
