"""What goes straight among differences of plots that follow each other, by mixtures of Gaussians about zero.

Expectation maximisation (Dempster, Laird and Rubin, 1977); how many Gaussians, by Schwarz (1978, Estimating the
dimension of a model).
"""

from __future__ import annotations

import math

import numpy as np

from elusive.contracts import Array

OVERLAP = 3.0  # triples that share a plot
ROUNDS = 60
NARROWER, APART = (0.25, 0.06), 4.0  # deviations that are tried within others; areas by which two Gaussians differ
LEAST = 0.5, 5e-5  # deviations [m, rad] below which plots are alike, as a map's cells make them, and no radar errs


def sharpest(errors: Array, limits: Array, sd: Array) -> tuple[Array, Array]:
    """Return membership and deviations of what goes straight: where much else is near, that makes a wider Gaussian."""
    member, found, density = mixture(errors, limits, sd[None])
    before = float(np.log(density).sum())
    for narrower in NARROWER:
        its, (own, wide), density = mixture(errors, limits, np.stack([narrower * found[0], found[0]]))
        more = (float(np.log(density).sum()) - before) / OVERLAP
        # by Schwarz (1978): two deviations and a share are more to fit
        clear = more > 1.5 * math.log(len(errors)) and float(np.prod(wide)) > APART * float(np.prod(own))
        if clear and (own > LEAST).all():
            return its, own
    return member, found[0]


def mixture(errors: Array, limits: Array, sd: Array) -> tuple[Array, Array, Array]:
    """Fit Gaussians about zero, cut at the limits, and a uniform density, to errors ``(n, 2)``.

    Returns
    -------
    tuple
        Membership of the first ``(n,)``, deviations ``(k, 2)``, begun with ``sd``, and the density of all, ``(n,)``.
    """
    k, squares, even = len(sd), errors**2, 1 / float(np.prod(2 * limits))
    shares, member, both = np.full(k + 1, 1 / (k + 1)), np.zeros((k + 1, len(errors))), np.zeros(len(errors))
    for _ in range(ROUNDS):
        density = np.exp(-0.5 * sd**-2 @ squares.T) / (2 * math.pi * np.prod(sd, axis=1))[:, None]
        member = shares[:, None] * np.vstack([density, np.full(len(errors), even)])
        both = member.sum(axis=0)
        member /= both
        shares = np.clip(member.mean(axis=1), 1e-6, 1 - 1e-6) if len(errors) else shares
        total = np.maximum(member[:k].sum(axis=1), 1e-9)[:, None]
        sd = np.sqrt(member[:k] @ squares / total).clip(1e-3 * limits)
    return member[0], sd, both
