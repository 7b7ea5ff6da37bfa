"""Compiled kernels of the radar sensor: a scan checked and tabulated, its log likelihood ratio at each state."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from elusive._kernels import BLOCK, copy_row, exponentiate
from elusive._njit import njit
from elusive.contracts import VX, VY, Array, X, Y

SIN, COS, RANGE, DOPPLER, DOPPLER_WEIGHT, LATER, LOG_SCALE = range(7)  # columns of a table of plots
FAR = 9.0  # deviations from a border beyond which its tail, 1e-19, is nothing
NEGLIGIBLE = 45.0  # a term that much below another one does not change their sum's last digit
ROOT2, TURN = np.sqrt(2.0), 2.0 * np.pi


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def angle_of(across: float, along: float) -> float:
    """Return ``atan2(across, along)`` without a branch, right to 1e-15: Cephes' rational form (Moshier, 1989)."""
    a, b = abs(across), abs(along)
    t = min(a, b) / max(a, b)
    z = (t - 1.0) / (t + 1.0) if t > 0.66 else t
    s = z * z
    p = -8.750608600031904122785e-1 * s - 1.615753718733365076637e1
    p = ((p * s - 7.500855792314704667340e1) * s - 1.228866684490136173410e2) * s - 6.485021904942025371773e1
    q = (s + 2.485846490142306297962e1) * s + 1.650270098316988542046e2
    q = ((q * s + 4.328810604912902668951e2) * s + 4.853903996359136964868e2) * s + 1.945506571482613964425e2
    angle = z + z * s * p / q
    angle = angle + 0.25 * np.pi if t > 0.66 else angle
    angle = 0.5 * np.pi - angle if a > b else angle
    angle = np.pi - angle if along < 0.0 else angle
    return -angle if across < 0.0 else angle


@njit(cache=True, nogil=True, error_model="numpy")
def judge(
    scan: tuple[Array, ...], time_s: float, low: float, high: float, middle: float, half: float
) -> tuple[int, int, np.ndarray]:
    """Return the first plot that is no measurement, else -1; how many plots lie in the field of view, and which.

    The field: least and greatest range, the sector's middle and half its width. The scan: as :func:`tabulate`.
    """
    times_s, range_m, bearing_rad, doppler_mps = scan
    inside = np.zeros(len(range_m), np.bool_)
    for j in range(len(range_m)):
        sound = np.isfinite(times_s[j] - time_s) and 0.0 <= range_m[j] < np.inf and not np.isinf(doppler_mps[j])
        if not (sound and 0.0 <= bearing_rad[j] < TURN):
            return j, 0, inside
        off = bearing_rad[j] - middle
        off = abs(off - TURN * np.floor(off / TURN + 0.5))
        inside[j] = low <= range_m[j] <= high and (off <= half or half == np.pi)
    return -1, inside.sum(), inside


