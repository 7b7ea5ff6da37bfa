"""Slow, obvious twins of the kernels of radar video and of the clutter map."""

from __future__ import annotations

import numpy as np

from elusive.sensors.radar_video import SeaLevel


def level_sea(power):
    """Return the level of a sea whose power is 1 everywhere."""
    rows, columns = power.shape
    nothing = np.zeros((1, columns), np.float32)
    return SeaLevel(nothing, nothing, np.zeros(rows, int), np.zeros(rows, np.float32))


def gathered(amplitude, passed, received, place, width, samples, shape):
    """Sums of the mean power, and of the mean root of the amplitude, of neighbouring samples, row by row.

    Each spoke is dealt out to a thousand points across its width; then how many were received, passed, when and where,
    and how much of each cell is missing.
    """
    total, counted, lost = np.zeros((2, *shape)), np.zeros((5, shape[0])), np.zeros(shape)
    across = (np.arange(1000) + 0.5) / 1000 - 0.5
    for spoke, mark, heard, middle in zip(amplitude.astype(float), passed, received, place, strict=True):
        cells = spoke[: shape[1] * samples].reshape(shape[1], samples)
        reached, parts = np.unique(np.floor(middle + width * across).astype(int), return_counts=True)
        for row, part in zip(reached, parts / 1000, strict=True):
            known = np.nan_to_num(cells)
            total[:, row % shape[0]] += part * (known**2).mean(axis=1), part * np.sqrt(known).mean(axis=1)
            lost[row % shape[0]] += part * np.isnan(cells).mean(axis=1)
            counted[0, row % shape[0]] += part * heard
            if 0 <= row < shape[0]:
                counted[1, row] += part
                counted[2:, row] += part * mark
    return *total, counted, lost


def overlapped(total, spokes, tall, wide):
    """Mean power of neighbouring cells round the turn; not known where columns end."""
    rows, columns = total.shape
    found = np.empty(total.shape)
    for i in range(rows):
        for j in range(columns):
            some = [((i + a) % rows, j + c) for a in range(tall) for c in range(wide)]
            missing = any(spokes[row] == 0 or column >= columns for row, column in some)
            heard = sum(spokes[row] for row, _ in some)
            found[i, j] = np.nan if missing else sum(total[row, column] for row, column in some) / heard
    return found


def peaks(evidence, least, claimed):
    """Cells above their eight neighbours, round the turn and not at the ends of range."""
    rows, columns = evidence.shape
    found = []
    for i in range(rows):
        for j in range(1, columns - 1):
            around = [evidence[(i + a) % rows, j + c] for a in (-1, 0, 1) for c in (-1, 0, 1) if (a, c) != (0, 0)]
            if evidence[i, j] >= least and claimed[i, j] <= 0.5 and evidence[i, j] > max(around):
                found.append((i, j))
    return found


def ratio_of(e, rho, hidden=0.02):
    """Likelihood ratio of evidence that is the sum of two exponentials, of mean 1 and rho, to one of mean 1."""
    return hidden + (1 - hidden) * (np.exp(-e / rho) - np.exp(-e)) / (rho - 1) * np.exp(e)


