"""Slow, obvious twins of the searches over a stack: every trajectory, every path."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray


def straight_scores(evidence: NDArray[np.float64], velocities: NDArray[np.float64], circular: bool):
    """Sum along every straight trajectory, ``(V, *shape)``, indexed by its cell in the last frame."""
    shape = evidence.shape[1:]
    last = len(evidence) - 1
    scores = np.zeros((len(velocities), *shape))
    for v, velocity in enumerate(velocities):
        for end in np.ndindex(shape):
            total = 0.0
            for k, frame in enumerate(evidence):
                # x is an array's last axis
                moved = np.rint(last * velocity[::-1]).astype(int) - np.rint(k * velocity[::-1]).astype(int)
                place = np.array(end) - moved
                if circular:
                    total += frame[tuple(place % shape)]
                elif ((place >= 0) & (place < shape)).all():
                    total += frame[tuple(place)]
            scores[v][end] = total
    return scores


def every_path(evidence: NDArray[np.float64], reach: int, circular: bool):
    """Sum along every path of moves within the box: ``{end cell: (score, path)}`` of the best into each cell."""
    shape = evidence.shape[1:]
    moves = list(itertools.product(range(-reach, reach + 1), repeat=len(shape)))
    best: dict[tuple[int, ...], tuple[float, list[tuple[int, ...]]]] = {}
    for start in np.ndindex(shape):
        for steps in itertools.product(moves, repeat=len(evidence) - 1):
            path = [start]
            for step in steps:
                place = np.array(path[-1]) + step
                path.append(tuple(int(p) for p in (place % shape if circular else place)))
            if not all((np.array(place) >= 0).all() and (np.array(place) < shape).all() for place in path):
                continue
            score = 0.0
            for frame, place in zip(evidence, path, strict=True):
                score += frame[place]
            if path[-1] not in best or score > best[path[-1]][0]:
                best[path[-1]] = (score, path)
    return best
