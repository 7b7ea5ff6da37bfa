"""The best score of each time: why a run has no track and what could be tried, and runs one over the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.model import Model
from elusive.options import found_at, options_of
from elusive.report import drawing as draw
from elusive.report.clock import Clock
from elusive.report.extents import stride_of, top_of
from elusive.report.plots import SERIES
from elusive.workbench.forms import FieldPath, changed_since, laid_over, text_of

RESULT = "result.nc"
CONFIRMED = "confirmed"


class Try(NamedTuple):
    """Settings that might show a track, and what they change."""

    words: str
    model: Model


class WhyNone(NamedTuple):
    """What a run without a track has to say."""

    sentence: str
    drawn: draw.Drawing | None


class Best(NamedTuple):
    """The best candidate of each time of a run."""

    times: Array  # (T,)
    values: Array  # (T,) NaN where there was none
    asked: Array | None  # (T,) score that is asked of a track; None: of existence, by the parameters
    unit: str  # "s" or "frame"
    confirmed: bool  # whether there was a track

    @property
    def what(self) -> str:
        """What the values are."""
        return "existence" if self.asked is None else "score"


def best_of(folder: Path) -> Best | None:
    """Return the best candidate of each time by a folder of results; None where it does not say."""
    if not (folder / RESULT).is_file():
        return None
    import h5netcdf  # type: ignore[import-untyped]

    with h5netcdf.File(folder / RESULT, "r") as file:
        sure = file["status"][:] == list(file["status"].attrs["flag_meanings"].split()).index(CONFIRMED)
        if "shown" in file:
            sure &= file["shown"][:] > 0
        times = file["step_time"][:]
        unit = "s" if file["step_time"].attrs["units"] == "s" else "frame"
        if "step_highest" in file:
            return Best(times, file["step_highest"][:], file["step_threshold"][:], unit, bool(np.any(sure)))
        best = np.full(len(times), np.nan)
        np.fmax.at(best, file["obs_step"][:], file["existence"][:])
    return Best(times, best, None, unit, bool(np.any(sure)))


def why_none(folder: Path, model: Model) -> WhyNone | None:
    """Return why a run has no track; None where it has one, or does not say.

    Parameters
    ----------
    folder
        Of its results.
    model
        Its parameters.
    """
    best = best_of(folder)
    if best is None or best.confirmed:
        return None
    levels = np.full(len(best.times), _set_to(model, "confirm_from")) if best.asked is None else best.asked
    curves = {f"best {best.what}": ("--accent", best, best.values), "asked for a track": ("--soft", best, levels)}
    drawn = _drawn(curves, f"Best {best.what} against what is asked") if len(best.times) > 1 else None
    return WhyNone(_sentence(best, levels, _set_to(model, "confirm_frames")), drawn)


def beside(folders: Mapping[str, Path]) -> draw.Drawing | None:
    """Draw the best candidates of runs one over the other, by their names; None where they cannot be compared."""
    found = {name: best for name, folder in folders.items() if (best := best_of(folder)) is not None}
    if len(found) < 2 or len({(best.what, best.unit) for best in found.values()}) > 1:
        return None
    curves = {
        name: (SERIES[number % len(SERIES)], best, best.values) for number, (name, best) in enumerate(found.items())
    }
    return _drawn(curves, f"Best {next(iter(found.values())).what} of each time")


def _set_to(model: Model, option: str) -> float:
    """Return what a number among the settings is set to; NaN where these parameters have none of that name."""
    path = next((one.path for one in options_of(type(model)) if one.name == option), None)
    value = None if path is None else found_at(model, path)
    return float(value) if isinstance(value, float | int) else float("nan")


def told_apart(one: float, other: float) -> tuple[str, str]:
    """Write two numbers with as few digits, three at least, as tell them apart, and from 1."""
    digits = 3
    while digits < 17 and len({float(f"{value:.{digits}g}") for value in (one, other, 1.0)}) < len({one, other, 1.0}):
        digits += 1
    return f"{one:.{digits}g}", f"{other:.{digits}g}"


def _sentence(found: Best, levels: Array, frames: float) -> str:
    """Say it; ``frames``: at how many times the level is to be reached."""
    times, best, _, unit, _ = found
    what = found.what
    if not np.isfinite(best).any():
        return (
            f"No track was confirmed, and none began: nothing stood out enough for a candidate, whose {what} is told."
        )
    k = int(np.nanargmax(best))
    reached, level = told_apart(float(best[k]), float(levels[k]))
    asked = f"; {level} is asked" if np.isfinite(levels[k]) else ""
    above = best >= levels
    row = max((sum(1 for _ in run) for reached, run in groupby(above.tolist()) if reached), default=0)
    often = f", which it reached at {above.sum()} of {len(times)} times" if row else ""
    if row >= frames:
        often += f", {row} of them in a row: no one candidate did, or lacked what else is asked for a track to begin"
    elif row:
        often += ", but not often enough in a row"
    when = Clock.of(times, unit).say(times[k])
    when = f"in {when}" if unit == "frame" else f"at {when}"
    return f"No track was confirmed. The best {what} was {reached}, {when}{asked}{often}."


def _drawn(curves: Mapping[str, tuple[str, Best, Array]], title: str) -> draw.Drawing:
    """Draw curves over their runs' times, each with its colour, by name."""
    layers, highest = [], []
    for name, (colour, best, values) in curves.items():
        starts = np.arange(0, len(best.times), stride_of(len(best.times), 2000))
        shown = np.fmax.reduceat(values, starts)
        dash: dict[str, Any] = {"dash": [5, 4]} if colour == "--soft" else {}
        layers.append(draw.line(best.times[starts], shown, colour, name=name, width=2.0, **dash))
        highest.append(shown)
    best = next(iter(curves.values()))[1]
    times = np.unique(np.concatenate([best.times for _, best, _ in curves.values()]))
    top = 1.02 if best.what == "existence" else top_of(highest)
    panel = draw.chart(title, times, layers, axis=best.what, reach=(0.0, top), span=12)
    return draw.drawing(title, times, [panel], unit=best.unit)


def tries(model: Model, changes: Sequence[tuple[str, str]], without: Sequence[FieldPath] = ()) -> list[Try]:
    """Return what could be tried, of what has a meaning for the kinds chosen; of a scene how it is tracked.

    Parameters
    ----------
    model
        Parameters of a run without a track.
    changes
        Options by name, and what they become: a value, or ``x2``: so many times what they are.
    without
        Fields that something else sets.
    """
    inner: Model = getattr(model, "tracking", model)
    at = ("tracking",) if hasattr(model, "tracking") else ()
    paths: Mapping[str, FieldPath] = {one.name: (*at, *one.path) for one in options_of(type(inner))}
    found = []
    for name, change in changes:
        if paths.get(name) in without:
            continue
        try:
            now = text_of(model, paths[name])
            text = _times(str(now), float(change[1:])) if change[0] == "x" and change[1:2].isdigit() else change
            other = laid_over(model, {paths[name]: text})
        except (KeyError, AttributeError, ValueError, ParameterError):
            continue
        if other != model:
            found.append(Try(changed_since(model, other), other))
    return found


def _times(now: str, factor: float) -> str:
    if now.isdigit():
        return str(max(1, int(float(now) * factor + 0.5)))
    return f"{float(now) * factor:.4g}"
