"""Spokes in the packets of Navico 4G and HALO radars.

A packet is 8 octets, of which the sixth counts the spokes, then for each spoke 24 octets and 1024 samples of 4 bits.
Little-endian: length 24 (u8), status (u8), number (u16), mark (u16), large range (u16), angle (u16, 4096 a turn, from
the bow), heading (u16, the same units), small range (u16), a clock (u16), 8 octets more.
"""

from __future__ import annotations

import math
from collections import Counter
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.io._spoke_parts import SpokeParts

HEAD, SPOKE_HEAD, DATA, SAMPLES, BITS = 8, 24, 512, 1024, 4
START = bytes([1, 0, 0, 0, 0])
TURN = 4096
KINDS_OF_HEADING, TRUE_HEADING = 0xF000, 0x4000  # flags of a heading; without any it is magnetic
AT_CLOSE = 0x80  # a large range that says that the small one counts alone
NUMBERS = 4096  # of spokes; a HALO's have more bits above
REPORT = bytes([0x03, 0xC4])  # begins a radar's report of itself, and its model follows: whether it is a HALO
MODELS = {0: True, 1: False}
FARTHEST_4G_M = 100e3  # a 4G's longest scale is 67 km
OLDER = 0x0E0D  # stands where the large range does, in the packets of BR24 and 3G
HEADER = np.dtype(
    {
        "names": ["length", "status", "number", "large", "angle", "heading", "small", "data"],
        "formats": ["u1", "u1", "<u2", "<u2", "<u2", "<u2", "<u2", ("u1", DATA)],
        "offsets": [0, 1, 2, 6, 8, 10, 12, SPOKE_HEAD],
    }
)


def is_navico(packet: bytes) -> bool:
    """Whether a packet begins as one of spokes does."""
    return (
        len(packet) > HEAD + SPOKE_HEAD
        and packet.startswith(START)
        and int.from_bytes(packet[6:8], "little") == DATA
        and packet[HEAD] == SPOKE_HEAD
    )


class NavicoPackets:
    """Reads the packets of one source, one after the other."""

    def __init__(self) -> None:
        self._number: dict[str, int] = {}  # of each radar's latest spoke
        self._halo: dict[str, bool] = {}  # by host, as its reports say

    def hear(self, packet: bytes, source: str) -> None:
        """Take in what a radar reports of itself: which model it is."""
        if packet.startswith(REPORT) and len(packet) > len(REPORT) and packet[len(REPORT)] in MODELS:
            self._halo[_host(source)] = MODELS[packet[len(REPORT)]]

    def read(
        self, packet: bytes, came_s: float, source: str, destination: str, counts: Counter[str]
    ) -> list[SpokeParts]:
        """Return the spokes of a packet, those of each range scale together.

        Parameters
        ----------
        packet
            Such as :func:`is_navico` says.
        came_s
            When it was received.
        source, destination
            Addresses; the second is the radar's name, since a radar with two ranges sends to two groups.
        counts
            Is added to: ``damaged`` and ``lost`` spokes, and those of an ``older radar``, whose range scale is not
            known here.
        """
        told, held = packet[5], (len(packet) - HEAD) // HEADER.itemsize
        counts["damaged"] += max(told - held, 0)
        spokes = np.frombuffer(packet, HEADER, min(told, held), HEAD)
        older = spokes["large"] == OLDER
        counts["older radar"] += int(older.sum())
        # the second bit of the status is set where the spoke holds what was received
        whole = (spokes["length"] == SPOKE_HEAD) & (spokes["status"] & 2 > 0) & (spokes["angle"] < TURN)
        counts["damaged"] += int((~whole & ~older).sum())
        spokes = spokes[whole & ~older]
        if not len(spokes):
            return []
        first, last = int(spokes["number"][0]) % NUMBERS, int(spokes["number"][-1]) % NUMBERS
        counts["lost"] += (first - self._number.get(destination, first - 1) - 1) % NUMBERS
        self._number[destination] = last
        range_m = _range_m(spokes, self._is_halo(spokes, _host(source)))
        counts["damaged"] += int((range_m <= 0).sum())
        return [
            _of_one_scale(spokes[list(group)], destination, scale_m, came_s)
            for scale_m, group in groupby(np.flatnonzero(range_m > 0), key=lambda at: float(range_m[at]))
        ]

    def _is_halo(self, spokes: NDArray[Any], host: str) -> bool:
        """Whether the scale is the product that a HALO means: as it reports, or by numbers that no 4G sends."""
        seen = bool((spokes["number"] >= NUMBERS).any() or (64.0 * spokes["large"] > FARTHEST_4G_M).any())
        return self._halo.get(host, seen)


def _host(address: str) -> str:
    return address.rpartition(":")[0]


def _of_one_scale(spokes: NDArray[Any], radar: str, range_m: float, came_s: float) -> SpokeParts:
    azimuth_rad, heading_rad = spokes["angle"] * (2 * math.pi / TURN), _heading_rad(spokes["heading"])
    return SpokeParts(
        radar, azimuth_rad, True, 0.0, range_m / SAMPLES, _nibbles(spokes["data"]), BITS, heading_rad, came_s
    )


def _range_m(spokes: NDArray[Any], halo: bool) -> Array:
    large, small = spokes["large"].astype(np.float64), spokes["small"].astype(np.float64)
    far = large * small / 512 if halo else 64 * large
    return np.where(large == AT_CLOSE, small / 4, far)


def _heading_rad(heading: NDArray[Any]) -> Array:
    return np.where(heading & KINDS_OF_HEADING == TRUE_HEADING, (heading & (TURN - 1)) * (2 * math.pi / TURN), np.nan)


def _nibbles(data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the samples, the lower half of each octet first."""
    return np.stack([data & 15, data >> 4], axis=-1).reshape(len(data), SAMPLES)
