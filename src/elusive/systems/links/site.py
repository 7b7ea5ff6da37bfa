"""What a log says of its site before it is tracked: sums over voxels or shadowed links, and their constants.

Whether each link changes as people attenuate voxels is seen by matching pursuit (Mallat and Zhang, 1993, IEEE Trans.
Signal Process. 41(12), 3397-3415) with the changes that a person makes in each cell: they explain the frames in
which most happens, or they do not. The amplitude is the median of the first match's, the noise that of the empty room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.geometry.areas import Area
from elusive.io.link_logs import LinkLog
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_links import LinksMethod, VoxelRadiation
from elusive.systems.links.checks import refuse_impossible
from elusive.systems.links.constants import LEAST_FRAMES, LinkFitting
from elusive.systems.links.track import LinkTracking

EXPLAINED = 0.75  # share of the changes from which they are sums over voxels: .85 to .98 simulated, .44 in a basement
PEOPLE = 3  # matched in a frame
BUSIEST, LEAST_BUSY = 60, 5  # frames looked at, at most and at least
ABOVE_EMPTY = 1.5  # of the squared changes, over the most in the empty room: somebody is there
CELL_M = 0.4
LEAST_RESPONSE = 1e-3  # of a cell that is looked at, over the greatest
LEAST_NOISE_DB = 0.05
READINGS = 150_000  # that a fit at the start takes, so that it takes seconds
QUICK = LinkFitting(pitch_m=0.5, iterations=4)
THINNED = 8  # frames read for each that is fitted to, at most


class Voxels(NamedTuple):
    """How well sums over voxels explain a log, and their constants."""

    explained: float  # share of the squared changes
    model: VoxelRadiation
    amplitude_sd_db: float  # of the amplitude; NaN of less than two frames


def voxels_of(empty: Array, changes: Array, nodes: RadioNodes, area: Area, model: VoxelRadiation) -> Voxels:
    """Match changes of links with those that people make who attenuate voxels.

    Parameters
    ----------
    empty, changes
        ``(K, L)`` and ``(T, L)`` losses of the undirected links with nobody there, and afterwards; NaN where missing.
    nodes, area
        The network, and where people can be.
    model
        Its bell and weights are kept.

    Raises
    ------
    DataError
        If no link passes the area.
    """
    unit = model.replace(amplitude_db=1.0)
    weights = unit.weights.sparse(nodes, unit.weights.grid(area))
    cells, _ = area.cells(CELL_M)
    made = unit.links(weights, area.bounds_m, unit.weights.voxel_m).expected_at(cells)
    energy = (made**2).sum(axis=1)
    made, energy = (values[energy > LEAST_RESPONSE * energy.max()] for values in (made, energy))
    power = np.nansum(changes**2, axis=1)
    total, left, amplitudes = 0.0, 0.0, []
    busy = max(LEAST_BUSY, int((power > ABOVE_EMPTY * np.nansum(empty**2, axis=1).max()).sum()))
    for frame in np.argsort(-power)[: min(busy, BUSIEST)]:
        rest = np.nan_to_num(changes[frame])
        total += float(rest @ rest)
        for number in range(PEOPLE):
            matched = made @ rest / energy
            best = int(np.argmax(np.maximum(matched, 0.0) ** 2 * energy))
            if matched[best] <= 0:
                break
            if number == 0:
                amplitudes.append(float(matched[best]))
            rest = rest - matched[best] * made[best]
        left += float(rest @ rest)
    squares = np.asarray(weights.power(2).sum(axis=1)).ravel()
    variance = np.nan_to_num(np.nanvar(empty, axis=0, ddof=1))
    (link, voxel), _ = nnls(np.column_stack([np.ones(len(squares)), squares]), variance)
    amplitude = float(np.median(amplitudes)) if amplitudes else 0.0
    many = len(amplitudes)
    sd = 1.25 * float(np.std(amplitudes, ddof=1)) / math.sqrt(many) if many > 1 else math.nan
    fitted = model.replace(
        amplitude_db=max(amplitude, LEAST_NOISE_DB), noise_sd_db=max(math.sqrt(link), LEAST_NOISE_DB),
        voxel_sd_db=math.sqrt(voxel),
    )  # fmt: skip
    return Voxels(1 - left / total if total > 0 else 0.0, fitted, sd)


def frames_of_radiation(
    empty: Sequence[RssFrame], after: Sequence[RssFrame], nodes: RadioNodes, tracking: LinkTracking
) -> Voxels:
    """Match a log's frames; see :func:`voxels_of`."""
    method = tracking.method
    model = method.effect if isinstance(method, LinksMethod) and isinstance(method.effect, VoxelRadiation) else None
    changing = tracking.change.replace(measure="loss")
    rss = changing.init(tracking.calibrate.over(empty))
    losses = np.array([changing.step(rss, frame).change for frame in [*empty, *after]])
    area = tracking.area_of(nodes)
    return voxels_of(losses[: len(empty)], losses[len(empty) :], nodes, area, model or VoxelRadiation())


def fitted_at_the_start(log: LinkLog, nodes: RadioNodes, tracking: LinkTracking) -> tuple[LinkTracking, str]:
    """Return the parameters fitted to a part of the log, and what there is to say of it.

    Where the effect has been given, people are not tracked straight on the links, or nobody seems to be there, they
    stay as they are.
    """
    method, wanted = tracking.method, tracking.fit_frames
    if not isinstance(method, LinksMethod) or method.effect != LinkShadowing() or not wanted or not log.again:
        return tracking, ""
    empty, after = parts_of(log, tracking, wanted)
    if len(after) < LEAST_FRAMES:
        return tracking, ""
    kept = tracking.replace(fit_frames=0)
    refuse_impossible(nodes, tracking.calibrate.over(empty).mean_dbm, [frame.time_s for frame in empty])
    try:
        voxels = frames_of_radiation(empty, after, nodes, tracking)
        if voxels.explained >= EXPLAINED:
            words = f"radiation of {voxels.model.amplitude_db:.2g} dB; voxels explain {voxels.explained:.0%} of the log"
            return kept.replace(method=method.replace(effect=voxels.model)), words
        from elusive.systems.links.fit import fit_links

        readings = len(nodes.names) * (len(nodes.names) - 1) * len(log.channels)
        most = min(len(after), max(LEAST_FRAMES, READINGS // readings))
        chosen = [after[k] for k in np.linspace(0, len(after) - 1, most).astype(int)]
        fitted = fit_links([*empty, *chosen], nodes, tracking, QUICK)
    except DataError:  # nobody seems to be there, or no link is heard: tracking says what there is to say
        return tracking, ""
    return fitted.tracking.replace(fit_frames=0), f"shadowing, fitted to {most} frames of the log"


def parts_of(log: LinkLog, tracking: LinkTracking, wanted: int) -> tuple[list[RssFrame], list[RssFrame]]:
    """Return a log's frames of the calibration, and so many of those after it, as far apart as is read quickly."""
    stream = iter(log)
    empty = list(islice(stream, tracking.calibration_frames))
    after = list(islice(stream, THINNED * wanted))
    return empty, after[:: max(1, math.ceil(len(after) / wanted))]
