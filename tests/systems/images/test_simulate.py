"""Simulated targets meet where and when they are to, and each is there as long as it is said to be."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from elusive.errors import ParameterError
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.systems.images.simulate import ImageSimulation, draw_images

STRAIGHT = WithIntensity(motion=ConstantVelocity(q=1e-12), q_intensity=0.0)
LONG = {"frames": 60, "rows": 64, "columns": 64, "appears": 5, "leaves": 55, "motion": STRAIGHT}


def apart(truth: np.ndarray) -> np.ndarray:
    """Distances of all pairs over time, ``(T, pairs)``."""
    pairs = itertools.combinations(range(truth.shape[1]), 2)
    return np.stack([np.hypot(*(truth[:, a] - truth[:, b]).T) for a, b in pairs], axis=1)


@pytest.mark.parametrize("targets", [2, 3, 5])
@pytest.mark.parametrize("layout", ["crossing", "head-on", "parallel"])
def test_targets_meet_halfway(layout: str, targets: int) -> None:
    scene = ImageSimulation(**LONG, targets=targets, layout=layout, spacing_px=4.0, stagger=2)
    truth = draw_images(scene).truth
    there = np.isfinite(truth[..., 0])
    starts, ends = there.argmax(axis=0), 59 - there[::-1].argmax(axis=0)
    np.testing.assert_array_equal(starts, 5 + 2 * np.arange(targets))
    np.testing.assert_array_equal(ends, 55 - 2 * np.arange(targets)[::-1])
    assert (there.sum(axis=0) == ends - starts + 1).all()
    distances = apart(truth)
    np.testing.assert_allclose(truth[30].mean(axis=0), [31.5, 31.5], atol=2.1)  # an odd target stands aside
    if layout == "crossing":
        np.testing.assert_allclose(distances[30], 0.0, atol=1e-3)
        assert np.nanmin(distances[12]) > 4.0 or targets == 5
    elif layout == "parallel":
        np.testing.assert_allclose(np.nanmin(distances), 4.0, atol=1e-3)
        np.testing.assert_allclose(np.nanmax(distances), 4.0 * (targets - 1), atol=1e-3)
    else:
        met = [pair for pair in distances.T if np.nanmin(pair) < 1e-3]
        assert len(met) == targets // 2
        assert all(np.nanargmin(pair) == 30 for pair in met)
        assert np.nanmax(np.diff(met[0][31:50])) == pytest.approx(2 * np.hypot(0.45, 0.25), rel=1e-3)


def test_a_recording_that_ends_before_the_target_leaves_shows_it_to_the_end() -> None:
    short = ImageSimulation(frames=20, snr_db=9.0)
    truth = draw_images(short).truth[:, 0, 0]
    np.testing.assert_array_equal(np.flatnonzero(np.isfinite(truth)), np.arange(5, 20))
    np.testing.assert_array_equal(truth, draw_images(short.replace(leaves=19)).truth[:, 0, 0])


def test_every_target_has_its_own_strength_in_the_range() -> None:
    scene = ImageSimulation(**LONG, targets=40, stagger=0, snr_db=5.0, strongest_snr_db=15.0, seed=3, layout="parallel")
    drawn = draw_images(scene)
    assert np.ptp(drawn.frames) > np.ptp(draw_images(scene.replace(strongest_snr_db=None)).frames)
    same = draw_images(scene.replace(strongest_snr_db=5.0))
    np.testing.assert_array_equal(np.isfinite(same.truth), np.isfinite(drawn.truth))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            {"layout": "crossing", "targets": 5, "stagger": 7},
            "5 targets that appear 7 frames one after the other",
        ),
        ({"strongest_snr_db": 3.0, "snr_db": 9.0}, "strongest_snr_db: is 3 dB, less than snr_db, 9 dB"),
        ({"layout": "astray"}, "layout"),
    ],
)
def test_what_does_not_meet_is_refused(given: dict[str, object], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        ImageSimulation(**{**LONG, **given})
