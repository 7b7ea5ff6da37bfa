"""Target reports of a radar in ASTERIX category 048, from raw files and network captures.

EUROCONTROL-SPEC-0149, Part 1 (data blocks) and Part 4 (category 048, Edition 1.27). Recordings are read as untrusted
data: a malformed record is counted and left out with the rest of its block, since nothing tells where the next begins.
"""

from __future__ import annotations

import heapq
import math
import os
from collections import Counter, deque
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from elusive.errors import DataError
from elusive.io._asterix_blocks import blocks_of, raw_blocks
from elusive.io._asterix_items import MalformedError, TargetReport, decode
from elusive.io._opened import opened, readable
from elusive.io._spoke_arrays import is_arrays
from elusive.io.pcap import is_capture, udp_payloads
from elusive.sensors.radar_scans import RadarPlot

CATEGORY = 48
DAY_S = 86400.0
REMEMBERED = 4096  # records among which one seen again is a duplicate
DISORDER_S = 10.0  # by which a report may come before one that is earlier
MAX_WAITING = 100_000  # reports held back to be put in order


class AsterixSummary(NamedTuple):
    """What an ASTERIX recording holds."""

    reports: int  # records of category 048
    malformed: int  # that could not be read
    others: dict[int, int]  # blocks of each other category
    radars: dict[tuple[int, int] | None, int]  # reports of each radar (SAC, SIC)
    midnight_unix_s: float  # from which times count, by the capture's clock; NaN for a raw file


def summarize_asterix(path: str | os.PathLike[str]) -> AsterixSummary:
    """Read a recording once and say what is in it.

    Raises
    ------
    DataError
        If it cannot be read, or holds no record of category 048.
    """
    counts, radars, midnight = Counter[str](), Counter[tuple[int, int] | None](), math.nan
    for unix_s, _, report in _records(Path(path), counts):
        radars[report.radar] += 1
        if math.isnan(midnight) and not math.isnan(report.time_s - unix_s):
            midnight = DAY_S * round((unix_s - report.time_s) / DAY_S)
    others = {int(key.split()[1]): count for key, count in counts.items() if key.startswith("category ")}
    return AsterixSummary(counts["reports"], counts["malformed"], others, dict(radars), midnight)


def read_asterix(path: str | os.PathLike[str], counts: Counter[str] | None = None) -> Iterator[TargetReport]:
    """Read the records of category 048 one by one, in the order of the file.

    Parameters
    ----------
    path
        Raw data blocks, or a capture (pcap, pcapng) of UDP packets that carry them. Blocks of other categories are
        passed over.
    counts
        Where given, is added to as the file is read: ``reports``, ``malformed`` and ``category N``, blocks of others.

    Yields
    ------
    TargetReport
        A record; its time counts from the midnight (UTC) before it.

    Raises
    ------
    DataError
        If the file cannot be read, or holds no record of category 048.
    """
    for _, _, report in _records(Path(path), Counter() if counts is None else counts):
        yield report


def asterix_plots(
    path: str | os.PathLike[str], radar: tuple[int, int] | None = None, counts: Counter[str] | None = None
) -> Iterator[RadarPlot]:
    """Read the plots of one radar, in the order of time.

    Left out and counted are records that came twice (a capture of both of two networks), reports of no detection (a
    radar's own extrapolation), simulated and test targets and fixed transponders, and what has no time, no position or
    is beyond 256 NM. A report may come up to 10 s late. The Doppler is item 120's calculated one where the radar does
    not doubt it, taken as the range rate: the specification leaves its sign to the radar.

    Parameters
    ----------
    path
        Recording, as for :func:`read_asterix`.
    radar
        System area code and system identification code; needed where several radars report.
    counts
        Where given, is added to as the file is read: as for :func:`read_asterix`, and ``duplicates``,
        ``no detection``, ``not real``, ``no position``, ``late``.

    Yields
    ------
    RadarPlot
        A plot; its time counts from the midnight (UTC) before the first report, over the next midnights too.

    Raises
    ------
    DataError
        If the file cannot be read or holds no plot of that radar, or several radars report and none was chosen.
    """
    file, counts = Path(path), Counter() if counts is None else counts
    chosen = _chosen(file, radar)
    waiting: list[tuple[float, int, RadarPlot]] = []
    last, emitted, number = math.nan, -math.inf, 0
    for report in _once(file, counts):
        if report.radar != chosen:
            continue
        fault = fault_of(report)
        if fault:
            counts[fault] += 1
            continue
        plot = plot_of(report, last)
        last = time_s = plot.time_s
        if time_s < emitted:
            counts["late"] += 1
            continue
        number += 1
        heapq.heappush(waiting, (time_s, number, plot))
        while waiting and (waiting[0][0] < last - DISORDER_S or len(waiting) > MAX_WAITING):
            emitted, _, plot = heapq.heappop(waiting)
            yield plot
    while waiting:
        yield heapq.heappop(waiting)[2]
    if number == 0:
        told = ", ".join(f"{key} {count}" for key, count in counts.items())
        raise DataError(f"{path}: its target reports hold no plot ({told}); choose another recording or radar.")


