"""The forms of a radio log: a row a frame, wide; a reading a line, long; what ``listenx`` writes; arrays."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import closing
from operator import attrgetter, itemgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.errors import DataError
from elusive.io.sources.cells import cells_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import STRICT, Lines
from elusive.io.sources.order import in_order
from elusive.sensors.radio_network import RadioNodes, directed_links_of

LONG = ("time_s", "tx", "rx", "channel", "rss_dbm")
TIME = "time_s"
LISTENX = "listenx"
MATRIX, RECEIVER = "matrix", "receiver"
LAYOUTS = ("channel-link", "link-channel", MATRIX, RECEIVER, LISTENX)
IN_MILLISECONDS = 1e3

Row = tuple[str, float, Array]  # where it stands, time [s], readings (D, C) [dBm]


class Columns(NamedTuple):
    """Which reading stands in which column of a row."""

    time: int  # column of the time
    times_a_second: float  # units of the time in a second
    link: NDArray[np.int64]  # (K,) directed link of each other column, in their order; -1: none, it is not read
    channel: NDArray[np.int64]  # (K,)
    channels: tuple[str, ...]
    delimiter: str | None

    def readings(self, values: Array, links: int) -> tuple[float, Array]:
        """Return a row's time [s] and its readings ``(D, C)``, NaN where no column holds one."""
        levels = np.full((links, len(self.channels)), np.nan)
        read = self.link >= 0
        levels[self.link[read], self.channel[read]] = np.delete(values, self.time)[read]
        return float(values[self.time]) / self.times_a_second, levels


def named_columns(cells: list[str], delimiter: str | None, nodes: RadioNodes, where: str) -> Columns:
    """Understand a header ``time_s, tx-rx-channel, ...``; without a channel, ``tx-rx``, there is one.

    A column without a name, as of rows that are numbered, is not read.
    """
    pairs = directed_links_of(len(nodes.names))
    number = {f"{nodes.names[tx]}-{nodes.names[rx]}": link for link, (tx, rx) in enumerate(pairs.tolist())}
    if cells.count(TIME) != 1:
        raise DataError(f"{where}: one column must be named {TIME}, the others transmitter-receiver-channel.")
    links, labels = list[int](), list[str | None]()
    for cell in cells:
        if cell == TIME:
            continue
        if not cell:
            links.append(-1)
            labels.append(None)
            continue
        pair, label = (cell, "") if cell in number else (cell.rpartition("-")[0], cell.rpartition("-")[2])
        if pair not in number:
            known = ", ".join(nodes.names[:12]) + (" ..." if len(nodes.names) > 12 else "")
            raise DataError(
                f"{where}: column {cell!r:.60} is no link of the nodes {known}; name it transmitter-receiver-channel, "
                "and see that every node is in the list of nodes."
            )
        links.append(number[pair])
        labels.append(label)
    channels = tuple(label for label in dict.fromkeys(labels) if label is not None)
    channel = [-1 if label is None else channels.index(label) for label in labels]
    named = [pair for pair in zip(links, channel, strict=True) if pair[0] >= 0]
    if len(set(named)) < len(named) or not named:
        raise DataError(f"{where}: has {len(named)} columns of readings, two with one name or none; name each once.")
    return Columns(cells.index(TIME), 1.0, np.array(links), np.array(channel), channels, delimiter)


def plain_columns(width: int, delimiter: str | None, layout: str, nodes: RadioNodes, where: str) -> Columns:
    """Lay out rows of ``width`` numbers without a header: the time and every link on every channel."""
    size = len(nodes.names)
    links = size * (size if layout == MATRIX else size - 1)
    channels, left = divmod(width - 1, links)
    if left or channels < 1:
        each = f"{size} by {size} pairs" if layout == MATRIX else f"{links} directed links"
        other = layout != MATRIX and not (width - 1) % size**2
        raise DataError(
            f"{where}: has {width - 1} readings beside the time, no multiple of the {each} of {size} nodes; "
            + (f"as layout={MATRIX!r} it would fit." if other else "is a column missing, or a node not in the list?")
        )
    first, second = np.divmod(np.arange(width - 1), channels if layout == "link-channel" else links)
    link, channel = (first, second) if layout == "link-channel" else (second, first)
    if layout == MATRIX:
        tx, rx = np.divmod(link, size)
        link = np.where(tx == rx, -1, tx * (size - 1) + rx - (rx > tx))
    last = layout == LISTENX
    names = tuple(str(k) for k in range(channels))
    return Columns(width - 1 if last else 0, IN_MILLISECONDS if last else 1.0, link, channel, names, delimiter)


