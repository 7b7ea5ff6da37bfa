"""Plain NumPy twins of the motions' kernels, and the process noise by matrix exponential."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from tests.reference.random_numbers import normals


def keyed_noise(shape, rng):
    """Standard normal numbers as the kernel has them: of one key, component by component."""
    n, d = shape
    return normals(rng.random(), d * n).reshape(d, n).T


def generator_noise(shape, rng):
    """Standard normal numbers as NumPy's user has them."""
    return rng.standard_normal(shape)


def propagate_linear(states, F, root, rng, noise=keyed_noise):
    """``F s + root n`` with one row of normals a state."""
    return states @ F.T + noise(states.shape, rng) @ root.T


def van_loan(A, L, T):
    """Transition matrix and noise covariance of ``ds = A s dt + dw``, ``E dw dw' = L dt``: Van Loan (1978)."""
    d = len(A)
    # squarings amplify rounding by the size of the exponent: halve T until it is small, then double back
    halvings = 8
    small = T / 2**halvings
    block = expm(np.block([[-A, L], [np.zeros((d, d)), A.T]]) * small)
    F = block[d:, d:].T
    Q = F @ block[:d, d:]
    for _ in range(halvings):
        Q = F @ Q @ F.T + Q
        F = F @ F
    return F, Q


def turn_by_euler(state, noise, T, steps):
    """CTRV with a constant along-track acceleration and a constant angular one, by small midpoint steps.

    ``state`` is x, vx, y, vy, rate; ``noise`` the two accelerations.
    """
    x, vx, y, vy, rate = state
    speed, heading = np.hypot(vx, vy), np.arctan2(vy, vx)
    h = T / steps
    for _ in range(steps):
        middle_speed = speed + noise[0] * h / 2
        middle_heading = heading + (rate + noise[1] * h / 4) * h / 2
        x, y = x + h * middle_speed * np.cos(middle_heading), y + h * middle_speed * np.sin(middle_heading)
        speed, heading, rate = speed + h * noise[0], heading + h * (rate + noise[1] * h / 2), rate + h * noise[1]
    return np.array([x, speed * np.cos(heading), y, speed * np.sin(heading), rate])
