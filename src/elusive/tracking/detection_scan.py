"""What a scan makes of targets and fixed echoes: which detection is whose, and what begins at one that is nobody's.

Williams (2015), IEEE Trans. Aerosp. Electron. Syst. 51(3), 1664-1687, section IV, with an echo beside each target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.filters.particle import _kernels
from elusive.tracking.association import marginals
from elusive.tracking.detection_births import Newborn
from elusive.tracking.detection_pairs import paired
from elusive.tracking.detection_targets import CERTAIN, Evidence, Expected, Target, after_scan
from elusive.tracking.fixed_echoes import FORGOTTEN, EchoEvidence, EchoScan, FixedEcho, echo_after, echo_evidence
from elusive.tracking.lifecycle import Life

HARDLY = 1e-9  # existence that begins no target


def associated(
    alive: Sequence[Expected], found: Sequence[Evidence], echoes: Sequence[FixedEcho],
    within: Sequence[NDArray[np.int64]], fixed: EchoScan | None, log_new: Array, rng: Generator,
) -> tuple[list[Target], list[FixedEcho], Array]:  # fmt: skip
    """Return targets and echoes after the scan, and the probability that each detection is none of theirs."""
    of_echoes = list[EchoEvidence]()
    if fixed is not None:
        rows = enumerate(zip(echoes, within[len(alive) :], strict=True), len(alive))
        of_echoes = [echo_evidence(echo.existence, *fixed.of_row(row, which)) for row, (echo, which) in rows]
    both: list[Evidence | EchoEvidence] = [*found, *of_echoes]
    reach = np.array([len(which) for which in within], dtype=np.int64)
    target = np.repeat(np.arange(len(both)), reach)
    detection = np.concatenate([np.empty(0, dtype=np.int64), *within])
    log_odds = np.concatenate(
        [
            np.empty(0),
            *(
                its.log_made - its.log_missed - log_new[which]
                for its, which in zip(both, within, strict=True)
                if len(which)
            ),
        ]
    )
    joined = marginals(target, detection, log_odds, len(both), len(log_new))
    made = np.split(joined.pairs, np.cumsum(reach)[:-1]) if len(both) else []
    missed, new = joined.missed.tolist(), None if fixed is None else fixed.new
    together = paired(alive, found, made[: len(alive)], log_new, rng)
    after = [
        after_scan(one, its, pairs, share, new, together.after.get(row))
        for row, (one, its, pairs, share) in enumerate(zip(together.alive, together.found, made, missed, strict=False))
    ]
    left = list[FixedEcho]()
    if new is not None:
        n = len(alive)
        for echo, its, pairs, share, which in zip(echoes, of_echoes, made[n:], missed[n:], within[n:], strict=True):
            unseen = share * its.existence * its.missed * math.exp(-its.log_missed)
            left.append(echo_after(echo, unseen, pairs, new, which))
    return after, left, joined.unclaimed


def begun(
    born: Newborn, unclaimed: Array, log_new: Array, fixed: EchoScan | None, forget_below: float
) -> tuple[list[Target], list[FixedEcho]]:
    """Begin a target at each detection that may be a new one's, and an echo where no target can be."""
    targets, echoes = list[Target](), list[FixedEcho]()
    existence = np.minimum(unclaimed * np.exp(born.log_intensity - log_new), CERTAIN)
    for k in range(len(log_new)):
        echo = None
        if fixed is not None:
            share = float(unclaimed[k] * np.exp(fixed.new.log_intensity[k] - log_new[k]))
            echo = FixedEcho(share, fixed.new.places[k], fixed.new.errors[k]) if share > FORGOTTEN else None
        if existence[k] < HARDLY:
            echoes += [] if echo is None else [echo]
            continue
        # copies, so that one target does not keep the draws of all
        states, weights = np.array(born.states[k], order="F"), born.weights[k].copy()
        there = float(existence[k])
        odds = there / (1 - there)
        moments, allowed = _kernels.moments(states, weights), float(born.allowed[k])
        least = forget_below * odds
        targets.append(Target(Life(), there, states, weights, *moments, weights, k, 0.0, allowed, False, least, echo))
    return targets, echoes
