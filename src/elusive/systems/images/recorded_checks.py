"""Whether a recorded scene can be learnt from: enough frames, one scene, noise that whitens, what rests in it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.special import ndtri

from elusive.checks import Fact, Finding
from elusive.systems.images.scene_facts import RestingPoint, SceneFacts
from elusive.tracking.peak_alone import chance_of

FEW = 20  # frames from which a scene and its noise are hardly learnt
USUAL = 0.8  # likeness of a scene to itself, laid over the frame before
STANDS, ALONE = 8.0, 2.0  # deviations of a point that stands out; times the next one's
BY_CHANCE = 0.01  # probability that chance lifts it so far: it is looked at, and not shown for that
MIDDLE, TAIL = 0.35, 2.0  # deviations by which a whitened decile may be off; factor on one in a thousand
AGAIN, CHANCE = 0.75, 2.0  # share of sure tracks there again at least; deviations by which chance may be off
LEARNT_BY = "Give more frames; or, if their noise is white and known, --noise-sigma."


def recorded_findings(
    scene: SceneFacts, whitened: Mapping[float, float], standing: Finding | None = None
) -> list[Finding]:
    """Return what recorded frames say.

    Parameters
    ----------
    scene
        What was gathered of them.
    whitened
        Mean quantiles of their whitened pixels, by probability.
    standing
        Where they are followed by their peaks, what is shown though it rests: said where no point is found to rest.
        Following peaks begins anew at a cut, follows what rests, and takes noise far out as it is.
    """
    by_peaks, resting = standing is not None, _resting(scene)
    found = [
        _length(scene.count),
        _cut(scene, grave=not by_peaks),
        standing if standing is not None and resting.holds else resting,
        _middle(whitened, by_peaks=by_peaks),
    ]
    return found if by_peaks else [*found, _tail(whitened)]


def _length(count: int) -> Finding:
    return Fact(FEW, count, count >= FEW, count).finding(
        "frames.few",
        f"The recording has {count} frame{'s' * (count != 1)}: its scene and its noise are hardly learnt from fewer "
        f"than {FEW}, and what rests is not told from what moves.",
        LEARNT_BY,
        grave=count < FEW // 2,
    )


def _cut(scene: SceneFacts, *, grave: bool) -> Finding:
    """Find a frame that shows another scene than the last one, however that is shifted."""
    usual = float(np.median(scene.likeness)) if scene.likeness else math.nan
    fact = Fact(usual, scene.least, not (usual > USUAL and scene.cuts), scene.count - 1)
    frame, cuts = scene.least_at, scene.cuts
    return fact.finding(
        "frames.cut",
        f"Frame {frame} shows another scene than the one before it (correlation {scene.least:.2f}, usually "
        f"{usual:.2f}; {cuts} such cut{'s' * (cuts > 1)}): what was learnt of the one says nothing of the other.",
        f"Track each scene by itself: --stop {frame}, then --start {frame}.",
        grave=grave,
    )


def _resting(scene: SceneFacts) -> Finding:
    """Find a point that stays on its pixel and stands out alone: whether it is a target nobody can know.

    The brightest of many lamps is one of them, however bright: alone is what chance hardly lifts so far over the next.
    """
    point = scene.resting if scene.count >= FEW else None
    seen = point or RestingPoint(math.nan, math.nan, math.nan, np.zeros(0))
    others = seen.next_heights[seen.next_heights > 0]
    alone = seen.height > max(STANDS, ALONE * np.max(others, initial=0.0))
    alone = alone and chance_of(seen.height, others) < BY_CHANCE
    return Fact(STANDS, seen.height, not alone, scene.count).finding(
        "scene.rests",
        f"A point at x {seen.x:.0f}, y {seen.y:.0f} stands out alone, {seen.height:.0f} deviations, and stays on its "
        "pixel while the scene does: a target at rest looks like this, and so do a lamp, a star and a defective pixel.",
        "Look at it in report.html with --show all, which shows what rests too.",
        grave=False,
    )


def again_finding(share: float, number: int) -> Finding:
    """Say whether what the tracker was sure of was there again: the share of so many tracks, each some frames on."""
    spread = math.sqrt(max(share * (1 - share), 0.0) / number) if number else math.nan
    return Fact(1.0, share, not share + CHANCE * spread < AGAIN, number).finding(
        "tracks.again",
        f"Of {number} times that the tracker was sure of something, its peak was there again five frames on in only "
        f"{100 * share:.0f} %: frames are missing, the camera jerks, too little of the scene stands out to lay frames "
        "over each other, or one layer of clouds goes before another. Targets are lost, and what is shown may be none.",
        "Give all frames, evenly in time and uncropped, or a part that is steadier (--start, --stop).",
    )


def _middle(quantiles: Mapping[float, float], *, by_peaks: bool) -> Finding:
    """Compare whitened pixels with a Gaussian; peaks are rated by others, and need but the third decile to be right."""
    least = 0.25 if by_peaks else 0.15
    middle = {level: value for level, value in quantiles.items() if least < level < 1 - least and math.isfinite(value)}
    level, seen = max(middle.items(), key=lambda one: abs(one[1] - ndtri(one[0])), default=(0.5, math.nan))
    expected = float(ndtri(level))
    return Fact(expected, seen, not abs(seen - expected) > MIDDLE, math.nan).finding(
        "noise.whitened",
        f"Whitened pixels at {100 * level:g} % lie at {seen:.2f} deviations, {expected:.2f} in Gaussian noise: the "
        "noise was not learnt, and what stands out of it is not as strong as it seems.",
        LEARNT_BY,
        grave=not by_peaks,
    )


def _tail(quantiles: Mapping[float, float]) -> Finding:
    """Compare them far out, where targets are told from clutter."""
    ends = {
        level: value for level, value in quantiles.items() if min(level, 1 - level) < 0.005 and math.isfinite(value)
    }
    level, seen = max(ends.items(), key=lambda one: abs(one[1] / ndtri(one[0])), default=(0.999, math.nan))
    expected = float(ndtri(level))
    return Fact(expected, seen, not abs(seen) > TAIL * abs(expected), math.nan).finding(
        "noise.whitened-tail",
        f"Whitened pixels at {100 * level:g} % lie at {seen:.1f} deviations, {expected:.1f} in Gaussian noise: clutter "
        "stands out as targets do, and a track of high existence may be a part of the scene.",
        "Leave out --filter: what stands out is then judged against this recording's own clutter.",
    )
