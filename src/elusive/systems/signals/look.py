"""What a signal is, by how it stands in its file, before it is tracked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from elusive.checks import Looked
from elusive.io import open_signal


def look(path: Path, given: Mapping[str, str | bool]) -> Looked:
    """Look at a recording: how many frames of how many samples it is cut into.

    Raises
    ------
    DataError
        If it cannot be read.
    """
    signal = open_signal(path)
    many = "Frames" if signal.length is None else f"{signal.length} frames, one after the other in time,"
    rate = "" if signal.rate_hz is None else f"; {signal.rate_hz:g} frames a second"
    cut = "" if signal.hop is None else "; a long recording, cut into frames"
    return Looked(f"{many} of {signal.samples} samples each{rate}{cut}.", ())
