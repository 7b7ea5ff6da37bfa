"""Data blocks of ASTERIX (EUROCONTROL-SPEC-0149, Part 1), in a raw file and in a packet."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import BinaryIO

HEADER = 3  # octets of a block's category and length


def raw_blocks(file: BinaryIO, counts: Counter[str]) -> Iterator[tuple[float, bytes]]:
    """Yield each block of a raw file, at no known time; behind a length that does not fit, none can be found."""
    while header := file.read(HEADER):
        size = int.from_bytes(header[1:])
        block = header + file.read(max(size - HEADER, 0))
        if len(header) < HEADER or size < HEADER or len(block) < size:
            counts["malformed"] += 1
            return
        yield math.nan, block


def blocks_of(payload: bytes, wanted: int, counts: Counter[str]) -> Iterator[bytes]:
    """Yield the records of each block of the wanted category, all at once; others are counted."""
    at = 0
    while at < len(payload):
        category, size = payload[at], int.from_bytes(payload[at + 1 : at + HEADER])
        if at + HEADER > len(payload) or not HEADER <= size <= len(payload) - at:
            # a packet that begins otherwise is some other traffic
            counts["malformed" if category == wanted else "other packets"] += 1
            return
        if category == wanted:
            yield payload[at + HEADER : at + size]
        else:
            counts[f"category {category}"] += 1
        at += size