@njit(cache=True, nogil=True, error_model="numpy")
def tabulate(
    scan: tuple[Array, ...], time_s: float, doppler_sd: float, log_scale: float, log_doppler_scale: float
) -> Array:
    """Rows of plots as :func:`scan_log_ratio` takes them; the second logarithm counts where there is a Doppler.

    The scan: times, ranges, bearings and Dopplers (NaN where there is none) of its plots.
    """
    times_s, range_m, bearing_rad, doppler_mps = scan
    table = np.empty((len(range_m), 7))
    for j in range(len(range_m)):
        told = not np.isnan(doppler_mps[j])
        table[j, SIN], table[j, COS], table[j, RANGE] = np.sin(bearing_rad[j]), np.cos(bearing_rad[j]), range_m[j]
        table[j, DOPPLER] = doppler_mps[j] if told else 0.0
        table[j, DOPPLER_WEIGHT] = 1.0 / doppler_sd if told else 0.0
        table[j, LATER] = times_s[j] - time_s
        table[j, LOG_SCALE] = log_scale + (log_doppler_scale if told else 0.0)
    return table


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def states_of_plots(
    scan: tuple[Array, ...],
    of: np.ndarray,
    time_s: float,
    origin: tuple[float, float],
    sd: tuple[float, float, float, float],
    field: tuple[float, float, float, float],
    rng: Generator,
) -> Array:
    """Draw a state of each plot ``of (n,)``, within its errors and the view: ``(n, 4)`` at the scan's time.

    ``sd`` holds the deviations of range, bearing, Doppler and of a velocity that is not measured, ``field`` the least
    and greatest range, the sector's middle and half its width. The scan: as :func:`tabulate`.
    """
    times_s, range_m, bearing_rad, doppler_mps = scan
    low, high, middle, half = field
    states = np.empty((4, len(of)))
    for i in range(len(of)):
        j = of[i]
        distance, bearing = -1.0, 0.0
        while not low <= distance <= high:
            distance = range_m[j] + sd[0] * rng.standard_normal()
        inside = False
        while not inside:
            bearing = bearing_rad[j] + sd[1] * rng.standard_normal()
            off = bearing - middle
            inside = half >= np.pi or abs(off - TURN * np.floor(off / TURN + 0.5)) <= half
        along = sd[3] * rng.standard_normal()
        if not np.isnan(doppler_mps[j]):
            along = doppler_mps[j] + along * sd[2] / sd[3]
        across = sd[3] * rng.standard_normal()
        sin, cos, before = np.sin(bearing), np.cos(bearing), time_s - times_s[j]
        states[VX, i], states[VY, i] = along * sin + across * cos, along * cos - across * sin
        states[X, i] = origin[0] + distance * sin + before * states[VX, i]
        states[Y, i] = origin[1] + distance * cos + before * states[VY, i]
    return states.T


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def seen_with(states: Array, origin: tuple[float, float], field: tuple[float, ...], probability: float) -> Array:
    """Return a probability for states in the field of view, 0 for others; the field as for :func:`scan_log_ratio`."""
    low, high, sin, cos, half = field
    x, y, found = states.T[X], states.T[Y], np.empty(len(states))
    for i in range(len(found)):
        east, north = x[i] - origin[0], y[i] - origin[1]
        far = np.sqrt(east * east + north * north)
        found[i] = probability if low <= far <= high else 0.0
    if half < np.pi:
        for i in range(len(found)):
            east, north = x[i] - origin[0], y[i] - origin[1]
            here = east != 0.0 or north != 0.0
            off = angle_of(cos * east - sin * north, sin * east + cos * north) if here else angle_of(-sin, cos)
            found[i] = found[i] if abs(off) <= half else 0.0
    return found


@njit(cache=True, nogil=True)
def _mass(centre: float, deviation: float, low: float, high: float) -> float:
    """Probability that a Gaussian falls between two borders that lie on both sides of its centre."""
    scale = deviation * ROOT2
    return 1.0 - 0.5 * (math.erfc((centre - low) / scale) + math.erfc((high - centre) / scale))