def look(mean, covariance, weights, evidence, grid, sd, ratios, gate, claimed):
    """One target's log ratio, belief and strengths after a look at all cells in its gate."""
    start, step, first = grid
    rows, columns = evidence.shape
    off = mean[[0, 2]]
    r = np.hypot(*off)
    out = off / r
    turned = np.array([out, [out[1], -out[0]]])  # outwards, clockwise
    observed = np.zeros((2, 4))
    observed[:, [0, 2]] = turned
    innovation = observed @ covariance @ observed.T + np.diag([sd[0] ** 2, (r * sd[1]) ** 2])
    inverse = np.linalg.inv(innovation)
    pitch = 2 * np.pi / rows
    at = (np.arctan2(off[0], off[1]) - first) / pitch
    moves, weighed, shares, likely = [], [], [], []
    for a in range(int(np.round(at)) - rows // 2 + 1, int(np.round(at)) + rows // 2):
        for c in range(-columns, 2 * columns):
            d = np.array([start + c * step - r, (a - at) * pitch * r])
            squared = d @ inverse @ d
            if squared > gate**2:
                continue
            weight = np.exp(-0.5 * squared)
            e, q = (evidence[a % rows, c], claimed[a % rows, c]) if 0 <= c < columns else (np.nan, 0.0)
            ratio = np.ones(len(ratios)) if np.isnan(e) else ratio_of(e, ratios)
            ratio = ratio / (q * np.maximum(ratio, 1) + 1 - q)
            moves.append(d)
            weighed.append(weight)
            shares.append(weight * (weights @ ratio))
            likely.append(weight * ratio)
    whole = sum(weighed)
    moves, shares, weighed = np.array(moves), np.array(shares) / sum(shares), np.array(weighed) / whole
    gain = covariance @ observed.T @ inverse
    middle = shares @ moves
    spread = np.einsum("k,ki,kj->ij", shares, moves - middle, moves - middle)
    within = np.einsum("k,ki,kj->ij", weighed, moves, moves)
    after = weights * sum(likely) / (weights @ sum(likely))
    covariance = covariance - gain @ within @ gain.T + gain @ spread @ gain.T
    return np.log(weights @ sum(likely) / whole), mean + gain @ middle, covariance, after


def summed(level, chosen, sector, across):
    """Sums over each sector's chosen cells of 1, level, across, its square and its product with level."""
    found = np.zeros((5, sector.max() + 1, level.shape[1]))
    for i, j in np.argwhere(chosen):
        v, x = float(level[i, j]), float(across[i])
        found[:, sector[i], j] += 1, v, x, x * x, x * v
    return found


def expected(mean, slope, sector, across, part, own, fixed, beside):
    """Middle and block of each cell: those of its sector and part of range; then what is fixed, and what beside."""
    middle, block = np.empty(own.shape), np.empty(own.shape, int)
    blocks = (sector.max() + 1) * (part.max() + 1)
    for i, j in np.ndindex(own.shape):
        of_sector = sector[i] * (part.max() + 1) + part[j]
        middle[i, j] = own[i, j] if fixed[i, j] else mean[sector[i], j] + across[i] * slope[sector[i], j]
        block[i, j] = of_sector if not fixed[i, j] else blocks + 1 + of_sector if beside[i, j] else blocks
    return middle, block


def followed(level, pace, falls, rises, sunk, own, quiet):
    """Mean and quiet levels after a turn's."""
    fall = falls + np.maximum(quiet - level - sunk, 0) / 2
    moved = np.where(level < quiet, -fall, rises) if falls else np.fmin(level, quiet) - quiet
    return np.where(np.isnan(level), [own, quiet], [own + pace * (level - own), quiet + moved])


def counted(level, middle, block, low, width, counts):
    """Histogram of levels by block."""
    counts = counts.copy()
    for place in np.ndindex(level.shape):
        if block[place] >= 0 and not np.isnan(level[place]):
            number = int(np.trunc((level[place] - middle[place] - low) / width))
            counts[block[place], np.clip(number, 0, counts.shape[1] - 1)] += 1
    return counts


def judged(level, middle, block, low, width, table):
    """Evidence by linear interpolation between the lower edges of bins."""
    edges = low + width * np.arange(table.shape[1])
    found = np.empty(level.shape)
    for place in np.ndindex(level.shape):
        found[place] = np.interp(level[place] - middle[place], edges, table[block[place]])
    return found


def mean_about(evidence, around, guard, most, least):
    """Mean in a frame about each cell of what is known, round the turn; beyond an end of range as at that end."""
    half, inner, (rows, columns) = around // 2, guard // 2, evidence.shape
    found = np.empty(evidence.shape)
    for i, j in np.ndindex(evidence.shape):
        some = [
            evidence[(i + a) % rows, min(max(j + c, 0), columns - 1)]
            for a in range(-half, half + 1)
            for c in range(-half, half + 1)
            if max(abs(a), abs(c)) > inner
        ]
        known = np.minimum([one for one in some if not np.isnan(one)], most)
        found[i, j] = max(known.mean(), least) if len(known) else least
    return found


def mean_at(evidence, row, column, around, guard, most):
    """Mean in a frame about some cells of what is known, round the turn; beyond an end of range nothing is."""
    rows, columns = evidence.shape
    found = []
    for i, j in zip(row, column, strict=True):
        some = [
            evidence[(i + a) % rows, j + c]
            for a in range(-(around // 2), around // 2 + 1)
            for c in range(-(around // 2), around // 2 + 1)
            if max(abs(a), abs(c)) > guard // 2 and 0 <= j + c < columns
        ]
        known = np.minimum([one for one in some if not np.isnan(one)], most)
        found.append(known.mean() if len(known) else np.nan)
    return found


def claimed(power, row, column):
    """Cells that a target found in one claims, in a sea of power 1: an echo's and those two about it each way."""
    rows, columns = power.shape
    level = np.log(np.where(np.isnan(power), 0.0, power.astype(float)) + 1e-300)
    a, c = row, column
    for _ in range(16):
        beside = [(a + i, c + j) for i in (-1, 0, 1) for j in (-1, 0, 1) if 0 <= c + j < columns]
        a, c = max([(a, c), *beside], key=lambda place: level[place[0] % rows, place[1]])
    top = level[a % rows, c]

    def half(down, right):
        for n in range(1, 16):
            if not 0 <= c + n * right < columns or level[(a + n * down) % rows, c + n * right] < -600:
                return 16.0
            here = level[(a + n * down) % rows, c + n * right]
            if here < top - np.log(2):
                before = level[(a + (n - 1) * down) % rows, c + (n - 1) * right]
                return n - 1 + (before - top + np.log(2)) / (before - here)
        return 16.0

    above, below, before, behind = half(-1, 0), half(1, 0), half(0, -1), half(0, 1)
    found = np.zeros(power.shape)
    for i in range(rows):
        for j in range(columns):
            down = (i - row + rows // 2) % rows - rows // 2
            if max(abs(down), abs(j - column)) <= 2:
                found[i, j] = 1
            down += row - a - (below - above) / 2
            right = j - c - (behind - before) / 2
            fall = np.log(2) * ((2 * down / (above + below)) ** 2 + (2 * right / (before + behind)) ** 2)
            if max(top, 0) > fall and level[i, j] < max(top, 0) - fall + np.log(4):
                found[i, j] = 1
    return found


def without_lone(amplitude, away, reach, limit, low, least):
    """Spokes without samples that exceed both their neighbours by a limit, and what goes on from them."""
    found = amplitude[away:-away].astype(float)
    beside = np.maximum(np.maximum(amplitude[: -2 * away], amplitude[2 * away :]).astype(float), least)
    over = np.divide(found, beside * reach[:, None], out=np.zeros_like(found), where=beside > 0)
    for spoke, line in zip(found, over, strict=True):
        runs = np.split(np.arange(len(line)), np.flatnonzero((line > low)[:-1] != (line > low)[1:]) + 1)
        for run in runs:
            if (line[run] > limit[run]).any():
                spoke[run] = np.nan
    return found, int(np.isnan(found).sum())
