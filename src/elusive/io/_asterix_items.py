"""Data items of ASTERIX category 048: how long each is, and the values of those used here.

EUROCONTROL-SPEC-0149-4, Part 4, Category 048 Monoradar Target Reports, Edition 1.27: user application profile
(table 2) and data items (section 5.2). General structure: Part 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

NM_M = 1852.0
TURN_RAD = 2.0 * math.pi
FX = 1  # the last bit of an octet: another follows
ICAO = " ABCDEFGHIJKLMNOPQRSTUVWXYZ     " + " " * 16 + "0123456789      "  # six-bit characters


class MalformedError(Exception):
    """A record that the profile cannot explain."""


class TargetReport(NamedTuple):
    """One record of category 048; None or NaN where it has no such item."""

    radar: tuple[int, int] | None = None  # 010: system area code and system identification code
    time_s: float = math.nan  # 140: after midnight, UTC
    kind: int | None = None  # 020: 0 no detection, 1 primary, 2 secondary, 3 both, 4 to 7 Mode S
    real: bool = True  # 020: neither simulated, nor a test target, nor a fixed transponder
    range_m: float = math.nan  # 040: slant range; NaN beyond 256 NM
    bearing_rad: float = math.nan  # 040: clockwise from north
    doppler_mps: float = math.nan  # 120: calculated; NaN where the radar doubts it
    x_m: float = math.nan  # 042: east of the radar, of the track
    y_m: float = math.nan  # 042: north
    speed_mps: float = math.nan  # 200: over ground, of the track
    heading_rad: float = math.nan  # 200: clockwise from north
    track: int | None = None  # 161: number that the radar's own tracker gave
    mode_3a: str | None = None  # 070: four octal digits
    address: int | None = None  # 220: of the aircraft's transponder, 24 bits
    callsign: str | None = None  # 240


def decode(data: bytes, start: int) -> tuple[TargetReport, int]:
    """Decode the record that begins at an octet; also return where the next begins.

    Raises
    ------
    MalformedError
        If the record runs past the end, has no item or an unknown one, or its time of day is none.
    """
    present, at = items_present(data, start)
    if not any(present) or any(present[len(PROFILE) :]):
        raise MalformedError
    values: dict[str, object] = {}
    for (length, read), there in zip(PROFILE, present, strict=False):
        if there:
            end = at + length(data, at)
            if end > len(data):
                raise MalformedError
            if read is not None:
                values |= read(data[at:end])
            at = end
    if values.pop("beyond", False):
        values["range_m"] = math.nan
    return TargetReport(**values), at  # type: ignore[arg-type]


def items_present(data: bytes, start: int) -> tuple[list[bool], int]:
    """Return which items a record says it has, in the order of the profile, and where the first begins.

    Raises
    ------
    MalformedError
        If that runs past the end.
    """
    present, at, more = list[bool](), start, True
    while more:
        octet = _octet(data, at)
        present += [bool(octet >> bit & 1) for bit in range(7, 0, -1)]
        more, at = bool(octet & FX), at + 1
    return present, at


def _octet(data: bytes, at: int) -> int:
    if at >= len(data):
        raise MalformedError
    return data[at]


# ---------------------------------------------------------------------------------------------------- lengths, octets


def _fixed(size: int) -> Callable[[bytes, int], int]:
    return lambda data, at: size


def _extended(data: bytes, at: int) -> int:
    end = at
    while _octet(data, end) & FX:
        end += 1
    return end + 1 - at


def _repeated(size: int) -> Callable[[bytes, int], int]:
    return lambda data, at: 1 + size * _octet(data, at)


def _explicit(data: bytes, at: int) -> int:
    size = _octet(data, at)  # it counts itself
    if size == 0:
        raise MalformedError
    return size


def _compound(*parts: Callable[[bytes, int], int]) -> Callable[[bytes, int], int]:
    def length(data: bytes, at: int) -> int:
        primary, end = _octet(data, at), at + 1
        known = 0xFF >> len(parts) ^ 0xFF
        if primary & ~known:
            raise MalformedError
        for number, part in enumerate(parts):
            if primary >> 7 - number & 1:
                end += part(data, end)
        return end - at

    return length


# ------------------------------------------------------------------------------------------------------------- values


def _signed(octets: bytes) -> int:
    return int.from_bytes(octets, signed=True)


def _unsigned(octets: bytes) -> int:
    return int.from_bytes(octets)


def _source(item: bytes) -> dict[str, object]:
    return {"radar": (item[0], item[1])}


def _time(item: bytes) -> dict[str, object]:
    time_s = _unsigned(item) / 128
    if time_s >= 86400:
        raise MalformedError
    return {"time_s": time_s}


def _descriptor(item: bytes) -> dict[str, object]:
    simulated, fixed = item[0] >> 4 & 1, item[0] >> 1 & 1
    test = len(item) > 1 and item[1] >> 7
    beyond = len(item) > 1 and bool(item[1] >> 6 & 1)  # item 040 cannot hold the range
    return {"kind": item[0] >> 5, "real": not (simulated or fixed or test), "beyond": beyond}


def _polar(item: bytes) -> dict[str, object]:
    return {
        "range_m": _unsigned(item[:2]) * NM_M / 256,
        "bearing_rad": _unsigned(item[2:]) * TURN_RAD / 65536,
    }


def _cartesian(item: bytes) -> dict[str, object]:
    return {"x_m": _signed(item[:2]) * NM_M / 128, "y_m": _signed(item[2:]) * NM_M / 128}


def _velocity(item: bytes) -> dict[str, object]:
    return {
        "speed_mps": _unsigned(item[:2]) * NM_M / 16384,
        "heading_rad": _unsigned(item[2:]) * TURN_RAD / 65536,
    }


def _doppler(item: bytes) -> dict[str, object]:
    # The raw Doppler speeds, the second part, are ambiguous and so left alone.
    word = _unsigned(item[1:3])
    if not item[0] >> 7 or word >> 15:
        return {}
    speed = word & 0x3FF
    return {"doppler_mps": float(speed - 0x400 if speed >> 9 else speed)}


def _track(item: bytes) -> dict[str, object]:
    return {"track": _unsigned(item) & 0xFFF}


def _mode_3a(item: bytes) -> dict[str, object]:
    return {"mode_3a": f"{_unsigned(item) & 0xFFF:04o}"}


def _address(item: bytes) -> dict[str, object]:
    return {"address": _unsigned(item)}


def _callsign(item: bytes) -> dict[str, object]:
    word = _unsigned(item)
    return {"callsign": "".join(ICAO[word >> shift & 63] for shift in range(42, -1, -6)).rstrip()}


# In the order of the field reference numbers 1 to 28.
PROFILE: tuple[tuple[Callable[[bytes, int], int], Callable[[bytes], dict[str, object]] | None], ...] = (
    (_fixed(2), _source),  # 010
    (_fixed(3), _time),  # 140
    (_extended, _descriptor),  # 020
    (_fixed(4), _polar),  # 040
    (_fixed(2), _mode_3a),  # 070
    (_fixed(2), None),  # 090 flight level
    (_compound(*[_fixed(1)] * 7), None),  # 130 plot characteristics
    (_fixed(3), _address),  # 220
    (_fixed(6), _callsign),  # 240
    (_repeated(8), None),  # 250 Mode S data
    (_fixed(2), _track),  # 161
    (_fixed(4), _cartesian),  # 042
    (_fixed(4), _velocity),  # 200
    (_extended, None),  # 170 track status
    (_fixed(4), None),  # 210 track quality
    (_extended, None),  # 030 warnings
    (_fixed(2), None),  # 080 Mode 3/A confidence
    (_fixed(4), None),  # 100 Mode C and confidence
    (_fixed(2), None),  # 110 height
    (_compound(_fixed(2), _repeated(6)), _doppler),  # 120
    (_fixed(2), None),  # 230 communications
    (_fixed(7), None),  # 260 collision avoidance
    (_fixed(1), None),  # 055 Mode 1
    (_fixed(2), None),  # 050 Mode 2
    (_fixed(1), None),  # 065 Mode 1 confidence
    (_fixed(2), None),  # 060 Mode 2 confidence
    (_explicit, None),  # special purpose
    (_explicit, None),  # reserved expansion
)