def _chosen(path: Path, radar: tuple[int, int] | None) -> tuple[int, int] | None:
    """Return the one radar that reports, or the one asked for."""
    radars = summarize_asterix(path).radars
    told = ", ".join(
        f"{'unknown' if key is None else f'{key[0]}/{key[1]}'} ({count} reports)" for key, count in radars.items()
    )
    if radar is not None and radar not in radars:
        raise DataError(f"{path}: holds no report of radar {radar[0]}/{radar[1]}; there are {told}.")
    if radar is None and len(radars) > 1:
        raise DataError(f"{path}: several radars report: {told}; choose one, because bearings are each its own.")
    return next(iter(radars)) if radar is None else radar


def fault_of(report: TargetReport) -> str | None:
    """Say why a report is no plot, or None."""
    if report.kind == 0:
        return "no detection"
    if not report.real:
        return "not real"
    return "no position" if math.isnan(report.time_s + report.range_m + report.bearing_rad) else None


def plot_of(report: TargetReport, latest_s: float) -> RadarPlot:
    """Return a report's plot, its time of day on the day that is nearest to the plot before; NaN: the first."""
    days = 0 if math.isnan(latest_s) else round((latest_s - report.time_s) / DAY_S)
    return RadarPlot(report.time_s + DAY_S * days, report.range_m, report.bearing_rad, report.doppler_mps)


def _once(path: Path, counts: Counter[str]) -> Iterator[TargetReport]:
    """Yield the reports, each record only once."""
    seen, order = set[bytes](), deque[bytes]()
    for _, octets, report in _records(path, counts):
        if octets in seen:
            counts["duplicates"] += 1
            continue
        seen.add(octets)
        order.append(octets)
        if len(order) > REMEMBERED:
            seen.discard(order.popleft())
        yield report


def _records(path: Path, counts: Counter[str]) -> Iterator[tuple[float, bytes, TargetReport]]:
    """Yield each record of the category: when it was captured, its octets and what they say."""
    before = counts["reports"]
    with readable(path), opened(path) as file:
        if is_arrays(file.peek(16)[:16]):
            raise DataError(f"{path}: holds arrays, as radar video may; track that with `elusive track video`.")
        payloads = udp_payloads(file) if is_capture(file.peek(4)[:4]) else raw_blocks(file, counts)
        for unix_s, payload in payloads:
            for block in blocks_of(payload, CATEGORY, counts):
                yield from ((unix_s, octets, report) for octets, report in reports_of(block, counts))
    if counts["reports"] == before:
        told = ", ".join(f"{key} {count}" for key, count in counts.items() if count)
        raise DataError(
            f"{path}: holds no ASTERIX record of category 048 ({told or 'nothing at all'}); give a raw recording, or "
            "one captured with pcap."
        )


def reports_of(block: bytes, counts: Counter[str]) -> Iterator[tuple[bytes, TargetReport]]:
    """Yield each record of a block, its octets and what they say, up to one that is malformed."""
    at = 0
    while at < len(block):
        try:
            report, end = decode(block, at)
        except MalformedError:
            counts["malformed"] += 1
            return
        counts["reports"] += 1
        yield block[at:end], report
        at = end
