"""Slow twin of the geolocation: Lenth's (1981) own fixed point, equation by equation."""

from __future__ import annotations

import numpy as np


def lenth(places, azimuths, estimator, *, c=1.5, kappa=None, iterations=300):
    """Place, covariance and weights: eq. 2.6 again and again, then eq. 2.7."""
    theta = [np.pi / 2 - azimuth for azimuth in azimuths]
    n = len(theta)
    s, co = [np.sin(each) for each in theta], [np.cos(each) for each in theta]
    z = [s[i] * places[i][0] - co[i] * places[i][1] for i in range(n)]
    w, s_star, c_star = [1.0] * n, list(s), list(co)
    for _ in range(iterations):
        left = [
            [sum(w[i] * s[i] * s_star[i] for i in range(n)), -sum(w[i] * co[i] * s_star[i] for i in range(n))],
            [-sum(w[i] * s[i] * c_star[i] for i in range(n)), sum(w[i] * co[i] * c_star[i] for i in range(n))],
        ]
        right = [sum(w[i] * s_star[i] * z[i] for i in range(n)), -sum(w[i] * c_star[i] * z[i] for i in range(n))]
        x, y = np.linalg.solve(left, right)
        residual = []
        for i in range(n):
            dx, dy = x - places[i][0], y - places[i][1]
            d = np.hypot(dx, dy)
            s_star[i], c_star[i] = dy / d**3, dx / d**3
            residual.append(theta[i] - np.arctan2(dy, dx))
        C = sum(w[i] * np.cos(residual[i]) for i in range(n)) / sum(w)
        inverse = (
            2 * (1 - C) + (1 - C) ** 2 * (0.48794 - 0.82905 * C - 1.3915 * C**2) / C if kappa is None else 1 / kappa
        )
        t = [np.sqrt(2 * (1 - np.cos(r)) / inverse) for r in residual]
        if estimator == "huber":
            w = [min(1.0, c / each) for each in t]
        if estimator == "andrews":
            w = [np.sin(each / c) / (each / c) if each < c * np.pi else 0.0 for each in t]
    xx = sum(w[i] * s[i] * s_star[i] for i in range(n))
    xy = -0.5 * sum(w[i] * (s[i] * c_star[i] + co[i] * s_star[i]) for i in range(n))
    yy = sum(w[i] * co[i] * c_star[i] for i in range(n))
    return np.array([x, y]), inverse * np.linalg.inv([[xx, xy], [xy, yy]]), np.array(w)
