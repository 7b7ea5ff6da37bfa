"""Slow, obvious twins of everything that estimates a path from bearings."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from elusive.filters.gaussian.transitions import FLOOR
from elusive.motion import ConstantTurnRateVelocity


def wrapped(angle):
    return np.angle(np.exp(1j * angle))


def numeric_jacobian(function, at, step=1e-6):
    at = np.asarray(at, float)
    columns = [(function(at + e) - function(at - e)) / (2 * step) for e in step * np.eye(len(at))]
    return np.column_stack(columns)


def kinematics(problem):
    return len(problem.motion.state_names)


class Given:
    """A generator whose normal numbers are known."""

    def __init__(self, numbers):
        self.numbers = numbers

    def standard_normal(self, shape):
        return self.numbers.reshape(shape)


def moved(problem, state, T):
    d = kinematics(problem)
    motion = problem.motion
    if isinstance(motion, ConstantTurnRateVelocity):
        kinematic = motion.propagate(state[None, :d], T, Given(np.zeros((1, 2))))[0]
    else:
        kinematic = motion.F(T) @ state[:d]
    kept = np.exp(-T / problem.bias.memory_s) if problem.bias else 0.0
    return np.concatenate([kinematic, kept * state[d:]])


def noise(problem, state, T):
    d, whole = kinematics(problem), len(problem.state_names)
    motion = problem.motion
    Q = np.zeros((whole, whole))
    if isinstance(motion, ConstantTurnRateVelocity):
        # a model's own draw, a unit of each noise at a time
        for unit in np.eye(2):
            push = motion.propagate(state[None, :d], T, Given(unit[None]))[0] - moved(problem, state, T)[:d]
            Q[:d, :d] += np.outer(push, push)
    else:
        Q[:d, :d] = motion.Q(T)
    Q[[0, 2], [0, 2]] += problem.position_noise_m**2
    Q[range(d), range(d)] += FLOOR
    if problem.bias:
        Q[range(d, whole), range(d, whole)] = 1 - np.exp(-2 * T / problem.bias.memory_s)
    return Q


def misfit(problem, table, row, state):
    """Angles of a bearing less those of a state, across and upwards; or sum of distances, the same."""
    d = kinematics(problem)
    if np.isfinite(table.range_m[row]):
        axes = problem.sensor.dimensions
        ranges = np.linalg.norm(state[: 2 * axes : 2] - table.stations[:, :axes], axis=1)
        return np.array([table.range_m[row] - table.weights[row] @ ranges])
    solid = problem.sensor.dimensions == 3 and np.isfinite(table.elevation_rad[row])
    east, north = state[0] - table.places[row, 0], state[2] - table.places[row, 1]
    across = wrapped(table.azimuth_rad[row] - np.arctan2(east, north))
    if not solid:
        angles = np.array([across])
    else:
        up = np.arctan2(state[4] - table.places[row, 2], np.hypot(east, north))
        angles = np.array([across * np.cos(table.elevation_rad[row]), table.elevation_rad[row] - up])
    if problem.bias:
        first = d + (2 if "z" in problem.motion.state_names else 1) * table.sensor[row]
        angles = angles - np.deg2rad(problem.bias.sd_deg) * state[first : first + len(angles)]
    return angles


def rows(table, k):
    return range(table.first[k], table.first[k + 1])


def residuals(problem, table, flat, at):
    """Everything that the path is to make small, whitened; the noise of a turn is that at the path ``at``."""
    anchor = problem.anchor()
    path = flat.reshape(len(table.times_s), -1)
    parts = [np.linalg.cholesky(anchor.information).T @ (path[0] - anchor.at)]
    for k, state in enumerate(path):
        parts += [misfit(problem, table, row, state) / np.sqrt(table.variance[row]) for row in rows(table, k)]
        if k + 1 < len(path):
            T = table.times_s[k + 1] - table.times_s[k]
            root = np.linalg.cholesky(noise(problem, at[k], T))
            parts.append(np.linalg.solve(root, path[k + 1] - moved(problem, state, T)))
    return np.concatenate(parts)


def least(problem, table, path):
    """Path of least squares from a path, and the covariance of the whole of it."""
    for _ in range(4 if isinstance(problem.motion, ConstantTurnRateVelocity) else 1):
        fixed = path
        found = least_squares(
            lambda flat, fixed=fixed: residuals(problem, table, flat, fixed),
            path.ravel(),
            x_scale="jac",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        path = found.x.reshape(path.shape)
    return path, np.linalg.inv(found.jac.T @ found.jac), found.cost


def updated(problem, table, k, mean, covariance, iterations):
    """Iterated update, all bearings of a time at once, and log density of the innovation."""
    at, now = mean, covariance
    places = [0, 2, 4][: problem.sensor.dimensions]
    for _ in range(iterations):
        spread = np.trace(now[np.ix_(places, places)])
        residual, H, R = [], [], []
        for row in rows(table, k):
            angles = misfit(problem, table, row, at)
            distance2 = ((at[places] - table.places[row][: len(places)]) ** 2).sum()
            residual.append(angles)
            H.append(-numeric_jacobian(lambda state, row=row: misfit(problem, table, row, state), at))
            R += [table.variance[row] + (0.5 * spread / distance2) ** 2] * len(angles)
        residual, H, R = np.concatenate(residual), np.vstack(H), np.diag(R)
        S = H @ covariance @ H.T + R
        gain = covariance @ H.T @ np.linalg.inv(S)
        innovation = residual + H @ (at - mean)
        at = mean + gain @ innovation
        now = covariance - gain @ S @ gain.T
    log_density = -0.5 * (innovation @ np.linalg.solve(S, innovation) + np.linalg.slogdet(2 * np.pi * S)[1])
    return at, now, log_density


def predicted(problem, mean, covariance, T):
    F = numeric_jacobian(lambda state: moved(problem, state, T), mean)
    return moved(problem, mean, T), F @ covariance @ F.T + noise(problem, mean, T), F


def filtered(problem, table, mean, covariance, iterations):
    """Beliefs from the one given at the first time."""
    beliefs, log_densities = [(mean, covariance)], []
    for k in range(1, len(table.times_s)):
        mean, covariance, _ = predicted(problem, mean, covariance, table.times_s[k] - table.times_s[k - 1])
        mean, covariance, log_density = updated(problem, table, k, mean, covariance, iterations)
        beliefs.append((mean, covariance))
        log_densities.append(log_density)
    return beliefs, sum(log_densities)


def smoothed(problem, table, beliefs):
    later = beliefs[-1]
    backwards = [later]
    for k in range(len(beliefs) - 2, -1, -1):
        mean, covariance = beliefs[k]
        ahead, spread, F = predicted(problem, mean, covariance, table.times_s[k + 1] - table.times_s[k])
        gain = covariance @ F.T @ np.linalg.inv(spread)
        later = mean + gain @ (later[0] - ahead), covariance + gain @ (later[1] - spread) @ gain.T
        backwards.append(later)
    return backwards[::-1]


def mixed(probabilities, beliefs, stays):
    """Beliefs by name of component that each model starts from; what a model lacks is the other's own."""
    m = len(beliefs)
    change = np.full((m, m), (1 - stays) / max(m - 1, 1))
    np.fill_diagonal(change, stays)
    predicted = probabilities @ change
    out = []
    for j, (names, mean_j, covariance_j) in enumerate(beliefs):
        filled = []
        for other, mean_i, covariance_i in beliefs:
            mean, covariance = mean_j.copy(), covariance_j.copy()
            has = [k for k, name in enumerate(names) if name in other]
            lacks = [k for k in range(len(names)) if k not in has]
            there = [other.index(names[k]) for k in has]
            mean[has] = mean_i[there]
            covariance[np.ix_(has, has)] = covariance_i[np.ix_(there, there)]
            covariance[np.ix_(has, lacks)] = 0.0
            covariance[np.ix_(lacks, has)] = 0.0
            filled.append((mean, covariance))
        weights = probabilities * change[:, j] / predicted[j]
        mean = sum(w * x for w, (x, _) in zip(weights, filled, strict=True))
        spread = sum(w * (P + np.outer(x - mean, x - mean)) for w, (x, P) in zip(weights, filled, strict=True))
        out.append((names, mean, spread))
    return predicted, out


def interacting(problems, table, k, step_s, memory_s, probabilities, beliefs, iterations):
    """One step of interacting multiple models to time k, and the log density of its bearings."""
    start, begun = mixed(probabilities, beliefs, np.exp(-step_s / memory_s))
    ended, worth = [], []
    for problem, (names, mean, covariance) in zip(problems, begun, strict=True):
        mean, covariance, _ = predicted(problem, mean, covariance, step_s)
        mean, covariance, log_density = updated(problem, table, k, mean, covariance, iterations)
        ended.append((names, mean, covariance))
        worth.append(log_density)
    weight = start * np.exp(worth)
    return weight / weight.sum(), ended, np.log(weight.sum())
