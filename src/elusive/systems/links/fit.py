"""From the log of a network somebody walks through to the constants of its links, ready to track with; no labels.

Calibrate on the empty room, then expectation maximisation over the rest of the log
(:mod:`elusive.systems.links.constants`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.io import atomic_folder, atomic_path
from elusive.io.csv_files import write_csv
from elusive.io.link_logs import LinkLog
from elusive.sensors.link_shadowing import LinkShadowing
from elusive.sensors.radio_network import RadioNodes, RssFrame
from elusive.systems.links.by_links import LinksMethod
from elusive.systems.links.constants import LEAST_FRAMES, LinkFit, LinkFitting
from elusive.systems.links.track import LinkTracking

__all__ = ["FittedLinks", "LinkFitting", "fit_link_log", "fit_links"]

YAML = (".yaml", ".yml")
SOMEBODY = 0.5  # probability from which somebody is counted as there
HEADER = ("constant", "before", "after")


class FittedLinks(NamedTuple):
    """What fitting constants to a log came to."""

    tracking: LinkTracking  # the same parameters, with the constants fitted
    before: LinkShadowing
    fit: LinkFit
    times_s: Array  # (T,) of the frames fitted to, those after the calibration
    remarks: tuple[str, ...]  # of the calibration

    @property
    def constants(self) -> list[tuple[str, str, str]]:
        """Lines of a table: what each constant is, before and after."""
        after = self.fit.model
        fields = type(after).model_fields
        pairs = [(name, getattr(self.before, name), getattr(after, name)) for name in fields]
        return [
            (fields[name].description or name, f"{one:.3g}", f"{two:.3g}")
            for name, one, two in pairs
            if isinstance(one, float) and name not in ("degrees", "temper")
        ]

    @property
    def rows(self) -> list[tuple[str, str]]:
        """What there is to say about the fit."""
        likelihood, presence = self.fit.log_likelihood, self.fit.presence
        return [
            ("Frames fitted to", f"{len(presence)}, after {self.tracking.calibration_frames} of calibration"),
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
    if not isinstance(method, LinksMethod) or not isinstance(method.effect, LinkShadowing):
        kind = f"{method.kind!r} of radiation" if isinstance(method, LinksMethod) else repr(method.kind)
        raise ParameterError(
            f"method: {kind} has no constants to fit; give a configuration of method 'links' with effect 'shadowing'."
        )
    stream = iter(frames)
    empty = list(islice(stream, tracking.calibration_frames))
    calibration = tracking.calibrate.over(empty)
    area = tracking.area_of(nodes)
    sensor = method.effect.links(nodes, calibration.mean_dbm, calibration.variance_db2)
    rss = tracking.change.init(calibration)
    times: list[float] = []
    changes: list[Array] = []
    for frame in stream:  # all of them, so that a fault further on is told
        if len(times) < fitting.frames:
            times.append(frame.time_s)
            rss = tracking.change.step(rss, frame)  # as in tracking, while somebody may be inside
            changes.append(rss.rise_db)
    if len(times) < LEAST_FRAMES:
        raise DataError(
            f"log: has {len(times)} frames after the {len(empty)} of calibration; the fit needs at least "
            f"{LEAST_FRAMES}, with somebody walking in some."
        )
    fit = fitting.fit(sensor, np.array(times), np.array(changes), area, on_iteration=on_iteration)
    fitted = tracking.replace(method=method.replace(effect=fit.model))
    return FittedLinks(fitted, method.effect, fit, np.array(times), calibration.remarks)


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
        before, after = fitted.before.model_dump(), fitted.fit.model.model_dump()
        write_csv(folder / "constants.csv", HEADER, ((name, before[name], after[name]) for name in after))
        presence = zip(fitted.times_s.tolist(), fitted.fit.presence.tolist(), strict=True)
        write_csv(folder / "presence.csv", ("time_s", "presence"), ((f"{t:.6g}", f"{p:.4f}") for t, p in presence))
    return fitted
