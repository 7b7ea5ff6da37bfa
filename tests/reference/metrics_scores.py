"""Slow, obvious twins of the scores: loops over trials, frames and pairs."""

import math


def rmse_at(errors, frame):
    squares = [sum(e**2 for e in trial[frame]) for trial in errors if not any(math.isnan(e) for e in trial[frame])]
    return math.sqrt(sum(squares) / len(squares))


def auc(existence, present):
    """Share of pairs (with a target, without) that are in order, ties counting half."""
    frames = [(p, t) for row, truth in zip(existence, present, strict=True) for p, t in zip(row, truth, strict=True)]
    with_target, without = [p for p, t in frames if t], [p for p, t in frames if not t]
    order = [1.0 if a > b else 0.5 if a == b else 0.0 for a in with_target for b in without]
    return sum(order) / len(order)


def rates(existence, present, threshold):
    """Shares of frames declared without and with a target."""
    declared = {True: [], False: []}
    for row, truth in zip(existence, present, strict=True):
        for p, t in zip(row, truth, strict=True):
            declared[bool(t)].append(p >= threshold)
    return sum(declared[False]) / len(declared[False]), sum(declared[True]) / len(declared[True])


def delay(existence, present, threshold, hold):
    """Frames from the first appearance to the first of ``hold`` declared frames in a row, all with the target."""
    start = next(k for k, t in enumerate(present) if t)
    stop = next((k for k in range(start, len(present)) if not present[k]), len(present))
    for k in range(start, stop):
        length = stop - k if hold is None else hold
        if k + length <= stop and all(existence[j] >= threshold for j in range(k, k + length)):
            return k - start
    return math.nan
