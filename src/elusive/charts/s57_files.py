"""The files of an S-57 cell: the base, NAME.000, and its updates, NAME.001 and on, beside it.

Only the first two records are read here, and the lengths of the others, to tell whether the cell and the sequence are
whole before the reader applies it; it would pass over a gap, or a cell cut between two records, in silence.
IHO S-57 edition 3.1, part 3 (ISO/IEC 8211) and appendix B.1, section 5.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NamedTuple

from elusive.errors import DataError

LEADER = 24
HEAD = 1 << 16  # bytes that hold the first two records of any cell
UNIT, FIELD = b"\x1f", b"\x1e"
NEW = 1  # EXPP of a base cell
HEADS = 3  # records that a cell's own count leaves out: directory, identification, parameters


class Identity(NamedTuple):
    """What the data set identification record says."""

    purpose: int  # EXPP: 1 new, 2 revision
    name: str  # DSNM
    edition: str  # EDTN
    update: int  # UPDN


def check_sequence(base: Path) -> tuple[Identity, int]:
    """Check that a cell and the updates beside it are whole and belong together.

    Returns
    -------
    identity
        Of the base.
    last
        Number of the last update beside it; that of the base where there is none.

    Raises
    ------
    DataError
        If the file is missing or no S-57 base cell, an update is missing, of another edition or out of place, or the
        cell is cancelled.
    """
    if base.suffix != ".000":
        is_update = base.suffix[1:].isdigit()
        hint = "give the base cell, .000, beside it" if is_update else "give a chart on .000, .geojson or .shp"
        raise DataError(f"{base}: is no S-57 base cell; {hint}.")
    identity = read_identity(base)
    _check_length(base)
    if identity.purpose != NEW:
        raise DataError(f"{base}: holds update {identity.update}, not a base cell; give the cell as first issued.")
    beside = {int(file.suffix[1:]): file for file in _updates_of(base)}
    if not beside:
        return identity, identity.update
    if identity.update:
        raise DataError(
            f"{base}: is a re-issue at update {identity.update} with updates beside it, which cannot be applied to it; "
            "use the cell of the edition's first issue, or move the updates away."
        )
    last = max(beside)
    for number in range(1, last + 1):
        if number not in beside:
            raise DataError(
                f"{base}: update .{number:03d} is missing, .{last:03d} is there; add it, or move the later ones away."
            )
        update = read_identity(beside[number])
        if update.edition == "0":
            raise DataError(f"{beside[number]}: cancels the cell; use the one that replaces it.")
        if (update.edition, update.update) != (identity.edition, number):
            raise DataError(
                f"{beside[number]}: is update {update.update} of edition {update.edition}, where update {number} of "
                f"edition {identity.edition} belongs; fetch the cell and its updates anew."
            )
    return identity, last


def read_identity(path: Path) -> Identity:
    """Read the data set identification of a cell or an update.

    Raises
    ------
    DataError
        If the file cannot be read or is not S-57.
    """
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); check the path.") from None
    try:
        body = _field(_first_record(head), b"DSID")
        name, edition, update = body[7:].split(UNIT)[:3]
        return Identity(body[5], name.decode("latin-1"), edition.decode("latin-1"), int(update or b"0"))
    except (ValueError, IndexError):
        raise DataError(f"{path}: is not an S-57 file, or is damaged at its beginning; fetch it anew.") from None


def _check_length(base: Path) -> None:
    """Compare the number of records in a cell to what it states."""
    content = base.read_bytes()
    try:
        stated = sum(struct.unpack_from("<3x8I", _field(_first_record(content[:HEAD]), b"DSSI"))) + HEADS
    except (ValueError, IndexError, struct.error):
        raise DataError(f"{base}: does not state its number of records; it is damaged, fetch it anew.") from None
    place = found = 0
    while (length := content[place : place + 5]).isdigit() and int(length) >= LEADER:
        place, found = place + int(length), found + 1
    if found < stated and place >= len(content):
        raise DataError(f"{base}: is cut short, {found} of {stated} records are there; fetch it anew.")


def _first_record(head: bytes) -> bytes:
    """Return what follows the directory of fields, with which every file begins."""
    return head[int(head[:5]) :] if head[6:7] == b"L" and b"DSID" in head else b""


def _field(record: bytes, tag: bytes) -> bytes:
    """Return a field of a record: its place stands in the directory behind the leader."""
    start = int(record[12:17])
    length, position, width = int(record[20:21]), int(record[21:22]), int(record[23:24])
    entry = width + length + position
    for at in range(LEADER, start - 1, entry):
        if record[at : at + width] == tag:
            size = int(record[at + width : at + width + length])
            first = start + int(record[at + width + length : at + entry])
            return record[first : first + size].rstrip(FIELD)
    raise ValueError(tag)


def _updates_of(base: Path) -> list[Path]:
    """Return the files beside a cell that bear its name and a number from 001."""
    return [
        file
        for file in base.parent.iterdir()
        if file.stem == base.stem and len(file.suffix) == 4 and file.suffix[1:].isdecimal() and file.suffix != ".000"
    ]
