"""Target reports of a radar in ASTERIX category 048 as they come over UDP: plots in the order of their own times."""

from __future__ import annotations

import math
from collections.abc import Iterator

from elusive.io._asterix_blocks import blocks_of
from elusive.io.asterix import CATEGORY, fault_of, plot_of, reports_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.order import in_order
from elusive.io.sources.packets import packets_of
from elusive.sensors.radar_scans import RadarPlot

ASTERIX = "asterix+"  # before udp://: packets are no lines


def is_asterix(source: str) -> bool:
    """Whether a source is an address that ASTERIX comes to."""
    return source.lower().startswith(f"{ASTERIX}udp://")


def live_asterix_plots(source: str, feed: Feed, radar: tuple[int, int] | None = None) -> Iterator[RadarPlot]:
    """Yield the plots that come to ``asterix+udp://host:port``, of one radar (SAC, SIC), else that which reports first.

    Left out and counted is what :func:`~elusive.io.asterix.asterix_plots` leaves out, and reports of ``other radars``.
    Times count from the midnight (UTC) before the first report.

    Raises
    ------
    DataError
        If it is no such address.
    """

    def plots() -> Iterator[tuple[bytes, RadarPlot]]:
        chosen, begun, latest_s = radar, radar is not None, math.nan
        for packet in packets_of(source[len(ASTERIX) :], feed):
            for block in blocks_of(packet.octets, CATEGORY, feed.counts):
                for octets, report in reports_of(block, feed.counts):
                    chosen, begun = (chosen, True) if begun else (report.radar, True)
                    fault = "other radars" if report.radar != chosen else fault_of(report)
                    if fault:
                        feed.counts[fault] += 1
                        continue
                    plot = plot_of(report, latest_s)
                    latest_s = plot.time_s
                    yield octets, plot

    def moved(report: tuple[bytes, RadarPlot], by_s: float) -> tuple[bytes, RadarPlot]:
        return report[0], report[1]._replace(time_s=report[1].time_s + by_s)

    for _, plot in in_order(plots(), lambda each: each[1].time_s, lambda each: each[0], feed, moved):
        yield plot
