"""Memory is counted before it is taken: what needs more than half of the machine's is refused."""

from __future__ import annotations

import psutil

from elusive.errors import DataError


def refuse_beyond_half(needed: int, what: str, remedy: str, machine_bytes: int | None = None) -> None:
    """Refuse to take more than half of the machine's memory, or of ``machine_bytes``.

    Parameters
    ----------
    needed
        Bytes.
    what, remedy
        Begin and end of the sentence: "<what> need ... GB, more than half ...; <remedy>."

    Raises
    ------
    DataError
        If it is more.
    """
    total = psutil.virtual_memory().total if machine_bytes is None else machine_bytes
    if needed > total / 2:
        raise DataError(
            f"{what} need {needed / 1e9:,.1f} GB, more than half of the machine's {total / 1e9:,.1f} GB; {remedy}."
        )
