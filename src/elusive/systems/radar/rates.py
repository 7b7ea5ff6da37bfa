"""Whether a radar's Doppler is the rate at which its ranges grow: its sign and unit, and those of the ranges.

A target's range grows by its Doppler, whatever the radar itself does, so that over three plots of a target the ranges'
rate is the middle's Doppler times one. Both err; the Doppler w of the outer plots errs apart from both, and is the
instrument that tells the slope b (Wald, 1940): at the right one sum w sign(rate - b Doppler) is a sum of fair signs,
within a few of its deviations, sqrt(sum w^2). Signs, as a few triples are of several targets, or folded.
"""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array

FEW = 50  # triples, from which something is said
CLEAR = 1.5  # of Doppler's deviation: what the outer plots show beyond is a target that moves
ERRORS, TOLERANCE = 4.0, 0.05  # deviations of the slope, and what is as good as one beside them
KNOWN = (
    (-1.0, "Doppler counts towards the radar", "Change the sign of doppler_mps: it is positive away from the radar."),
    (0.5144, "Doppler is in knots", "Convert doppler_mps to metres a second."),
    (1 / 3.6, "Doppler is in kilometres an hour", "Convert doppler_mps to metres a second."),
    (1 / 0.9144, "ranges are in yards", "Convert range_m to metres."),
    (1 / 0.3048, "ranges are in feet", "Convert range_m to metres."),
)


def doppler_finding(rates_mps: Array, doppler_sd_mps: float) -> Finding:
    """Compare rates of ranges with Doppler: ``(n, 3)`` of triples, their rate, the middle's Doppler, the others'."""
    rate, doppler, others = rates_mps[np.abs(rates_mps[:, 2]) > CLEAR * doppler_sd_mps].T
    low, slope, high = _slopes(rate, doppler, others) if len(rate) >= FEW else (1.0, 1.0, 1.0)
    holds = low - TOLERANCE <= 1.0 <= high + TOLERANCE
    fits = [one for one in KNOWN if low - TOLERANCE * abs(one[0]) <= one[0] <= high + TOLERANCE * abs(one[0])]
    what, remedy = min(fits, key=lambda one: abs(one[0] - slope))[1:] if fits else ("", "")
    return Finding(
        "radar.doppler", holds, 1.0, slope,
        f"Of {len(rate)} plots that others follow, ranges grow by {slope:.2g} ({low:.2g} to {high:.2g}) times their "
        "Doppler, not by it"
        + (f", as if {what}" if what else "")
        + ": tracks are drawn where ships are not, or they are lost and begun anew.",
        remedy or "Look at sign and unit of doppler_mps, at range_m's unit and at the times; or leave Doppler out.",
    )  # fmt: skip


def _slopes(rate: Array, doppler: Array, others: Array) -> tuple[float, float, float]:
    """Least slope, best and greatest that fit rates to Doppler."""
    ratio = rate / np.where(doppler, doppler, np.nan)
    order = np.argsort(ratio)[: int(np.isfinite(ratio).sum())]
    weight = (others * np.sign(doppler))[order]
    balance = weight.sum() - 2 * np.cumsum(weight)  # the sum of signs as b passes each ratio
    room = ERRORS * math.sqrt(float((weight**2).sum()))
    fits = np.flatnonzero(np.abs(balance) <= room)
    ends = fits[0], np.abs(balance).argmin(), fits[-1]
    low, best, high = ratio[order][np.array(ends)].tolist()
    return low, best, high
