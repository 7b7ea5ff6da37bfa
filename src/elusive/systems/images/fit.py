"""Noise, level, point spread, brightness and polarity of a recording of frames, from itself and without labels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.checks.fitted import Fit, Fitted
from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io import FrameSource
from elusive.preprocess.peaks import PeakFinder
from elusive.preprocess.points import PointFinder, peaks_of, responses_of, single_width_of
from elusive.systems.images.frame_facts import FrameFacts, Law
from elusive.systems.images.turning import FAST_PX, Power, Turning
from elusive.systems.images.white_checks import CORRELATION, LEVEL, clearly

OPTIONS = ("--polarity", "--psf-sigma", "--snr-db-range")
PARTS = 8  # of the frames, from which errors are known
LEAST_POINTS = 12  # from which a width is known
BEYOND_DB = 1.5  # of a range of brightness: what the points seen leave open
UNSEEN_DB = 3.0  # below the faintest that could be seen, where the points seen reach down to that
CLEAR_PX = 8.0  # about a point, in which no noise is read
STRONG = 6.0  # deviations of a peak in a recorded scene that is hardly noise
BOTH = 0.1  # share of points of the rarer polarity from which both are there


WHITE, RECORDED = "white noise about a level", "a recorded scene, whose noise is learnt as it goes"

Chosen = NDArray[np.bool_]


class _Seen(NamedTuple):
    """Points of all frames."""

    part: NDArray[np.int64]  # (k,) part of the recording that each is in
    bright: Chosen  # (k,)
    snr_db: Callable[[Chosen], Array]  # of those chosen, (k,) of bool
    width_px: Callable[[Chosen], float]
    least_db: float  # SNR from which a point is seen


def fit_images(source: FrameSource, on_frame: Callable[[int], None] | None = None) -> Fit:
    """Fit a recording.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_frames`; it is read twice.
    on_frame
        Called with the number of frames done, over both readings.

    Raises
    ------
    DataError
        If there are too few pixels, or a frame cannot be used.
    """
    facts, read = FrameFacts(), 0
    for read, frame in enumerate(source, 1):
        if frame is not None:
            facts.add(frame)
        if on_frame is not None:
            on_frame(read)
    law = facts.law
    if law is None:
        raise DataError(f"{source.name}: too few pixels that differ to learn the noise from; give more frames.")

    def again() -> Iterator[Array]:
        for number, frame in enumerate(source, read + 1):
            if frame is not None:
                yield frame
            if on_frame is not None:
                on_frame(number)

    if not _white(facts, law):
        if not facts.steps:
            raise DataError(f"{source.name}: one frame does not tell its noise from its scene; give more frames.")
        return _recorded(again(), facts)
    if clearly(law.gaussian_misfit, law.rayleigh_misfit):
        return _envelope(facts, law)
    return _plain(again(), facts, law, source.interval_s)


def _white(facts: FrameFacts, law: Law) -> bool:
    """Whether frames are independent noise about one level, over pixels and over time."""
    return max(map(abs, facts.correlations)) <= CORRELATION and float(np.std(facts.medians)) <= LEVEL * law.sigma


def _error(facts: FrameFacts, name: str) -> float:
    """Return the standard error of a value of the law, from its scatter over parts of the recording."""
    parts = [getattr(law, name) for law in facts.laws(PARTS)]
    return float(np.std(parts, ddof=1) / math.sqrt(len(parts))) if len(parts) > 2 else math.nan


def _envelope(facts: FrameFacts, law: Law) -> Fit:
    sigma = Fitted(
        "--noise-sigma", "deviation of each quadrature", f"{law.rayleigh_sigma:.4g}", _error(facts, "rayleigh_sigma"),
        "the quantiles of all pixels",
    )  # fmt: skip
    kind = Fitted("--noise", "law", "rayleigh", math.nan, f"it misses them by {law.rayleigh_misfit:.2g} deviations, "
                  f"a Gaussian by {law.gaussian_misfit:.2g}")  # fmt: skip
    sensor = {"kind": "white", "noise": "rayleigh", "noise_sigma": float(sigma.value)}
    return Fit((kind, sigma), {"filter": {"kind": "several", "sensor": sensor}}, WHITE)


def _plain(frames: Iterable[Array], facts: FrameFacts, law: Law, interval_s: float) -> Fit:
    """Fit frames of white Gaussian noise: their points, in deviations about the level, and the noise beside them."""
    finder, beside = PointFinder(facts.count * math.prod(facts.shape)), FrameFacts()
    turning = Turning(FAST_PX)
    for frame in frames:
        now = finder.add((frame - law.pedestal) / law.sigma)
        turning.add(now)
        beside.add(frame, now.places_px.tolist(), CLEAR_PX)
    points, law = finder.points, beside.law or law
    pedestal = Fitted("--pedestal", "level without a target", f"{law.pedestal:.5g}", _error(beside, "pedestal"),
                      "the quantiles of pixels beside points")  # fmt: skip
    sigma = Fitted("--noise-sigma", "deviation of a pixel", f"{law.sigma:.4g}", _error(beside, "sigma"), pedestal.how)
    responses = responses_of(points)
    most = responses.max(axis=1, initial=0.0)

    def snr_db(chosen: Chosen) -> Array:
        heights = peaks_of(responses[chosen], single_width_of(responses[chosen]))
        return np.asarray(20 * np.log10(np.maximum(heights, 1e-3)))

    faintest = most <= np.quantile(most, 0.1) if len(most) else np.zeros(0, bool)
    least = math.nan
    if len(most):  # as faint as the faintest would be at the level itself
        least = float(np.median(snr_db(faintest)) - 20 * np.log10(np.median(most[faintest]) / points.level))
    part = points.frame * PARTS // max(facts.count, 1)
    seen = _Seen(part, points.bright, snr_db, lambda chosen: single_width_of(responses[chosen]), least)
    polarity, width, brightness = _points(seen)
    sensor: dict[str, Any] = {"kind": "white", "noise_sigma": float(sigma.value)}
    tree: dict[str, Any] = {"pedestal": float(pedestal.value), "filter": {"kind": "several", "sensor": sensor}}
    if width.value:
        sensor["psf_sigma"] = float(width.value)
        tree["filter"]["birth"] = {"snr_db_range": [*map(float, brightness.value.split())]}
    if polarity.value == "dark":
        tree["polarity"] = "dark"
    accelerates = _acceleration(turning.power(), interval_s)
    if accelerates.value:
        tree["filter"]["motion"] = {"kind": "intensity", "motion": {"kind": "cv", "q": float(accelerates.value)}}
    return Fit((pedestal, sigma, width, brightness, polarity, accelerates), tree, WHITE)


def _acceleration(power: Power, interval_s: float) -> Fitted:
    """Return the power of acceleration, where it is clearly more than is usual."""
    what = "power of the acceleration [px^2 / s^3]"
    if not power.clear:
        steady = f"{power.differences} second differences of places, no clear acceleration; the default stays"
        return Fitted("--q", what, "", math.nan, steady)
    second = interval_s**-3
    how = f"{power.differences} second differences of the places of points that noise does not make"
    return Fitted("--q", what, f"{power.q * second:.3g}", power.deviation * second, how)


def _recorded(frames: Iterable[Array], facts: FrameFacts) -> Fit:
    """Fit a recorded scene: what stands out of earlier frames."""
    finder = PeakFinder()
    state, rows = finder.init(), list[tuple[float, ...]]()
    for number, frame in enumerate(frames):
        state = finder.step(state, frame)
        found = state.output
        if found is None:
            continue
        chosen = found.temporal & (found.strength > STRONG)
        scale = found.scale_px[chosen]
        height = found.strength[chosen] / (math.sqrt(math.pi) * scale)  # of the peak, not of its matched filter
        part = np.full(len(scale), number * PARTS // max(facts.count, 1))
        rows += zip(part, found.bright[chosen], scale, height, strict=True)
    table = np.array(rows).reshape(-1, 4)
    level = Fitted("", "level (learnt in each frame)", f"{np.median(facts.medians):.5g}", _scatter(facts.medians),
                   "the median of each frame")  # fmt: skip
    noises = [math.sqrt(along_time / 2) for along_time, *_ in facts.steps]
    noise = Fitted("", "deviation of a pixel (learnt in each frame)", f"{np.median(noises):.4g}", _scatter(noises),
                   "frames less those before, laid over each other")  # fmt: skip
    seen = _Seen(
        table[:, 0].astype(np.int64), table[:, 1] > 0, lambda chosen: 20 * np.log10(np.maximum(table[chosen, 3], 1e-3)),
        lambda chosen: float(np.median(table[chosen, 2])), -math.inf,
    )  # fmt: skip
    polarity, width, brightness = _points(seen)
    values = (level, noise, *(one._replace(option="") for one in (width, brightness, polarity)))
    return Fit(values, {}, RECORDED)  # all of them are sought at once


def _points(seen: _Seen) -> tuple[Fitted, Fitted, Fitted]:
    """Return polarity, point spread and range of brightness of points."""
    count = len(seen.part)
    what = ("polarity of targets", "point spread [px]", "peak SNR, least and greatest [dB]")
    if count < LEAST_POINTS:
        unknown = f"{count} points stand out of the noise, too few to tell; the default stays"
        first, second, third = (
            Fitted(option, about, "", math.nan, unknown) for option, about in zip(OPTIONS, what, strict=True)
        )
        return first, second, third
    bright = int(seen.bright.sum())
    share = bright / count
    rarer = min(share, 1 - share)
    kind = "both" if rarer > BOTH else "bright" if share > 0.5 else "dark"
    polarity = Fitted(OPTIONS[0], what[0], kind, math.nan, f"{bright} of {count} points are brighter than the level")
    chosen = np.full(count, True) if kind == "both" else seen.bright == (kind == "bright")
    told = f"{int(chosen.sum())} points that noise does not make"
    width = Fitted(OPTIONS[1], what[1], f"{seen.width_px(chosen):.3g}", _jackknife(seen, chosen, seen.width_px), told)

    def low(these: Chosen) -> float:
        return float(np.quantile(seen.snr_db(these), 0.05))

    faint, strong = low(chosen), float(np.quantile(seen.snr_db(chosen), 0.95))
    censored = faint < seen.least_db + 1
    least = seen.least_db - UNSEEN_DB if censored else faint - BEYOND_DB
    how = f"5 and 95 % of them{', and what is fainter than a frame shows' if censored else ''}"
    brightness = Fitted(
        OPTIONS[2], what[2], f"{least:.1f} {strong + BEYOND_DB:.1f}", _jackknife(seen, chosen, low), how
    )
    return polarity, width, brightness


def _jackknife(seen: _Seen, chosen: Chosen, value: Callable[[Chosen], float]) -> float:
    """Return the standard error of a value by leaving out each part of the recording (Quenouille, 1956)."""
    parts = [part for part in np.unique(seen.part[chosen]) if (chosen & (seen.part != part)).any()]
    if len(parts) < 3:
        return math.nan
    left = np.array([value(chosen & (seen.part != part)) for part in parts])
    return math.sqrt((len(parts) - 1) * float(np.mean((left - left.mean()) ** 2)))


def _scatter(values: list[float]) -> float:
    """Deviation of values over frames."""
    return float(np.std(values, ddof=1)) if len(values) > 1 else math.nan
