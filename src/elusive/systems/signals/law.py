"""What noise alone scores: from calibration frames' own scores, or from simulated frames."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from elusive.contracts import Array
from elusive.filters.accumulate.false_alarm import NullScores, block_maxima, fit
from elusive.filters.accumulate.null_scores import calibrated_null, simulate_null
from elusive.filters.accumulate.recurrent import RecurrentFilter
from elusive.runner import run
from elusive.systems.signals.evidence import ComplexNoise, SignalEvidence
from elusive.systems.signals.whitened import Whitened

ENOUGH_MAXIMA = 128  # of calibration frames' own scores, for them to tell what noise does
SIMULATED_SAMPLES, SIMULATED_MAXIMA, AGES = 4096, 128, 12  # there: samples and block maxima at most, ages
MEMORIES = 4  # of 1 / (1 - alpha) frames, that a simulated run lasts where calibration is a part of it


def noise_law(
    recurrent: RecurrentFilter, whitened: Whitened, taken: Array, calibration: Sequence[Array], rng: Generator
) -> NullScores:
    """Find out how high noise alone scores, at every age of the filter.

    The scores of calibration frames tell, if there are enough of them; else it is simulated with white Gaussian
    frames, of the samples' own deviations and with a calibration as long where the signal had one.

    Parameters
    ----------
    recurrent
        The filter.
    whitened
        What makes evidence, calibrated if frames were.
    taken
        A frame of the signal, ``(n,)``, as it is taken: simulated noise has its deviation.
    calibration
        The frames taken for calibration.
    rng
        Source of the simulated frames.
    """
    evidence = whitened.evidence
    if "subtract_mean" in type(evidence.statistic).model_fields:
        # the mean of a short frame of noise may by chance be refused as an offset
        evidence = evidence._replace(statistic=evidence.statistic.replace(subtract_mean=True))
    if evidence.standard is None:
        source, parts = (ComplexNoise(evidence, rng), 2) if np.iscomplexobj(taken) else (evidence, 1)
        deviation = float(np.std(taken)) / math.sqrt(parts)
        return simulate_null(recurrent, source, taken.shape, rng, background_deviation=deviation)
    memory = math.ceil(1 / (1 - recurrent.smoothing) - 1e-9)
    if len(calibration) // memory * len(block_maxima(taken)[0]) >= ENOUGH_MAXIMA:
        evidences = (evidence.of_taken(whitened.flat(frame, rng)) for frame in evidence.crossed(calibration))
        maps = [state.score for state in run(recurrent, evidences, rng, start_s=-1.0)]
        return calibrated_null(maps, recurrent.smoothing)
    return _calibrated_law(recurrent, evidence, evidence.standard.deviation, len(calibration), rng)


def _calibrated_law(
    recurrent: RecurrentFilter, evidence: SignalEvidence, deviation: Array, calibration: int, rng: Generator
) -> NullScores:
    """Simulate noise with the recording's deviations, each run calibrated on its own.

    A sample whose deviation came out too small in calibration stands out ever after: only over several calibrations
    is it seen how far, and only after several memories of the filter.
    """
    part = deviation[:SIMULATED_SAMPLES]
    last = math.ceil(MEMORIES / (1 - recurrent.smoothing))
    ages = np.unique(np.geomspace(1, last, AGES).astype(int)).tolist()
    found: dict[int, list[Array]] = {age: [] for age in ages}
    moments = np.zeros((last + 1, 2))  # second and third of what accumulates at rest, where errors of calibration stay
    for _ in range(-(-SIMULATED_MAXIMA // len(block_maxima(part)[0]))):
        evidence = evidence.calibrated(list(part * rng.standard_normal((calibration, part.size))))
        state, resting = recurrent.init(rng, 0.0), np.zeros(part.size)
        for age in range(1, last + 1):
            fresh = evidence.evidence(part * rng.standard_normal(part.size))
            state = recurrent.step(state, float(age), fresh, rng)
            resting = recurrent.smoothing * resting + fresh
            moments[age] += (resting**2).sum(), (resting**3).sum()
            if age in found:
                found[age].append(block_maxima(state.score)[0])
    runs = len(found[1]) * part.size
    skewnesses = [moments[age, 1] / runs / (moments[age, 0] / runs) ** 1.5 for age in ages]
    blocks = block_maxima(part)[1] * deviation.size / part.size
    laws = [fit(np.concatenate(found[age]), blocks, skewness) for age, skewness in zip(ages, skewnesses, strict=True)]
    places, scales = (np.array([getattr(law, name) for law in laws]) for name in ("location", "scale"))
    return NullScores(np.array(ages, dtype=float), places, scales, np.array(skewnesses), blocks)
