"""From the log of a network somebody walks through to the constants of its links, ready to track with; no labels.

Calibrate on the empty room; if sums over voxels explain the rest of the log (:mod:`elusive.systems.links.site`), their
amplitude and noise, else expectation maximisation (:mod:`elusive.systems.links.constants`).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError, ElusiveError, ParameterError
from elusive.io import atomic_folder, atomic_path
from elusive.io.csv_files import write_csv
from elusive.io.link_logs import LinkLog
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.constants import LEAST_FRAMES, LinkFit, LinkFitting
from elusive.systems.links.network import refuse_impossible
from elusive.systems.links.radiation import VoxelRadiation
from elusive.systems.links.site import EXPLAINED, Voxels, voxels_of
from elusive.systems.links.track import LinkTracking

__all__ = ["FittedLinks", "LinkFitting", "fit_link_log", "fit_links", "fitted_at_the_start"]

YAML = (".yaml", ".yml")
SOMEBODY = 0.5  # probability from which somebody is counted as there
HEADER = ("constant", "before", "after")
UNFITTED = "degrees", "temper", "bias_m", "spread", "width_x_m", "width_y_m", "rotation_deg"
QUICK = LinkFitting(iterations=4)
CELLS, WIDEST_M = 900, 0.5  # of a fit at the start: from so many on they are wider, up to this
READINGS = 150_000  # of links, directions apart, that a fit at the start takes: seconds
THINNED = 8  # frames read for each that is fitted to, at most


class FittedLinks(NamedTuple):
    """What fitting constants to a log came to."""

    tracking: LinkTracking  # the same parameters, with the constants fitted
    before: LinkShadowing | VoxelRadiation
    after: LinkShadowing | VoxelRadiation
    fit: LinkFit | None  # of shadowing
    voxels: Voxels  # how well sums over voxels explain the log
    times_s: Array  # (T,) of the frames fitted to, those after the calibration
    remarks: tuple[str, ...]  # of the calibration

    @property
    def constants(self) -> list[tuple[str, str, str]]:
        """Lines of a table: what each constant is, before and after."""
        after = self.after
        fields = type(after).model_fields
        pairs = [(name, getattr(self.before, name), getattr(after, name)) for name in fields]
        return [
            (fields[name].description or name, f"{one:.3g}", f"{two:.3g}")
            for name, one, two in pairs
            if isinstance(one, float) and name not in UNFITTED
        ]

    @property
    def rows(self) -> list[tuple[str, str]]:
        """What there is to say about the fit."""
        told = [
            ("Frames fitted to", f"{len(self.times_s)}, after {self.tracking.calibration_frames} of calibration"),
            ("Sums over voxels explain", f"{self.voxels.explained:.0%} of the squared changes"),
        ]
        if self.fit is None:
            sure = f"{self.voxels.model.amplitude_db:.3g} dB, deviation {self.voxels.amplitude_sd_db:.2g}"
            return [*told, ("Amplitude", sure)]
        likelihood, presence = self.fit.log_likelihood, self.fit.presence
        return [
            *told,
            ("Iterations", f"{len(likelihood) - 1}"),
            ("Log likelihood, tempered", f"{likelihood[0]:.1f} before, {likelihood[-1]:.1f} after"),
            ("Frames with somebody", f"{100 * float((presence >= SOMEBODY).mean()):.0f} %"),
        ]


def fit_links(
    frames: Iterable[RssFrame],
    nodes: RadioNodes,
    tracking: LinkTracking,
    fitting: LinkFitting,
    *,
    on_iteration: Callable[[int], None] | None = None,
) -> FittedLinks:
    """Fit the constants of the links to frames that nobody has labelled.

    Parameters
    ----------
    frames
        In the order of time; in the first ones nobody is there, in a part of the others one person at a time.
    nodes
        The network.
    tracking
        How people are tracked: calibration, area, and the constants from which the fit starts.
    fitting
        How to fit.
    on_iteration
        Called with the number of iterations done.

    Returns
    -------
    FittedLinks
        The parameters with the constants of greatest likelihood.

    Raises
    ------
    ParameterError
        If people are not tracked straight on the links.
    DataError
        If a frame cannot be used, there are too few, or nobody seems to have walked.
    """
    method = tracking.method
    if not isinstance(method, LinksMethod):
        raise ParameterError(
            f"method: {method.kind!r} has no constants to fit; give a configuration of method 'links'."
        )
    stream = iter(frames)
    empty = list(islice(stream, tracking.calibration_frames))
    calibration = tracking.calibrate.over(empty)
    refuse_impossible(nodes, calibration.mean_dbm, [frame.time_s for frame in empty])
    after = list(islice(stream, fitting.frames))
    deque(stream, maxlen=0)  # to the end, so that a fault further on is told
    if len(after) < LEAST_FRAMES:
        raise DataError(
            f"log: has {len(after)} frames after the {len(empty)} of calibration; the fit needs at least "
            f"{LEAST_FRAMES}, with somebody walking in some."
        )
    times_s, voxels = np.array([frame.time_s for frame in after]), voxels_of_frames(empty, after, nodes, tracking)
    before, fit = method.effect, None
    effect: LinkShadowing | VoxelRadiation = voxels.model
    if voxels.explained < EXPLAINED:
        start = before if isinstance(before, LinkShadowing) else LinkShadowing()
        sensor = start.links(nodes, calibration.mean_dbm, calibration.variance_db2)
        rss, changes = tracking.change.init(calibration), []
        for frame in after:  # as in tracking, while somebody may be inside
            rss = tracking.change.step(rss, frame)
            changes.append(rss.rise_db)
        fit = fitting.fit(sensor, times_s, np.array(changes), tracking.area_of(nodes), on_iteration=on_iteration)
        effect = fit.model
    if type(before) is not type(effect):
        before = type(effect)()
    fitted = tracking.replace(method=method.replace(effect=effect), fit_frames=0)
    return FittedLinks(fitted, before, effect, fit, voxels, times_s, calibration.remarks)


def voxels_of_frames(
    empty: Sequence[RssFrame], after: Sequence[RssFrame], nodes: RadioNodes, tracking: LinkTracking
) -> Voxels:
    """Match a log's frames; see :func:`voxels_of`."""
    method = tracking.method
    model = method.effect if isinstance(method, LinksMethod) and isinstance(method.effect, VoxelRadiation) else None
    changing = tracking.change.replace(measure="loss")
    rss = changing.init(tracking.calibrate.over(empty))
    quiet, losses = (
        np.array([changing.step(rss, frame).change for frame in some]) for some in (rss.calibration.alone(empty), after)
    )
    area, given = tracking.area_of(nodes), tracking.area is not None
    return voxels_of(quiet, losses, nodes, area, model or VoxelRadiation(), given=given)


