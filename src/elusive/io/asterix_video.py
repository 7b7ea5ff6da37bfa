"""Radar video written as ASTERIX category 240: to a file, to a network capture, or sent over UDP.

EUROCONTROL-SPEC-0149-240, Edition 1.3. Captures and UDP also carry heading and position, as NMEA sentences.
"""

from __future__ import annotations

import math
import os
import socket
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elusive.errors import DataError
from elusive.io._asterix_video import BITS, CATEGORY, LIGHT_MPS, SUMMARY, VIDEO
from elusive.io._sentences import sentence_of
from elusive.io.atomic import atomic_path
from elusive.io.pcap import capture_start, captured_udp
from elusive.io.sources import address_of
from elusive.io.sources.packets import OPTIONS
from elusive.sensors.spokes import Spokes, check_spokes

CAPTURES = (".pcap", ".cap")
SOURCE, GROUP, NMEA = ("192.0.2.1", 4240), ("233.252.0.240", 4240), ("233.252.0.240", 10110)  # RFC 5737, 6676
TURN = 2**16  # units of an azimuth
MOST = 60_000  # octets of video in a message; what is more goes into another one
VOLUMES = ((0x40, 4), (0x20, 64), (0x10, 256))  # flag of a video block in the second octet, and its unit
OWN_S = 0.1  # from each heading and position to the next
DAY_S = 86_400.0

Send = Callable[[float, bytes, bool], None]  # time, octets, whether they are a sentence


def write_asterix_video(
    path: str | os.PathLike[str], spokes: Iterable[Spokes], *, radar: tuple[int, int] = (0, 1), compress: bool = True
) -> int:
    """Write radar video as category 240, whole or not at all.

    Parameters
    ----------
    path
        ``.pcap``: a network capture, with headings and positions beside as NMEA sentences (HDT, GLL); any other name:
        raw data blocks, which have the time of day alone.
    spokes
        In the order of time, taken one by one. Amplitudes are written in 1, 2, 4, 8, 16 or 32 bits, whichever hold
        theirs. Azimuths are rounded to 2^-17 turn, times to 1/128 s; ``start_m`` must be whole steps.
    radar
        System area code and system identification code, 0 to 255.
    compress
        Whether video blocks are compressed by zlib, as other programs also read it.

    Returns
    -------
    int
        Spokes written.

    Raises
    ------
    DataError
        If spokes contradict themselves or cannot be written so, or the file cannot be written.
    """
    is_capture = str(path).lower().endswith(CAPTURES)
    with atomic_path(path) as temporary, temporary.open("wb") as file:

        def write(time_s: float, octets: bytes, is_sentence: bool) -> None:
            if is_capture:
                file.write(captured_udp(time_s, octets, SOURCE, NMEA if is_sentence else GROUP))
            elif not is_sentence:
                file.write(octets)

        if is_capture:
            file.write(capture_start())
        return _each(spokes, radar, compress, write, str(path))


def send_asterix_video(
    address: str,
    spokes: Iterable[Spokes],
    *,
    radar: tuple[int, int] = (0, 1),
    compress: bool = True,
    speed: float = 1.0,
    wait: Callable[[float], object] = time.sleep,
) -> int:
    """Send radar video as category 240 over UDP, each spoke when its time has come; sentences go to the same place.

    Parameters
    ----------
    address
        ``udp://host:port``; of a multicast group, sent on the network whose own address is the option ``interface``.
    spokes, radar, compress
        As for :func:`write_asterix_video`.
    speed
        Times as fast; infinite: without waiting.
    wait
        Sleeps so many seconds.

    Returns
    -------
    int
        Spokes sent.

    Raises
    ------
    DataError
        If the address is none, spokes cannot be written so, or the system refuses.
    """
    place = address_of(address, OPTIONS)
    started_s, first_s = time.monotonic(), math.nan
    try:
        family, _, _, _, where = socket.getaddrinfo(place.host, place.port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as mouth:
            if place.is_multicast and family == socket.AF_INET and place.options.get("interface"):
                network = socket.inet_aton(place.options["interface"])
                mouth.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, network)

            def send(time_s: float, octets: bytes, is_sentence: bool) -> None:
                nonlocal first_s
                first_s = time_s if math.isnan(first_s) else first_s
                early_s = (time_s - first_s) / speed - (time.monotonic() - started_s)
                if early_s > 0:
                    wait(early_s)
                mouth.sendto(octets, where)

            return _each(spokes, radar, compress, send, address)
    except OSError as error:
        raise DataError(f"{address}: cannot be sent to ({error.strerror or error}); check the address.") from None


def _each(spokes: Iterable[Spokes], radar: tuple[int, int], compress: bool, send: Send, name: str) -> int:
    if not all(0 <= code <= 255 for code in radar):
        raise DataError(f"{name}: radar={radar}: give two codes from 0 to 255.")
    number, own_s, before_rad = 0, -math.inf, math.inf
    for part in spokes:
        check_spokes(part, name)
        code, first = _checked(part, name)
        for at, time_s in enumerate(part.time_s):
            azimuth_rad = float(part.azimuth_rad[at])
            if azimuth_rad < before_rad:  # a turn begins
                send(time_s, _summary(part, code, radar), False)
            before_rad = azimuth_rad
            if time_s >= own_s + OWN_S or at == len(part.time_s) - 1:
                for sentence in _sentences(part, at):
                    send(time_s, sentence, True)
                own_s = time_s
            for octets in _messages(part, at, code, first, number, radar, compress):
                send(time_s, octets, False)
            number += 1
    return number


