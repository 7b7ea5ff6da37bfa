"""A target that may be a fixed echo instead: both kinds against the sum over what the detection may be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from elusive.sensors.radar import RadarSensor
from elusive.sensors.radar_scans import RadarPlot, scan_of
from elusive.tracking.detection_targets import Expected, Target, after_scan, evidence
from elusive.tracking.fixed_echoes import EchoScan, FixedEcho, NewEchoes, echo_after
from elusive.tracking.lifecycle import Life

SENSOR = RadarSensor(detection_probability=0.8, false_alarms=3.0, max_range_m=9000.0)
CLUTTER = -9.0  # logarithm of the intensity of the plot, if it is neither's


class Plain:
    """No land clutter; echoes as Gaussians, in range and bearing."""

    def log_scattered(self, scan):
        return np.full(scan.detections, -np.inf)

    def new(self, scan):
        return NewEchoes(np.full(scan.detections, -5.0), *SENSOR.places(scan))

    def log_densities(self, echoes, scan):
        places, errors = SENSOR.places(scan)
        densities = [
            [
                multivariate_normal.logpdf(place, echo.mean, echo.covariance + error)
                for place, error in zip(places, errors, strict=True)
            ]
            for echo in echoes
        ]
        return np.array(densities) + np.log(scan.range_m)


@pytest.mark.parametrize("pair", [0.7, 0.0])
def test_a_scan_divides_existence_among_target_echo_and_nothing(pair):
    rng = np.random.default_rng(1)
    particles = np.asfortranarray(
        np.column_stack([*rng.normal(0, 9, (2, 300)), 4000 + rng.normal(0, 9, 300), np.ones(300)])
    )
    weights = np.full(300, 1 / 300)
    echo = FixedEcho(0.5, np.array([5.0, 4010.0]), np.diag([40.0, 90.0]))
    moments = particles.mean(axis=0), np.cov(particles.T, bias=True)
    target = Target(Life(), 0.3, particles, weights, *moments, weights, 0, 0.0, 1.0, False, 0.0, echo)
    scan = scan_of(0.0, [RadarPlot(0.0, 4004.0, 0.001)])
    known = EchoScan.of(Plain(), SENSOR, scan, [echo], 6.0)
    which = np.array([0])
    assert known.near.tolist() == [[True]]
    found = evidence(Expected.at_rest(target), SENSOR, scan, which, np.array([CLUTTER]), 1e-6, known.of_row(0, which))
    itself = 0.3 * 0.8 * np.exp(SENSOR.log_densities(particles, scan, which))[:, 0].mean()
    fixed = 0.5 * 0.8 * np.exp(known.log_densities[0, 0])
    unseen = {"target": 0.3 * 0.2, "echo": 0.5 * 0.2, "nothing": 0.2}
    assert found.log_missed == pytest.approx(np.log(sum(unseen.values())))
    assert found.log_made == pytest.approx([np.log(itself + fixed)])
    after = after_scan(Expected.at_rest(target), found, np.array([pair]), 1 - pair, known.new)
    for existence, made, missed in [
        (after.existence, itself, unseen["target"]), (after.echo.existence, fixed, unseen["echo"])
    ]:  # fmt: skip
        share = pair * made / (itself + fixed) + (1 - pair) * missed / sum(unseen.values())
        assert existence == pytest.approx(share)
    if not pair:
        np.testing.assert_array_equal(after.echo.mean, echo.mean)


def test_an_echo_that_was_surely_seen_is_where_kalman_has_it():
    echo = FixedEcho(0.5, np.array([5.0, 4010.0]), np.diag([40.0, 90.0]))
    places, errors = np.array([[11.0, 4000.0]]), np.array([[[50.0, 20.0], [20.0, 80.0]]])
    new = NewEchoes(np.zeros(1), places, errors)
    after = echo_after(echo, 0.0, np.array([0.9]), new, np.array([0]))
    precision = np.linalg.inv(echo.covariance) + np.linalg.inv(errors[0])
    np.testing.assert_allclose(np.linalg.inv(after.covariance), precision, rtol=1e-9)
    mean = np.linalg.solve(
        precision, np.linalg.solve(echo.covariance, echo.mean) + np.linalg.solve(errors[0], places[0])
    )
    np.testing.assert_allclose(after.mean, mean, rtol=1e-9)
    assert after.existence == pytest.approx(0.9)
