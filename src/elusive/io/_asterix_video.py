"""Spokes in messages of ASTERIX category 240, Radar Video Transmission.

EUROCONTROL-SPEC-0149-240, Edition 1.3: user application profile and data items. Compression is a matter of agreement
there; zlib's is read, which is what encoders use. A radial may come in several messages, each a part of its ranges.
"""

from __future__ import annotations

import math
import re
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.io._asterix_blocks import blocks_of
from elusive.io._asterix_items import MalformedError, items_present
from elusive.io._spoke_parts import MAX_SAMPLES, SpokeParts

CATEGORY = 240
LIGHT_MPS = 299_792_458.0
SUMMARY, VIDEO = 1, 2  # types of messages
BITS = {1: 1, 2: 2, 3: 4, 4: 8, 5: 16, 6: 32}  # by the code of the resolution
# octets of the items in the order of their field reference numbers; None: a count, then so many times the next number
SIZES = (2, 1, 4, None, 12, 12, 2, 5, None, None, None, 3)
REPEATED = {3: 1, 8: 4, 9: 64, 10: 256}
SOURCE, TYPE, NUMBER, TEXT, NANO, FEMTO, CODING, COUNTS, LOW, MEDIUM, HIGH, DAY = range(12)
FARTHEST_M = 5e6
MAX_OPEN = 16  # radials of which more may come
TOLD = re.compile(r"\b(bits|azimuth)=(\w+)")


class _Radial(NamedTuple):
    """One message of video."""

    azimuth: int  # twice, in parts of 2**16 of a turn
    first: int  # cell
    cell_s: float
    cells: NDArray[np.generic]
    bits: int
    day_s: float
    came_s: float


class VideoMessages:
    """Reads the messages of one source, one packet after the other.

    Parameters
    ----------
    from_bow
        Whether azimuths count from the bow.
    """

    def __init__(self, from_bow: bool = False) -> None:
        self._number: dict[str, int] = {}  # of each radar's latest message
        self._open: dict[str, _Radial] = {}  # a radial of which more may come
        self._bits: dict[str, int] = {}  # as told by a summary
        self._from_bow = from_bow
        self._told: dict[str, str] = {}  # what azimuths count from, as a summary says it

    @property
    def told_azimuths(self) -> bool:
        """Whether anybody said what azimuths count from."""
        return self._from_bow or bool(self._told)

    def read(self, packet: bytes, came_s: float, counts: Counter[str]) -> Iterator[SpokeParts]:
        """Yield the spokes that a packet ends.

        Parameters
        ----------
        packet
            Data blocks, one after the other.
        came_s
            When it was received.
        counts
            Is added to: ``malformed`` messages, ``lost`` ones by their numbers, ``summaries``, ``category N`` blocks of
            others, ``other packets``.
        """
        for block in blocks_of(packet, CATEGORY, counts):
            at = 0
            while at < len(block):
                try:
                    items, at = _items(block, at)
                    yield from self._message(items, came_s, counts)
                except (MalformedError, zlib.error):
                    counts["malformed"] += 1
                    break

    def rest(self) -> Iterator[SpokeParts]:
        """Yield the radials that were still open when the source ended."""
        for radar in list(self._open):
            yield self._closed(radar)

    def _message(self, items: dict[int, bytes], came_s: float, counts: Counter[str]) -> Iterator[SpokeParts]:
        if SOURCE not in items or TYPE not in items:
            raise MalformedError
        radar, kind = f"{items[SOURCE][0]}/{items[SOURCE][1]}", items[TYPE][0]
        if kind == SUMMARY:
            counts["summaries"] += 1
            self._summary(radar, items.get(TEXT, b"").decode("ascii", "replace"))
        elif kind == VIDEO:
            if NUMBER in items:
                number = int.from_bytes(items[NUMBER])
                skipped = (number - self._number.get(radar, number - 1) - 1) & 0xFFFFFFFF
                counts["lost"] += skipped if skipped < 1 << 16 else 0
                self._number[radar] = number
            radial = _radial(items, came_s)
            before = self._open.get(radar)
            if before is not None and _follows(before, radial):
                radial = radial._replace(first=before.first, cells=np.concatenate([before.cells, radial.cells]))
            elif before is not None:
                yield self._closed(radar)
            self._open[radar] = radial
            if len(self._open) > MAX_OPEN:
                yield self._closed(next(iter(self._open)))
        else:
            raise MalformedError

    def _summary(self, radar: str, text: str) -> None:
        """Heed what this project's own writer says of its recordings."""
        for name, value in TOLD.findall(text):
            if name == "bits" and value.isdecimal() and 1 <= int(value) <= 32:
                self._bits[radar] = int(value)
            elif name == "azimuth":
                self._told[radar] = value

    def _closed(self, radar: str) -> SpokeParts:
        radial = self._open.pop(radar)
        step_m = LIGHT_MPS * radial.cell_s / 2
        azimuth_rad, start_m = np.array([radial.azimuth * (math.pi / 2**16)]), radial.first * step_m
        bits = self._bits.get(radar, radial.bits)
        if bits > radial.bits or int(radial.cells.max()) >> bits:
            bits = radial.bits
        from_bow, cells = self._from_bow or self._told.get(radar) == "bow", radial.cells[None]
        return SpokeParts(radar, azimuth_rad, from_bow, start_m, step_m, cells, bits, None, radial.came_s, radial.day_s)