@njit(cache=True, nogil=True)
def _mass_around(centre: float, deviation: float, half: float) -> float:
    """Probability that an angle with Gaussian error, once round the circle and wrapped, falls within a sector."""
    mass, scale = _mass(centre, deviation, -half, half), deviation * ROOT2
    for side in (centre, -centre):
        gap = 2.0 * np.pi - half - side
        mass += 0.5 * (math.erfc(gap / scale) - math.erfc((gap + 2.0 * half) / scale))
    return mass


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"nnan", "nsz", "reassoc"})
def _bounds(distance: Array) -> tuple[float, float]:
    """Least and greatest distance; none is NaN."""
    low, high = distance[0], distance[0]
    for i in range(len(distance)):
        low, high = min(low, distance[i]), max(high, distance[i])
    return low, high


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _correct(
    x: Array, y: Array, distance: Array, sd: tuple[float, float], field: tuple[float, ...], seen: Array
) -> None:
    """Minus the log probability that a plot falls in the field of view; minus infinity for places outside of it."""
    low, high, sin, cos, half = field
    nearest, farthest = _bounds(distance)
    if half >= np.pi and nearest - low >= FAR * sd[0] and high - farthest >= FAR * sd[0]:
        seen[: len(x)] = 0.0
        return
    for i in range(len(x)):
        far = distance[i]
        seen[i] = 0.0
        if not low <= far <= high:
            seen[i] = -np.inf
        elif min(far - low, high - far) < FAR * sd[0]:
            seen[i] = -np.log(_mass(far, sd[0], low, high))
        if half < np.pi:
            off = angle_of(cos * x[i] - sin * y[i], sin * x[i] + cos * y[i]) if far > 0.0 else angle_of(-sin, cos)
            if abs(off) > half:
                seen[i] = -np.inf
            elif half - abs(off) < FAR * sd[1]:
                seen[i] -= np.log(_mass_around(off, sd[1], half))


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _places(along: Array, speed: Array, later: float, origin: float, place: Array) -> None:
    """Where the states are, seen from the radar, some time later."""
    for i in range(len(along)):
        place[i] = along[i] - origin + later * speed[i]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _distances(x: Array, y: Array, distance: Array) -> None:
    for i in range(len(x)):
        distance[i] = np.sqrt(x[i] * x[i] + y[i] * y[i])


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _exponents(
    x: Array,
    y: Array,
    vx: Array,
    vy: Array,
    distance: Array,
    plot: Array,
    sd: tuple[float, float],
    fold: float,
    out: Array,
) -> None:
    """Log density of a plot at each place, but for the plot's own constant, added to ``out``."""
    sin, cos, by_range, by_angle = plot[SIN], plot[COS], 1.0 / sd[0], 1.0 / sd[1]
    folds = 1.0 / fold if fold > 0.0 else 0.0
    measured, doppler, by_doppler = plot[RANGE], plot[DOPPLER], plot[DOPPLER_WEIGHT]
    for i in range(len(x)):
        # at the radar itself the bearing is zero, and the line of sight runs north
        here = distance[i] > 0.0
        north, length = (y[i] if here else 1.0), (distance[i] if here else 1.0)
        radial = (measured - distance[i]) * by_range
        angle = angle_of(sin * north - cos * x[i], cos * north + sin * x[i]) * by_angle
        off = doppler - (x[i] * vx[i] + north * vy[i]) / length
        rate = (off - fold * np.floor(off * folds + 0.5)) * by_doppler
        out[i] -= 0.5 * (radial * radial + angle * angle + rate * rate)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def scan_log_ratio(
    states: Array,
    origin: tuple[float, float],
    plots: Array,
    sd: tuple[float, float],
    fold: float,
    field: tuple[float, ...],
    log_missed: float,
    clutter: bool,
) -> Array:
    """Log of ``1 - P_D + P_D sum p(z|x) / lambda(z)``; without clutter, of ``P_D p(z|x)`` or ``1 - P_D``.

    ``sd`` holds the deviations of range and bearing, ``fold`` the period of the Doppler (0: none), ``field`` the least
    and greatest range, sine and cosine of the sector's middle and half its width. Row j of ``plots``, ``(n, 7)``: see
    the constants above; the last one is ``log(P_D / lambda)`` with the constants of the Gaussian densities.
    """
    n = len(states)
    all_x, all_vx, all_y, all_vy = states.T[X], states.T[VX], states.T[Y], states.T[VY]
    ratio = np.empty(n)
    # rows of one array, unpacked, would keep the loops from vector registers
    x, y, distance, seen, best = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    terms = np.empty((len(plots) + 1, BLOCK))
    for first in range(0, n, BLOCK):
        size = min(BLOCK, n - first)
        px, vx = all_x[first : first + size], all_vx[first : first + size]
        py, vy = all_y[first : first + size], all_vy[first : first + size]
        _places(px, vx, 0.0, origin[0], x)
        _places(py, vy, 0.0, origin[1], y)
        _distances(x[:size], y[:size], distance)
        _correct(x[:size], y[:size], distance[:size], sd, field, seen)
        later = 0.0
        rows = 0
        if clutter or len(plots) == 0:
            for i in range(size):
                terms[0, i] = log_missed if seen[i] > -np.inf else 0.0
            rows = 1
        for plot in plots:
            if plot[LATER] != later:
                later = plot[LATER]
                _places(px, vx, later, origin[0], x)
                _places(py, vy, later, origin[1], y)
                _distances(x[:size], y[:size], distance)
            nearest, farthest = _bounds(distance[:size])
            gap = max(0.0, nearest - plot[RANGE], plot[RANGE] - farthest) / sd[0]
            if clutter and plot[LOG_SCALE] - 0.5 * gap * gap < log_missed - NEGLIGIBLE:
                continue
            term = terms[rows, :size]
            for i in range(size):
                term[i] = plot[LOG_SCALE] + seen[i]
            _exponents(x[:size], y[:size], vx, vy, distance, plot, sd, fold, term)
            rows += 1
        if rows == 1:
            copy_row(ratio[first : first + size], terms[0, :size])
        else:
            _log_sum(terms[:rows, :size], best[:size], ratio[first : first + size])
    return ratio


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _log_sum(terms: Array, best: Array, total: Array) -> None:
    """Log of the sum of exponentials along the first axis; the terms are used up."""
    best[:] = -np.inf
    for term in terms:
        for i in range(len(best)):
            best[i] = max(best[i], term[i])
    total[:] = 0.0
    for term in terms:
        for i in range(len(best)):
            term[i] = term[i] - best[i] if best[i] > -np.inf else -np.inf
        exponentiate(term)
        for i in range(len(best)):
            total[i] += term[i]
    for i in range(len(best)):
        total[i] = best[i] + np.log(total[i])