def fitted_at_the_start(log: LinkLog, nodes: RadioNodes, tracking: LinkTracking) -> tuple[LinkTracking, str]:
    """Return the parameters fitted to a part of the log, and what there is to say of it.

    Where the effect has been given, people are not tracked straight on the links, or nobody seems to be there, they
    stay as they are.
    """
    method, wanted = tracking.method, tracking.fit_frames
    if not isinstance(method, LinksMethod) or method.effect != LinkShadowing() or not wanted or not log.again:
        return tracking, ""
    stream = iter(log)
    empty = list(islice(stream, tracking.calibration_frames))
    after = list(islice(stream, THINNED * wanted))
    readings = len(nodes.names) * (len(nodes.names) - 1) * len(log.channels)
    most = min(len(after), wanted, max(LEAST_FRAMES, READINGS // readings))
    if most < LEAST_FRAMES:
        return tracking, ""
    refuse_impossible(nodes, tracking.calibrate.over(empty).mean_dbm, [frame.time_s for frame in empty])
    chosen = [after[k] for k in np.linspace(0, len(after) - 1, most).astype(int)]
    x0, x1, y0, y1 = tracking.area_of(nodes).bounds_m
    pitch_m = min(max(QUICK.pitch_m, math.sqrt((x1 - x0) * (y1 - y0) / CELLS)), WIDEST_M)
    try:
        fitted = fit_links([*empty, *chosen], nodes, tracking, QUICK.replace(pitch_m=pitch_m))
    except ElusiveError:  # nobody seems to be there, or no link is heard: tracking says what there is to say
        return tracking, ""
    if fitted.fit is not None:
        return fitted.tracking, f"shadowing, fitted to {most} frames of the log"
    return fitted.tracking, fitted.voxels.described


def fit_link_log(
    log: LinkLog,
    nodes: RadioNodes,
    tracking: LinkTracking,
    fitting: LinkFitting,
    out: Path,
    *,
    on_iteration: Callable[[int], None] | None = None,
) -> FittedLinks:
    """Fit the constants of the links to a log and write the configuration to track with.

    Parameters
    ----------
    log
        From :func:`~elusive.io.link_logs.open_link_log`.
    nodes, tracking, fitting, on_iteration
        As for :func:`fit_links`.
    out
        A file ``.yaml``: the configuration. Any other name is a folder: ``config.yaml``, ``constants.csv`` of each
        constant before and after, ``presence.csv`` of the probability that somebody was there in each frame.

    Raises
    ------
    ParameterError, DataError
        As :func:`fit_links`, or if ``out`` cannot be written; nothing is left of it then.
    """
    if out.suffix.lower() in YAML:
        with atomic_path(out) as path:
            fitted = fit_links(log, nodes, tracking, fitting, on_iteration=on_iteration)
            path.write_text(fitted.tracking.to_yaml(), encoding="utf-8")
        return fitted
    with atomic_folder(out) as folder:
        fitted = fit_links(log, nodes, tracking, fitting, on_iteration=on_iteration)
        (folder / "config.yaml").write_text(fitted.tracking.to_yaml(), encoding="utf-8")
        before, after = fitted.before.model_dump(), fitted.after.model_dump()
        write_csv(folder / "constants.csv", HEADER, ((name, before[name], after[name]) for name in after))
        if fitted.fit is None:
            return fitted
        presence = zip(fitted.times_s.tolist(), fitted.fit.presence.tolist(), strict=True)
        write_csv(folder / "presence.csv", ("time_s", "presence"), ((f"{t:.6g}", f"{p:.4f}") for t, p in presence))
    return fitted