def _items(block: bytes, start: int) -> tuple[dict[int, bytes], int]:
    """Return a record's items by their place in the profile, and where the next record begins."""
    present, at = items_present(block, start)
    if present[: NUMBER + 1] == [True, True, False] and block[at + 2 : at + 3] == bytes([VIDEO]):
        # a message of video has its number, and one widespread encoder (pycatzao) does not say so
        numbered = [*present[:NUMBER], True, *present[NUMBER + 1 :]]
        with suppress(MalformedError):
            return _present(block, at, numbered)
    return _present(block, at, present)


def _present(block: bytes, at: int, present: list[bool]) -> tuple[dict[int, bytes], int]:
    items = {}
    for place, there in enumerate(present):
        if not there:
            continue
        size = _size(block, at, place)
        if at + size > len(block):
            raise MalformedError
        items[place] = block[at : at + size]
        at += size
    if not items:
        raise MalformedError
    return items, at


def _size(block: bytes, at: int, place: int) -> int:
    fixed = SIZES[place] if place < len(SIZES) else None
    if fixed is not None:
        return fixed
    if at >= len(block) or place > len(SIZES) + 1:
        raise MalformedError
    # behind the twelve items stand two, reserved and for special purposes, that begin with their own length
    size = 1 + REPEATED[place] * block[at] if place in REPEATED else block[at]
    if size == 0:
        raise MalformedError
    return size


def _radial(items: dict[int, bytes], came_s: float) -> _Radial:
    """Return what a message of video holds."""
    header = items.get(NANO, items.get(FEMTO))
    block = next((items[place][1:] for place in (LOW, MEDIUM, HIGH) if place in items), None)
    if header is None or block is None or CODING not in items or COUNTS not in items:
        raise MalformedError
    start, end = int.from_bytes(header[:2]), int.from_bytes(header[2:4])
    width = (end - start) & 0xFFFF
    first, cell_s = int.from_bytes(header[4:8]), int.from_bytes(header[8:]) * (1e-9 if NANO in items else 1e-15)
    bits, count = BITS.get(items[CODING][1]), int.from_bytes(items[COUNTS][2:])
    if bits is None or not 0 < count <= MAX_SAMPLES or not 0 < (first + count) * cell_s * LIGHT_MPS / 2 < FARTHEST_M:
        raise MalformedError
    needed = -(-count * bits // 8)
    if items[CODING][0] & 0x80:
        # what is padding behind the compressed octets is left to the decompressor, the number of them unread
        block = zlib.decompressobj(wbits=47).decompress(block, needed)
    if len(block) < needed:
        raise MalformedError
    day_s = int.from_bytes(items[DAY]) / 128 if DAY in items else math.nan
    # an end before its start says nothing
    azimuth = (2 * start + (width if width < 0x8000 else 0)) % 2**17
    return _Radial(azimuth, first, cell_s, _cells(block[:needed], bits)[:count], bits, day_s, came_s)


def _cells(octets: bytes, bits: int) -> NDArray[np.generic]:
    if bits > 8:
        return np.frombuffer(octets, f">u{bits // 8}").astype(f"u{bits // 8}")
    packed = np.frombuffer(octets, np.uint8)
    if bits == 8:
        return packed
    shifts = np.arange(8 - bits, -1, -bits, dtype=np.uint8)
    return (packed[:, None] >> shifts & np.uint8(2**bits - 1)).ravel()


def _follows(before: _Radial, radial: _Radial) -> bool:
    """Whether a message holds the next cells of the same radial."""
    return (
        (before.azimuth, before.cell_s, before.bits) == (radial.azimuth, radial.cell_s, radial.bits)
        and radial.first == before.first + len(before.cells)
        and len(before.cells) + len(radial.cells) <= MAX_SAMPLES
    )
