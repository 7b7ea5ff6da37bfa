"""Whether a recorded scene can be learnt from: enough frames, one scene, noise that whitens, what rests in it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri

from elusive.checks import Fact, Finding
from elusive.systems.images.scene_facts import RestingPoint, SceneFacts

FEW = 20  # frames from which a scene and its noise are hardly learnt
USUAL = 0.8  # likeness of a scene to itself, laid over the frame before
STANDS, ALONE = 8.0, 2.0  # deviations of a point that stands out; times the next one's
MIDDLE, TAIL = 0.35, 2.0  # deviations by which a whitened decile may be off; factor on one in a thousand
LEARNT_BY = "Give more frames; or, if their noise is white and known, --noise-sigma."


def recorded_findings(scene: SceneFacts, whitened: Mapping[float, float]) -> list[Finding]:
    """Return what recorded frames say; ``whitened`` are mean quantiles of their whitened pixels, by probability."""
    return [_length(scene.count), _cut(scene), _resting(scene), *_whitened(whitened)]


def _length(count: int) -> Finding:
    return Fact(FEW, count, count >= FEW, count).finding(
        "frames.few",
        f"The recording has {count} frames: its scene and its noise are hardly learnt from fewer than {FEW}, and what "
        "rests is not told from what moves.",
        LEARNT_BY,
        grave=count < FEW // 2,
    )


def _cut(scene: SceneFacts) -> Finding:
    """Find a frame that shows another scene than the last one, however that is shifted."""
    usual = float(np.median(scene.likeness)) if scene.likeness else math.nan
    fact = Fact(usual, scene.least, not (usual > USUAL and scene.cuts), scene.count - 1)
    frame, cuts = scene.least_at, scene.cuts
    return fact.finding(
        "frames.cut",
        f"Frame {frame} shows another scene than the one before it (correlation {scene.least:.2f}, usually "
        f"{usual:.2f}; {cuts} such cut{'s' * (cuts > 1)}): what was learnt of the one is held against the other.",
        f"Track each scene by itself: --stop {frame}, then --start {frame}.",
    )


def _resting(scene: SceneFacts) -> Finding:
    """Find a point that stays on its pixel and stands out alone: whether it is a target nobody can know."""
    point = scene.resting if scene.count >= FEW else None
    alone = point is not None and point.height > max(STANDS, ALONE * point.next_height)
    seen = point or RestingPoint(math.nan, math.nan, math.nan, math.nan)
    return Fact(STANDS, seen.height, not alone, scene.count).finding(
        "scene.rests",
        f"A point at x {seen.x:.0f}, y {seen.y:.0f} stands out alone, {seen.height:.0f} deviations, and stays on its "
        "pixel while the scene does: a target at rest looks like this, and so do a lamp, a star and a defective pixel.",
        "If the camera should have moved, look at it; if a target may rest, do not rely on what moves alone.",
        grave=False,
    )


def _whitened(quantiles: Mapping[float, float]) -> list[Finding]:
    """Compare whitened pixels with the Gaussian that existence takes them for, in the middle and far out."""
    known = {level: value for level, value in quantiles.items() if math.isfinite(value)}
    found = []
    middle = {level: value for level, value in known.items() if 0.15 < level < 0.85}
    if middle:
        level, seen = max(middle.items(), key=lambda one: abs(one[1] - ndtri(one[0])))
        found.append(
            Fact(float(ndtri(level)), seen, abs(seen - ndtri(level)) <= MIDDLE, math.nan).finding(
                "noise.whitened",
                f"Whitened pixels at {100 * level:g} % lie at {seen:.2f} deviations, {ndtri(level):.2f} in Gaussian "
                "noise: the noise was not learnt, and existence does not mean what it says.",
                LEARNT_BY,
            )
        )
    ends = {level: value for level, value in known.items() if min(level, 1 - level) < 0.005}
    if ends:
        level, seen = max(ends.items(), key=lambda one: abs(one[1] / ndtri(one[0])))
        found.append(
            Fact(float(ndtri(level)), seen, abs(seen) <= TAIL * abs(ndtri(level)), math.nan).finding(
                "noise.whitened-tail",
                f"Whitened pixels at {100 * level:g} % lie at {seen:.1f} deviations, {ndtri(level):.1f} in Gaussian "
                "noise: clutter stands out as targets do, and a track of high existence may be a part of the scene.",
                "Look at each track in report.html; --snr-db-range with a greater least SNR leaves out what is faint.",
            )
        )
    return found
