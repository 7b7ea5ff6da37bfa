"""What radar video is, by the first turn of its antenna, before it is tracked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path

import numpy as np

from elusive.checks import Looked
from elusive.io.radar_video import open_radar_video
from elusive.sensors.echo_extent import first_turn


def look(path: Path, given: Mapping[str, str | bool]) -> Looked:
    """Look at a recording's first turn: its spokes, how far they reach, whether it says where the radar is.

    Parameters
    ----------
    path
        Of the recording.
    given
        What else is given to the command, by name: ``which``, ``rotation_s`` and ``from_bow`` say how it is read.

    Raises
    ------
    DataError
        If it cannot be read, or holds no radar video.
    """
    source = open_radar_video(
        path, radar=str(given.get("which") or "") or None, rotation_s=_number(given.get("rotation_s")),
        from_bow=bool(given.get("from_bow")),
    )  # fmt: skip
    with closing(iter(source)) as spokes:  # type: ignore[type-var]
        turn = first_turn(spokes)
    if not turn:
        return Looked("Radar video without a spoke.", ())
    first, times = turn[0], np.concatenate([part.time_s for part in turn])
    turned = np.diff(np.concatenate([part.azimuth_rad for part in turn])) % math.tau
    turned = turned[turned < math.pi]
    each = math.tau / float(turned.mean()) if turned.any() else math.nan
    known = any(np.isfinite(part.lonlat_deg).all(axis=1).any() for part in turn)
    samples = first.amplitude.shape[1]
    period_s = each * float(np.diff(times).mean()) if len(times) > 1 else math.nan
    whole = f"{each:.0f} spokes a turn of {period_s:.3g} s" if math.isfinite(each) else f"{len(times)} spokes"
    return Looked(
        f"Radar video: {whole}, each of {samples} samples of {first.step_m:.4g} m from {first.start_m:.4g} to "
        f"{first.start_m + samples * first.step_m:.5g} m; it says {'' if known else 'not '}where the radar is.",
        (),
    )


def _number(given: str | bool | None) -> float | None:
    try:
        return float(given or "")
    except ValueError:
        return None
