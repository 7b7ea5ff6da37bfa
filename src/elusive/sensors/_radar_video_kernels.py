"""Compiled kernels of radar video: spokes gathered into cells of half a beam, targets looked for in a polar map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from elusive.contracts import Array

MOST = 300.0  # logarithm up to which a cell's likelihood ratio is told apart
RENEWED = 0.02  # of what is known of a target's strength is forgotten at each look
HIDDEN = 0.02  # probability that a target shows nothing at a look
CLAIMS = 0.05  # existence from which a target's cells are no other's
REACH = 2  # cells to each side that a target shows in


@njit(cache=True, nogil=True, error_model="numpy")
def gather(
    amplitude: NDArray[Any], rows: NDArray[np.int64], samples: int, total: NDArray[np.float32],
    roots: NDArray[np.float32],
) -> None:  # fmt: skip
    """Add mean power, and mean root of amplitude, of ``samples`` neighbours of spokes ``(n, m)`` to rows ``(A, R)``."""
    share = np.float32(1.0 / samples)
    for i in range(len(rows)):
        line, beside = total[rows[i]], roots[rows[i]]
        for j in range(len(line)):
            power, root = np.float32(0.0), np.float32(0.0)
            for k in range(j * samples, (j + 1) * samples):
                value = np.float32(amplitude[i, k])
                power += value * value
                root += np.sqrt(value)
            line[j] += power * share
            beside[j] += root * share


@njit(cache=True, nogil=True, error_model="numpy")
def overlap(total: NDArray[np.float32], spokes: NDArray[np.int64], tall: int, wide: int) -> NDArray[np.float32]:
    """Mean of ``tall x wide`` neighbouring cells, round the turn; NaN where a row has no spoke, or columns end."""
    rows, columns = total.shape
    found = np.empty((rows, columns), np.float32)
    for i in range(rows):
        found[i, columns - wide + 1 :] = np.nan
        for j in range(columns - wide + 1):
            power = np.float32(0.0)
            for a in range(tall):
                row = (i + a) % rows
                for c in range(wide):
                    power += total[row, j + c] / np.float32(spokes[row] * wide * tall)
            found[i, j] = power
        for a in range(tall):
            if spokes[(i + a) % rows] == 0:
                found[i, :] = np.nan
    return found


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
def look(
    mean: Array, covariance: Array, existence: Array, levels: Array, number: NDArray[np.int64],
    order: NDArray[np.int64], evidence: NDArray[np.float32], grid: tuple[float, float, float, float, float],
    sd: tuple[float, float], ratios: Array, gate: float, missed: float, claimed: NDArray[np.float32], log_ratio: Array,
) -> None:  # fmt: skip
    """Update targets by the cells near where they are expected, in place, those of ``order`` one after the other.

    Beliefs of one ``number`` ``(T,)``, together in ``order``, are of one target: none claims what is another's of them.

    ``mean`` ``(T, 4)`` x, vx, y, vy and ``covariance`` ``(T, 4, 4)``; ``levels`` ``(T, K)`` weights of the strengths
    ``ratios`` ``(K,)``. ``grid``: first range, range step, first azimuth, radar's x and y; ``sd``: of a range [m] and
    an azimuth [rad]. A cell of evidence e is a target's with likelihood ratio (exp(e (1 - 1 / rho)) - 1) / (rho - 1),
    save for HIDDEN; of which cell is not known, so that the ratio is the mean over where the target may be. What
    another target claims with probability q is explained: l becomes l / (q l + 1 - q). ``claimed`` ``(A, R)`` and
    ``log_ratio`` ``(T,)`` are filled.
    """
    rows, columns = evidence.shape
    kinds = len(ratios)
    slope, scale = 1 - 1 / ratios, (1 - HIDDEN) / (ratios - 1)
    start, step, first, east, north = grid
    turn = 2 * np.pi
    pitch = turn / rows
    likely, gain = np.empty(kinds), np.empty((4, 2))
    spot, first_of = np.full((len(order), 2), -1), 0
    for place in range(len(order)):
        t = order[place]
        if number[t] != number[order[first_of]]:
            _claim(order[first_of:place], existence, log_ratio, spot, claimed)
            first_of = place
        x, y = mean[t, 0] - east, mean[t, 2] - north
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
        near = int(np.ceil((r - gate * np.sqrt(s_rr) - start) / step))
        far = int(np.floor((r + gate * np.sqrt(s_rr) - start) / step))
        middle = int(np.round(at))
        whole, w_rr, w_tt, w_rt = 0.0, 0.0, 0.0, 0.0
        total, m_r, m_t, m_rr, m_tt, m_rt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        likely[:] = 0.0
        for a in range(middle - half, middle + half + 1):
            d_t = (a - at) * pitch * r
            for c in range(near, far + 1):
                d_r = start + c * step - r
                squared = i_rr * d_r * d_r + 2 * i_rt * d_r * d_t + i_tt * d_t * d_t
                if squared > gate * gate:
                    continue
                weight = np.exp(-0.5 * squared)
                whole += weight
                w_rr += weight * d_r * d_r
                w_tt += weight * d_t * d_t
                w_rt += weight * d_r * d_t
                seen = 0 <= c < columns
                e = evidence[a % rows, c] if seen else 0.0
                claim = claimed[a % rows, c] if seen else 0.0
                share = 0.0
                for k in range(kinds):
                    ratio = 1.0 if e != e or not seen else HIDDEN + scale[k] * (np.exp(min(e * slope[k], MOST)) - 1)
                    if claim > 0.0:
                        ratio /= claim * max(ratio, 1.0) + 1 - claim
                    likely[k] += weight * ratio
                    share += levels[t, k] * ratio
                share *= weight
                total += share
                m_r += share * d_r
                m_t += share * d_t
                m_rr += share * d_r * d_r
                m_tt += share * d_t * d_t
                m_rt += share * d_r * d_t
        if not (whole > 0.0 and total > 0.0):
            log_ratio[t] = missed
            continue
        ratio = total / whole
        for k in range(kinds):
            levels[t, k] = (1 - RENEWED) * levels[t, k] * likely[k] / total + RENEWED / kinds
        log_ratio[t] = np.log(ratio)
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
    _claim(order[first_of:], existence, log_ratio, spot, claimed)


@njit(cache=True, nogil=True, error_model="numpy")
def _claim(
    parts: NDArray[np.int64], existence: Array, log_ratio: Array, spot: NDArray[np.int64], claimed: NDArray[np.float32]
) -> None:
    """Add the probability that one target, of whom ``parts`` exclude each other, shows in the cells round ``spot``."""
    rows, columns = claimed.shape
    whole = 1.0
    for t in parts:
        whole += existence[t] * (np.exp(min(log_ratio[t], MOST)) - 1)
    for t in parts:
        there = existence[t] * np.exp(min(log_ratio[t], MOST)) / whole
        row, column = spot[t]
        if there > CLAIMS and column >= 0:
            for a in range(row - REACH, row + REACH + 1):
                for c in range(max(column - REACH, 0), min(column + REACH + 1, columns)):
                    claimed[a % rows, c] = min(claimed[a % rows, c] + there, 1.0)
