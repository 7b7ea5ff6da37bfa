"""Why a run has no track: the best score of each time against its threshold, and what could be tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from elusive.contracts import Array
from elusive.errors import ParameterError
from elusive.model import Model
from elusive.options import options_of
from elusive.report import drawing as draw
from elusive.report.clock import Clock
from elusive.report.extents import stride_of, top_of
from elusive.workbench.forms import changed_since, laid_over, text_of

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


def why_none(folder: Path, model: Model) -> WhyNone | None:
    """Return why a run has no track; None where it has one, or does not say.

    Parameters
    ----------
    folder
        Of its results.
    model
        Its parameters.
    """
    if not (folder / RESULT).is_file():
        return None
    import h5netcdf  # type: ignore[import-untyped]

    with h5netcdf.File(folder / RESULT, "r") as file:
        sure = file["status"][:] == list(file["status"].attrs["flag_meanings"].split()).index(CONFIRMED)
        if "shown" in file:
            sure &= file["shown"][:] > 0
        if np.any(sure):
            return None
        found = {name: file[name][:] for name in ("step_time", "step_highest", "step_threshold") if name in file}
        unit = "s" if file["step_time"].attrs["units"] == "s" else "frame"
        rows = {name: file[name][:] for name in ("obs_step", "existence")}
    times = found["step_time"]
    if "step_highest" in found:
        best, levels = found["step_highest"], found["step_threshold"]
        what = "score"
    else:
        best = np.full(len(times), np.nan)
        np.fmax.at(best, rows["obs_step"], rows["existence"])
        levels = np.full(len(times), _level(model))
        what = "existence"
    drawn = _drawn(times, best, levels, what, unit) if len(times) > 1 else None
    return WhyNone(_sentence(times, best, levels, what, unit), drawn)


def _level(model: Model) -> float:
    """Return the existence that confirms a track; NaN where these parameters have none."""
    path = next((one.path for one in options_of(type(model)) if one.name == "confirm_from"), None)
    value: Any = model
    for name in path or ("none",):
        value = getattr(value, name, None)
    return float(value) if isinstance(value, float) else float("nan")


def _sentence(times: Array, best: Array, levels: Array, what: str, unit: str) -> str:
    if not np.isfinite(best).any():
        return (
            f"No track was confirmed, and none began: nothing stood out enough for a candidate, whose {what} is told."
        )
    k = int(np.nanargmax(best))
    asked = f"; {levels[k]:.3g} is asked" if np.isfinite(levels[k]) else ""
    above = int(np.sum(best >= levels))
    often = f", which it reached at {above} of {len(times)} times, but not often enough in a row" if above else ""
    when = Clock.of(times, unit).say(times[k])
    when = f"in {when}" if unit == "frame" else f"at {when}"
    return f"No track was confirmed. The best {what} was {best[k]:.3g}, {when}{asked}{often}."


def _drawn(times: Array, best: Array, levels: Array, what: str, unit: str) -> draw.Drawing:
    every = stride_of(len(times), 2000)
    starts = np.arange(0, len(times), every)
    highest, shown = np.fmax.reduceat(best, starts), levels[starts]
    layers = [
        draw.line(times[starts], highest, "--accent", name=f"best {what}", width=2.0),
        draw.line(times[starts], shown, "--soft", name="asked for a track", dash=[5, 4]),
    ]
    top = 1.02 if what == "existence" else top_of([highest, shown])
    panel = draw.chart(f"Best {what} against what is asked", times[starts], layers, reach=(0.0, top), span=12)
    return draw.drawing(f"Best {what} over time, and the threshold", times[starts], [panel], unit=unit)


def tries(model: Model, changes: Sequence[tuple[str, str]]) -> list[Try]:
    """Return what could be tried, of what has a meaning for the kinds chosen.

    Parameters
    ----------
    model
        Parameters of a run without a track.
    changes
        Options by name, and what they become: a value, or ``x2``: so many times what they are.
    """
    paths: Mapping[str, tuple[str, ...]] = {one.name: one.path for one in options_of(type(model))}
    found = []
    for name, change in changes:
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