def wide_rows(lines: Lines, columns: Columns, links: int, name: str, feed: Feed | None = None) -> Iterator[Row]:
    """Yield the rows of text that has a frame a line; live (with a feed) in the order of time, each once."""
    width = len(columns.link) + 1

    def read(numbered: tuple[int, str]) -> Row:
        where = f"{name}, line {numbered[0]}"
        cells = cells_of(numbered[1], columns.delimiter, width)
        if len(cells) != width:
            raise DataError(f"{where}: has {len(cells)} cells, not {width}; repair the line.")
        return where, *columns.readings(_numbers(cells, columns.time, where), links)

    with closing(lines):
        rows = (feed or STRICT).each((line for line in lines if not line[1].startswith("#")), read)
        yield from in_order(rows, itemgetter(1), itemgetter(1), feed, lambda row, by_s: (row[0], row[1] + by_s, row[2]))


class Reading(NamedTuple):
    """One reading of a long log."""

    where: str
    time_s: float
    link: int
    channel: str
    rss_dbm: float  # NaN: missing


def long_readings(
    lines: Lines, header: list[str], delimiter: str | None, nodes: RadioNodes, name: str, feed: Feed | None = None
) -> Iterator[Reading]:
    """Yield the readings of text that has one a line; live (with a feed) in the order of time, each once."""
    number = {label: k for k, label in enumerate(nodes.names)}
    size = len(nodes.names)

    def read(numbered: tuple[int, str]) -> Reading:
        where = f"{name}, line {numbered[0]}"
        cells = cells_of(numbered[1], delimiter, len(header))
        if len(cells) != len(header):
            raise DataError(f"{where}: has {len(cells)} cells for the columns {','.join(header)}; repair the line.")
        record = dict(zip(header, cells, strict=True))
        for end in ("tx", "rx"):
            if record[end] not in number:
                raise DataError(f"{where}, column {end}: node {record[end]!r:.60} is not in the list of nodes; add it.")
        tx, rx = number[record["tx"]], number[record["rx"]]
        if tx == rx:
            raise DataError(f"{where}: node {record['tx']} hears itself; tx and rx must differ.")
        time_s, level = number_of(record["time_s"], "time_s", where), level_of(record["rss_dbm"], "rss_dbm", where)
        return Reading(where, time_s, tx * (size - 1) + (rx if rx < tx else rx - 1), record["channel"], level)

    with closing(lines):
        readings = (feed or STRICT).each((line for line in lines if not line[1].startswith("#")), read)
        moved = lambda of, by_s: of._replace(time_s=of.time_s + by_s)  # noqa: E731
        yield from in_order(readings, attrgetter("time_s"), attrgetter("link", "channel"), feed, moved)


def gathered(readings: Iterator[Reading], period_s: float | None) -> Iterator[list[Reading]]:
    """Gather readings of equal times, or of equal periods from the first time on."""
    group: list[Reading] = []
    start, here = math.nan, math.nan
    for reading in readings:
        if math.isnan(start):
            start = reading.time_s
        key = reading.time_s if period_s is None else math.floor((reading.time_s - start) / period_s)
        if group and (key != here or reading.time_s < group[-1].time_s):
            yield group
            group = []
        here = key
        group.append(reading)
    if group:
        yield group


def long_row(group: list[Reading], links: int, channels: tuple[str, ...], merge: bool, above: float) -> Row:
    """Make a frame of readings; with ``merge`` the mean of those of one link and channel, else one of each only."""
    total, count = np.zeros((links, len(channels))), np.zeros((links, len(channels)))
    seen: set[tuple[int, str]] = set()
    for reading in group:
        key = reading.link, reading.channel
        if reading.channel not in channels:
            known = ", ".join(channels)
            raise DataError(
                f"{reading.where}: channel {reading.channel!r:.40} is not one of {known}, those of the first frame; "
                "name all of them with channels."
            )
        if key in seen and not merge:
            raise DataError(
                f"{reading.where}: this link and channel has a reading at {reading.time_s:g} s already; leave one out, "
                "or gather readings by period_s."
            )
        seen.add(key)
        if reading.rss_dbm <= above:
            place = reading.link, channels.index(reading.channel)
            total[place] += reading.rss_dbm
            count[place] += 1
    levels = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
    return group[-1].where, group[-1].time_s, levels


def _numbers(cells: list[str], time: int, where: str) -> Array:
    try:
        values = np.array(cells, dtype=np.float64)
    except ValueError:
        values = np.array([level_of(cell, str(column), where) for column, cell in enumerate(cells, 1)])
    if not math.isfinite(values[time]) or np.isinf(values).any():
        column = time if not math.isfinite(values[time]) else int(np.argmax(np.isinf(values)))
        raise DataError(f"{where}, column {column + 1}: {cells[column]!r:.60} is no finite number; correct it.")
    return values


def level_of(cell: str, column: str, where: str) -> float:
    """Read a level [dBm]; nothing is NaN."""
    return number_of(cell, column, where) if cell and cell.lower() not in ("nan", "na") else math.nan


def number_of(cell: str, column: str, where: str) -> float:
    """Read a finite number."""
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{where}, column {column}: {cell!r:.60} is no number; write a number, or nothing for missing.")
    return value