def _checked(part: Spokes, name: str) -> tuple[int, int]:
    """Return the code of the amplitudes' bits, and how many steps from the radar the first sample lies.

    Raises
    ------
    DataError
        If they cannot be written.
    """
    if part.bits == 0:
        raise DataError(f"{name}: category 240 holds whole numbers, and amplitudes are real; quantise them first.")
    steps = part.start_m / part.step_m
    if abs(steps - round(steps)) > 0.01 or not 0 <= round(steps) < 2**32:
        raise DataError(
            f"{name}: start_m={part.start_m:g}: category 240 counts it in whole steps of {part.step_m:g} m; shift it."
        )
    return next(code for code, bits in BITS.items() if bits >= part.bits), round(steps)


def _summary(part: Spokes, code: int, radar: tuple[int, int]) -> bytes:
    """Return a message that says what the standard has no place for, in words of this project's own."""
    told = (
        ["elusive"]
        + [f"bits={part.bits}"] * (BITS[code] != part.bits)
        + [f"azimuth={'north' if part.from_north else 'bow'}"]
    )
    text = " ".join(told).encode("ascii")
    return _block(bytes([0b1101_0000, *radar, SUMMARY, len(text)]) + text)


def _messages(
    part: Spokes, at: int, code: int, first: int, number: int, radar: tuple[int, int], compress: bool
) -> Iterator[bytes]:
    """Yield the messages of a spoke: one, where it is not very long."""
    middle = round(float(part.azimuth_rad[at]) / (2 * math.pi) * 2 * TURN)  # in halves, for it lies between two ends
    beside = middle % 2 + 2 * max(round(_width(part) / 2), 0)
    azimuth = ((middle - beside) // 2 % TURN).to_bytes(2) + ((middle + beside) // 2 % TURN).to_bytes(2)
    nano = part.step_m * 2 / LIGHT_MPS * 1e15 >= 2**32
    cell = round(part.step_m * 2 / LIGHT_MPS * (1e9 if nano else 1e15)).to_bytes(4)
    day = (round(part.time_s[at] % DAY_S * 128) % round(DAY_S * 128)).to_bytes(3)
    bits = BITS[code]
    together = MOST * 8 // bits
    for begin in range(0, part.amplitude.shape[1], together):
        cells = part.amplitude[at, begin : begin + together]
        packed = _packed(cells, bits)
        video = zlib.compress(packed) if compress else packed
        flag, unit = next((flag, unit) for flag, unit in VOLUMES if len(video) <= 255 * unit)
        times = -(-len(video) // unit)
        yield _block(
            bytes([0b1110_0011 | (8 if nano else 4), 0b1000_1000 | flag, *radar, VIDEO])
            + (number & 0xFFFFFFFF).to_bytes(4) + azimuth + (first + begin).to_bytes(4) + cell
            + bytes([0x80 if compress else 0, code]) + len(video).to_bytes(2) + len(cells).to_bytes(3)
            + bytes([times]) + video.ljust(times * unit, b"\0") + day
        )  # fmt: skip


def _width(part: Spokes) -> int:
    """Return how far it is from spoke to spoke, in units of azimuths."""
    if len(part.azimuth_rad) < 2:
        return 0
    swept = float(np.median(np.diff(part.azimuth_rad) % (2 * math.pi)))
    return round(swept / (2 * math.pi) * TURN) if swept < math.pi / 8 else 0


def _packed(cells: NDArray[Any], bits: int) -> bytes:
    """Return amplitudes as octets, the first cell and the highest bit first."""
    if bits >= 8:
        return cells.astype(f">u{bits // 8}").tobytes()
    count = 8 // bits
    padded = np.zeros(-(-len(cells) // count) * count, np.uint8)
    padded[: len(cells)] = cells
    shifts = np.arange(8 - bits, -1, -bits, dtype=np.uint8)
    return bytes(np.bitwise_or.reduce(padded.reshape(-1, count) << shifts, axis=1).astype(np.uint8))


def _block(record: bytes) -> bytes:
    return bytes([CATEGORY]) + (3 + len(record)).to_bytes(2) + record


def _sentences(part: Spokes, at: int) -> Iterator[bytes]:
    heading_rad, (lon, lat) = float(part.heading_rad[at]), part.lonlat_deg[at]
    if math.isfinite(heading_rad):
        yield sentence_of(f"HEHDT,{math.degrees(heading_rad) % 360:.4f},T")
    if math.isfinite(lon + lat):
        clock = datetime.fromtimestamp(float(part.time_s[at]), UTC).strftime("%H%M%S.%f")[:-3]
        place = f"{_minutes(abs(lat), 2)},{'S' if lat < 0 else 'N'},{_minutes(abs(lon), 3)},{'W' if lon < 0 else 'E'}"
        yield sentence_of(f"GPGLL,{place},{clock},A,A")


def _minutes(degrees: float, digits: int) -> str:
    minutes = round(degrees * 60, 6)
    return f"{int(minutes // 60):0{digits}d}{minutes % 60:09.6f}"
