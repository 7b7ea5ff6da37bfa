"""Two targets that contest a detection: their joint samples are weighed as by a sum over all joint associations."""

from itertools import product

import numpy as np
import pytest

from elusive.filters.particle import _kernels
from elusive.tracking.detection_doubles import merged
from elusive.tracking.detection_pairs import QUIET, paired, redrawn
from elusive.tracking.detection_targets import Evidence, Expected, Pair, Target
from elusive.tracking.lifecycle import Life

N, M = 40, 4


def target(number, particles, weights, pair=None):
    moments = _kernels.moments(particles, weights)
    life = Life(number, "confirmed")
    return Target(life, 0.999, particles, weights, *moments, weights, -1, 0.0, 1.0, False, 0.0, None, pair)


def scene(seed, held=True, quiet=0):
    """Two targets, what a scan says of each, its marginal probabilities, and the intensities of nothing known."""
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet(np.ones(N))
    alive, found, made = [], [], []
    for number, which in ((1, np.array([0, 1, 2])), (2, np.array([1, 2, 3]))):
        particles = np.asfortranarray(rng.normal(size=(N, 4)))
        pair = Pair(3 - number, quiet) if held else None
        alive.append(Expected.at_rest(target(number, particles, weights, pair)))
        likely, scale = rng.random((len(which) + 1, N)), rng.normal(size=len(which) + 1)
        known = weights * rng.random(N)
        found.append(Evidence(0.999, known / known.sum(), 1.0, False, which, likely, likely @ weights, scale))
        made.append(np.full(len(which), 0.3))
    return alive, found, made, rng.normal(size=M)


def summed(alive, found, log_new):
    """The slow sum over what each of the two made: a detection or none, and not the same."""
    total = np.zeros(N)
    for ways in product(*([-1, *range(len(its.which))] for its in found)):
        made = [its.which[way] for its, way in zip(found, ways, strict=True) if way >= 0]
        if len(set(made)) < len(made):
            continue
        part = np.ones(N)
        for its, way in zip(found, ways, strict=True):
            scale = 1.0 if way < 0 else np.exp(its.scale[way + 1] - log_new[its.which[way]])
            part *= its.likely[way + 1] * scale
        total += part
    weights = alive[0].weights
    for one, its in zip(alive, found, strict=True):
        total *= its.weights / one.weights
    return weights * total / (weights @ total)


@pytest.mark.parametrize("seed", range(3))
def test_joint_weights_are_those_of_all_joint_associations(seed):
    alive, found, made, log_new = scene(seed)
    joint = paired(alive, found, made, log_new, np.random.default_rng(0))
    for row, other in ((0, 2), (1, 1)):
        weights, pair = joint.after[row]
        assert pair == Pair(other, 0)
        np.testing.assert_allclose(weights, summed(alive, found, log_new), rtol=1e-9)


def test_targets_that_meet_are_drawn_together_independently_and_weighed_alike():
    alive, found, made, log_new = scene(5, held=False)
    joint = paired(alive, found, made, log_new, np.random.default_rng(1))
    np.testing.assert_allclose(joint.after[0][0], summed(joint.alive, joint.found, log_new), rtol=1e-9)
    for one, before in zip(joint.alive, alive, strict=True):
        rows = {tuple(row) for row in before.particles}
        assert {tuple(row) for row in one.particles} <= rows
        assert not np.array_equal(one.particles, before.particles)


def test_what_another_surely_made_is_left_to_it():
    alive, found, made, log_new = scene(6)
    third = Expected.at_rest(target(3, alive[0].particles, alive[0].weights))
    sure = found[0]._replace(which=np.array([1]), likely=np.ones((2, N)), total=np.ones(2), scale=np.zeros(2))
    joint = paired([*alive, third], [*found, sure], [*made, np.array([0.9])], log_new, np.random.default_rng(0))
    harder = log_new - np.log(np.where(np.arange(M) == 1, 0.1, 1.0))
    np.testing.assert_allclose(joint.after[0][0], summed(alive, found, harder), rtol=1e-9)
    assert 2 not in joint.after


@pytest.mark.parametrize(("quiet", "held"), [(QUIET - 1, True), (QUIET, False)])
def test_a_pair_parts_when_nothing_was_contested_for_a_while(quiet, held):
    alive, found, _, log_new = scene(7, quiet=quiet)
    apart = [np.array([0.9, 0.0, 0.0]), np.array([0.0, 0.0, 0.9])]
    joint = paired(alive, found, apart, log_new, np.random.default_rng(0))
    assert (len(joint.after) == 2) == held


def test_a_pair_is_drawn_anew_row_by_row_and_never_one():
    rng = np.random.default_rng(8)
    particles = np.asfortranarray(rng.normal(size=(N, 4)))
    weights = np.zeros(N)
    weights[:3] = 1 / 3
    two = [target(1, particles, weights, Pair(2, 0)), target(2, particles + 0.0, weights, Pair(1, 0))]
    after = redrawn(two, 0.5, 0.0, rng)
    np.testing.assert_array_equal(after[0].particles, after[1].particles)
    assert {tuple(row) for row in after[0].particles} == {tuple(row) for row in particles[:3]}
    alone = [one._replace(pair=None, existence=0.4) for one in two]
    detected = [alone[0], alone[1]._replace(detection=0)]
    assert [len(merged(these, 0.5)) for these in (two, alone)] == [2, 1]
    assert [merged(these, 0.5)[0].existence for these in (alone, detected)] == [0.4, 0.8]
    spread = alone[0]._replace(
        covariance=1e4 * alone[0].covariance
    )  # lost: whatever appears lies within its deviations
    assert [len(merged([spread, alone[1]], 0.5)), len(merged([alone[1], spread], 0.5))] == [2, 1]
