"""Compiled kernels of radar video: targets looked for in a polar map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from elusive._njit import njit
from elusive.contracts import Array
from elusive.sensors._echo_kernels import MOST, Sea, claim

FINE, LANES = 64, 4  # parts of a unit of evidence whose powers are tabled; numbers that a vector holds
RENEWED = 0.04  # probability that a target's strength is the next greater or lesser one at the next look
HIDDEN = 0.02  # probability that a target shows nothing at a look


@njit(cache=True, nogil=True, error_model="numpy")
def peaks(
    evidence: NDArray[np.float32], least: float, claimed: NDArray[np.float32], most: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cells of more evidence than their eight neighbours and a least one, which nothing claims; in order of place."""
    rows, columns = evidence.shape
    row, column = np.empty(most, np.int64), np.empty(most, np.int64)
    n = 0
    for i in range(rows):
        above, here, below = evidence[(i - 1) % rows], evidence[i], evidence[(i + 1) % rows]
        for j in range(1, columns - 1):
            it = here[j]
            if not it >= least or claimed[i, j] > 0.5:
                continue
            if it > here[j - 1] and it >= here[j + 1] and not (above[j] >= it or below[j] > it):
                if above[j - 1] > it or above[j + 1] > it or below[j - 1] > it or below[j + 1] > it:
                    continue
                if n < most:
                    row[n], column[n] = i, j
                    n += 1
    return row[:n], column[:n]


@njit(cache=True, nogil=True, error_model="numpy")
def mean_about(
    evidence: NDArray[np.float32], divided: NDArray[np.float32], row: NDArray[np.int64], column: NDArray[np.int64],
    around: int, guard: int, most: float,
) -> Array:  # fmt: skip
    """Mean about cells ``(T,)``, over ``around`` rows and columns less ``guard``, both odd, of what was ``divided``.

    None counts above ``most``. Rows go round the turn; NaN and what is beyond an end of range have no weight, and where
    nothing else is the mean is NaN.
    """
    rows, columns = evidence.shape
    half, inner, found = around // 2, guard // 2, np.full(len(row), np.nan)
    for t in range(len(row)):
        total, known = 0.0, 0
        for a in range(-half, half + 1):
            line, scale = evidence[(row[t] + a) % rows], divided[(row[t] + a) % rows]
            for c in range(max(column[t] - half, 0), min(column[t] + half + 1, columns)):
                if (abs(a) > inner or abs(c - column[t]) > inner) and line[c] == line[c]:
                    total += min(np.float64(line[c]) * scale[c], most)
                    known += 1
        if known:
            found[t] = total / known
    return found


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def look(
    mean: Array, covariance: Array, existence: Array, levels: Array, worth: Array, number: NDArray[np.int64],
    order: NDArray[np.int64], evidence: NDArray[np.float32], grid: tuple[float, float, float],
    sd: tuple[float, float], ratios: Array, gate: float, missed: float, power: NDArray[np.float32],
    sea: Sea, claimed: NDArray[np.float32], log_ratio: Array,
) -> None:  # fmt: skip
    """Update targets by the cells near where they are expected, in place, those of ``order`` one after the other.

    Beliefs of one ``number`` ``(T,)``, together in ``order``, are of one target: none claims what is another's of them.

    ``mean`` ``(T, 4)`` x, vx, y, vy from the radar and ``covariance`` ``(T, 4, 4)``; ``levels`` ``(T, K)`` weights of
    the strengths ``ratios`` ``(K,)``; ``worth`` ``(T,)``: what evidence is multiplied by. ``grid``: first range, range
    step, first azimuth; ``sd``: of a range [m] and an azimuth [rad]. A cell of evidence e is a target's with likelihood
    ratio (exp(e (1 - 1 / rho)) - 1) / (rho - 1), save for HIDDEN; of which cell is not known, so that the
    ratio is the mean over where the target may be. What
    another target claims with probability q is explained: l becomes l / (q l + 1 - q). ``claimed`` ``(A, R)`` and
    ``log_ratio`` ``(T,)`` are filled, the former by the turn's ``power`` ``(A, R)`` over the ``sea``'s.
    """
    rows, columns = evidence.shape
    kinds = len(ratios)
    base, scale, slope, powers = _laws(ratios)
    start, step, first = grid
    pitch = 2 * np.pi / rows
    held, likely, gain = np.zeros(len(slope)), np.empty(len(slope)), np.empty((4, 2))
    spot, first_of = np.full((len(order), 2), -1), 0
    for place in range(len(order)):
        t = order[place]
        if number[t] != number[order[first_of]]:
            claim(order[first_of:place], existence, log_ratio, spot, power, sea, claimed)
            first_of = place
        x, y = mean[t, 0], mean[t, 2]
        r = max(np.sqrt(x * x + y * y), 1e-3)
        ux, uy = x / r, y / r  # outwards; (uy, -ux) is clockwise
        at = (np.arctan2(x, y) - first) / pitch
        xx, xy, yy = covariance[t, 0, 0], covariance[t, 0, 2], covariance[t, 2, 2]
        s_rr = ux * ux * xx + 2 * ux * uy * xy + uy * uy * yy + sd[0] ** 2
        s_tt = uy * uy * xx - 2 * ux * uy * xy + ux * ux * yy + (r * sd[1]) ** 2
        s_rt = ux * uy * xx + (uy * uy - ux * ux) * xy - ux * uy * yy
        size = s_rr * s_tt - s_rt * s_rt
        i_rr, i_tt, i_rt = s_tt / size, s_rr / size, -s_rt / size
        half = int(min(np.ceil(gate * np.sqrt(s_tt) / (r * pitch)), rows // 2 - 1))
        middle, falls = int(np.round(at)), np.exp(-i_rr * step * step)
        whole, w_rr, w_tt, w_rt = 0.0, 0.0, 0.0, 0.0
        total, m_r, m_t, m_rr, m_tt, m_rt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        held[:kinds], likely[:] = levels[t], 0.0
        for a in range(middle - half, middle + half + 1):
            d_t = (a - at) * pitch * r
            left = gate * gate - d_t * d_t / s_tt
            if left < 0:
                continue
            there, reach = r - i_rt / i_rr * d_t - start, np.sqrt(left / i_rr)
            near, far = int(np.ceil((there - reach) / step)), int(np.floor((there + reach) / step))
            d_r = start + near * step - r
            weight = np.exp(-0.5 * (i_rr * d_r * d_r + 2 * i_rt * d_r * d_t + i_tt * d_t * d_t))
            factor = np.exp(-step * (i_rr * (d_r + 0.5 * step) + i_rt * d_t))  # to the next cell's, which falls too
            line, claims = evidence[a % rows], claimed[a % rows]
            w_0, w_1, w_2, s_0, s_1, s_2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for c in range(near, far + 1):
                share = 0.0
                if not 0 <= c < columns or line[c] != line[c]:
                    for k in range(len(slope)):
                        likely[k] += weight
                        share += held[k]
                else:
                    e = min(max(np.float64(line[c]) * worth[t], 0.0), MOST)
                    n = int(e * FINE + 0.5)
                    rest, taken = e - n / FINE, claims[c]
                    for k in range(len(slope)):
                        z = rest * slope[k]
                        ratio = base[k] + scale[k] * powers[n, k] * (1 + z + 0.5 * z * z)
                        if taken > 0:
                            ratio /= taken * max(ratio, 1.0) + 1 - taken
                        likely[k] += weight * ratio
                        share += held[k] * ratio
                share *= weight
                w_0, w_1, w_2 = w_0 + weight, w_1 + weight * d_r, w_2 + weight * d_r * d_r
                s_0, s_1, s_2 = s_0 + share, s_1 + share * d_r, s_2 + share * d_r * d_r
                d_r += step
                weight *= factor
                factor *= falls
            whole, w_rr, w_rt, w_tt = whole + w_0, w_rr + w_2, w_rt + w_1 * d_t, w_tt + w_0 * d_t * d_t
            total, m_r, m_t = total + s_0, m_r + s_1, m_t + s_0 * d_t
            m_rr, m_rt, m_tt = m_rr + s_2, m_rt + s_1 * d_t, m_tt + s_0 * d_t * d_t
        if not (whole > 0.0 and total > 0.0):
            log_ratio[t] = missed
            continue
        for k in range(kinds):
            likely[k] *= levels[t, k] / total
        for k in range(kinds):
            beside = likely[max(k - 1, 0)] + likely[min(k + 1, kinds - 1)]
            levels[t, k] = (1 - RENEWED) * likely[k] + 0.5 * RENEWED * beside
        log_ratio[t] = np.log(total / whole)
        m_r, m_t = m_r / total, m_t / total
        # against what lies within the gate: cells that say nothing leave the belief as it was
        v_rr = m_rr / total - m_r * m_r - w_rr / whole
        v_tt = m_tt / total - m_t * m_t - w_tt / whole
        v_rt = m_rt / total - m_r * m_t - w_rt / whole
        for d in range(4):
            c_r = covariance[t, d, 0] * ux + covariance[t, d, 2] * uy
            c_t = covariance[t, d, 0] * uy - covariance[t, d, 2] * ux
            gain[d, 0], gain[d, 1] = c_r * i_rr + c_t * i_rt, c_r * i_rt + c_t * i_tt
        for d in range(4):
            mean[t, d] += gain[d, 0] * m_r + gain[d, 1] * m_t
            for f in range(4):
                covariance[t, d, f] += gain[d, 0] * (v_rr * gain[f, 0] + v_rt * gain[f, 1])
                covariance[t, d, f] += gain[d, 1] * (v_rt * gain[f, 0] + v_tt * gain[f, 1])
        spot[t, 0], spot[t, 1] = int(np.round(at + m_t / (pitch * r))), int(np.round((r + m_r - start) / step))
    claim(order[first_of:], existence, log_ratio, spot, power, sea, claimed)


@njit(cache=True, nogil=True, error_model="numpy")
def _laws(ratios: Array) -> tuple[Array, Array, Array, Array]:
    """Return a, b, c ``(L,)`` of each strength's ratio a + b exp(c e), and exp(c e) at steps of 1 / FINE, ``(N, L)``.

    L is the next multiple of LANES, of which the last have ratio 1: loops over them are then whole vectors.
    """
    lanes = (len(ratios) + LANES - 1) // LANES * LANES
    base, scale, slope = np.ones(lanes), np.zeros(lanes), np.zeros(lanes)
    slope[: len(ratios)] = 1 - 1 / ratios
    scale[: len(ratios)] = (1 - HIDDEN) / (ratios - 1)
    base[: len(ratios)] = HIDDEN - scale[: len(ratios)]
    powers = np.empty((int(MOST * FINE) + 1, lanes))
    for n in range(len(powers)):
        powers[n] = np.exp(n / FINE * slope)
    return base, scale, slope, powers
