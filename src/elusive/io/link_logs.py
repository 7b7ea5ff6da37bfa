"""Logs of a radio network, read lazily frame by frame: a file, an array, a growing file or standard input."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np

from elusive.errors import DataError
from elusive.io import _link_formats as formats
from elusive.io._link_formats import LAYOUTS, LISTENX, LONG, Row
from elusive.io._link_rows import receiver_rows
from elusive.io._opened import existing_file
from elusive.io.sources.cells import cells_of, mark_of
from elusive.io.sources.feed import Feed
from elusive.io.sources.header import is_number
from elusive.io.sources.lines import STRICT, Lines, after, chained, comes_once, lines_of
from elusive.sensors.radio_network import RadioNodes, RssFrame

MISSING_CODES = 3  # different values that mean nothing was heard, at most
MISSING_ABOVE_DBM = -10.0  # no receiver hears as much: radios write 127 where they heard nothing


@dataclass(frozen=True)
class LinkLog:
    """A log's frames, read as they are asked for and never held whole in memory.

    A file is read afresh at each iteration; standard input once.
    """

    name: str
    channels: tuple[str, ...]
    _read: Callable[[], Iterator[Row]] = field(repr=False)
    _missing_above_dbm: float = field(repr=False)
    again: bool = True  # whether it can be read more than once

    def after(self, empty: LinkLog) -> tuple[LinkLog, int]:
        """Return this log behind the recording of an empty room, and how many frames that has.

        The recording's times are moved so that it ends an interval of its own before this log begins.

        Raises
        ------
        DataError
            If the recording cannot be read, has fewer than two frames, or other channels.
        """
        if empty.channels != self.channels or not empty.again:
            known = ", ".join(self.channels)
            raise DataError(f"{empty.name}: has other channels than the log's {known}, or is no file; record it alike.")
        before = list(empty)
        if len(before) < 2:
            raise DataError(f"{empty.name}: has {len(before)} frames; record at least two of the empty room.")
        return self.behind(before, empty.name), len(before)

    def behind(self, before: Sequence[RssFrame], name: str) -> LinkLog:
        """Return this log behind two and more frames, whose times are moved so that they end an interval before it."""
        times_s = np.array([frame.time_s for frame in before])

        def rows() -> Iterator[Row]:
            own = self._read()
            for first in own:
                moved_s = first[1] - np.median(np.diff(times_s)) - times_s[-1] + times_s
                yield from ((name, moved_s[k], frame.rss_dbm.copy()) for k, frame in enumerate(before))
                yield first
                yield from own

        return LinkLog(self.name, self.channels, rows, self._missing_above_dbm, self.again)

    def __iter__(self) -> Iterator[RssFrame]:
        """Yield the frames.

        Raises
        ------
        DataError
            If a line cannot be read, times do not go forwards, or nothing was heard in the whole log.
        """
        before, heard, above = -math.inf, False, set[float]()
        with closing(self._read()) as rows:  # type: ignore[type-var]
            for where, time_s, levels in rows:
                if not time_s > before:
                    raise DataError(f"{where}: the time is {time_s:g} s after {before:g} s; times must go forwards.")
                before = time_s
                missing = levels > self._missing_above_dbm
                if not heard:
                    above.update(levels[missing].tolist())
                levels[missing] = np.nan
                heard = heard or bool(np.isfinite(levels).any())
                if not heard and len(above) > MISSING_CODES and min(above) > 0:
                    raise DataError(
                        f"{where}: every reading so far is above {self._missing_above_dbm:g} dBm, from {min(above):g} "
                        f"to {max(above):g}: a radio's own RSSI units or losses in dB, no levels in dBm. Convert them "
                        "(RSSI units less the radio's offset; losses with the sign turned), or raise "
                        "--missing-above-dbm."
                    )
                yield RssFrame(time_s, levels)
        if not heard:
            told = "holds no frame" if before == -math.inf else "has no reading: every one is missing"
            raise DataError(f"{self.name}: {told}; check that it is a log of levels in dBm.")


def open_link_log(
    source: str | os.PathLike[str],
    nodes: RadioNodes,
    *,
    layout: str | None = None,
    channels: Sequence[str] | None = None,
    period_s: float | None = None,
    feed: Feed | None = None,
    missing_above_dbm: float = MISSING_ABOVE_DBM,
) -> LinkLog:
    """Open a log without reading it all.

    Parameters
    ----------
    source
        Text, a NumPy array (``.npy``), ``-`` for standard input, or live ``tcp://``, ``udp://`` or ``mqtt://``. Text
        is, as its first line says:

        - *long*, under a header of ``time_s,tx,rx,channel,rss_dbm``: a reading a line;
        - *wide*, under a header of ``time_s`` and ``tx-rx-channel`` (node names): a frame a line;
        - numbers only, a frame a line, and then ``layout`` says what they are; separated by white space they are
          taken for ``listenx``.
    nodes
        The network.
    layout
        Of numbers without a header: ``channel-link`` (the time [s], then all links of the first channel, and so on),
        ``link-channel`` (the time, then all channels of the first link, and so on), or ``listenx`` (all links of the
        first channel, and so on, then the time in milliseconds), links as in
        :func:`~elusive.sensors.radio_network.directed_links_of`; ``matrix`` (the time, then a row a transmitter, a
        level a receiver, its own not read); ``receiver`` (a row a node: its name, what it heard of each, the time).
    channels
        Channels of a long log; by default those of its first frame.
    period_s
        Of a long log: readings of equal periods from the first on are a frame, whose level is their mean and whose
        time is its last reading's. By default readings of equal times are a frame.
    feed
        Live: how it is followed. A late or repeated reading, or one that cannot be used, is left out and counted.
    missing_above_dbm
        A level above this is a missing reading.

    Returns
    -------
    LinkLog
        The frames. In a long log one is known to be complete when the next begins.

    Raises
    ------
    DataError
        If there is no such log, its first line is none of the above, or an argument does not fit it.
    """
    name = os.fspath(source)
    path = Path(name)
    if layout is not None and layout not in LAYOUTS:
        raise DataError(f"layout={layout!r}: is unknown; choose one of {', '.join(LAYOUTS)}.")
    if period_s is not None and not 0 < period_s < math.inf:
        raise DataError(f"period_s={period_s}: must be a positive time in seconds.")
    if not comes_once(name):
        existing_file(path)
    if path.suffix.lower() == ".npy":
        return _open_array(path, nodes, layout, missing_above_dbm)

    live = lines_of(name, feed)
    first = next(((line, text) for line, text in live if not text.startswith("#")), None)
    if first is None:
        raise DataError(f"{name}: is empty; write a frame a line, or a reading a line under {','.join(LONG)}.")
    where, delimiter = f"{name}, line {first[0]}", mark_of(first[1])
    cells = cells_of(first[1], delimiter)
    named = formats.TIME in cells or not any(map(is_number, cells))

    def lines() -> Lines:
        """Give the lines after the header; what comes once goes on where it is."""
        if comes_once(name):
            return live if named else chained([first], live)
        again = lines_of(name, feed)
        return after(again, first[0] if named else first[0] - 1)

    if named and layout is not None:
        raise DataError(f"{where}: names the columns itself; leave layout={layout!r} out.")
    if layout == formats.RECEIVER:
        read = partial(receiver_rows, delimiter=delimiter, nodes=nodes, name=name, feed=feed)
        return LinkLog(name, ("0",), lambda: read(lines()), missing_above_dbm, not comes_once(name))
    links = len(nodes.names) * (len(nodes.names) - 1)
    if named and set(LONG) <= set(cells):
        return _open_long(name, lines, cells, delimiter, nodes, channels, period_s, missing_above_dbm, feed)
    if channels is not None or period_s is not None:
        raise DataError(f"{where}: has a frame a line; channels and period_s are for a log with a reading a line.")
    if named:
        columns = formats.named_columns(cells, delimiter, nodes, where)
    else:
        if layout is None and delimiter is not None:
            raise DataError(f"{where}: has no names; write a header, or say with layout what the columns are.")
        columns = formats.plain_columns(len(cells), delimiter, layout or LISTENX, nodes, where)
    if not comes_once(name):
        live.close()
    again = not comes_once(name)

    def rows() -> Iterator[Row]:
        return formats.wide_rows(lines(), columns, links, name, feed)

    return LinkLog(name, columns.channels, rows, missing_above_dbm, again)


def _open_array(path: Path, nodes: RadioNodes, layout: str | None, missing_above_dbm: float) -> LinkLog:
    if layout in (None, formats.RECEIVER):
        known = ", ".join(one for one in LAYOUTS if one != formats.RECEIVER)
        raise DataError(f"{path}: an array does not name its columns; give layout, one of {known}.")
    try:
        table = np.load(path, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError):
        raise DataError(f"{path}: is no NumPy array; save it with numpy.save.") from None
    if not isinstance(table, np.ndarray) or table.ndim != 2 or table.dtype.kind not in "iuf":
        raise DataError(f"{path}: must be one array of numbers (frame, column), the time and the readings.")
    columns = formats.plain_columns(table.shape[1], None, layout, nodes, str(path))
    links = len(nodes.names) * (len(nodes.names) - 1)

    def rows() -> Iterator[Row]:
        for number, row in enumerate(table):
            values = np.array(row, dtype=np.float64)
            if np.isinf(values).any() or math.isnan(values[columns.time]):
                raise DataError(f"{path}, row {number}: has an infinite number or no time; correct it.")
            yield f"{path}, row {number}", *columns.readings(values, links)

    return LinkLog(str(path), columns.channels, rows, missing_above_dbm)


def _open_long(
    name: str,
    lines: Callable[[], Lines],
    header: list[str],
    delimiter: str | None,
    nodes: RadioNodes,
    channels: Sequence[str] | None,
    period_s: float | None,
    missing_above_dbm: float,
    feed: Feed | None,
) -> LinkLog:
    if len(header) != len(set(header)):
        raise DataError(f"{name}: two columns have one name; name them {','.join(LONG)}.")
    looked = feed if feed is None or comes_once(name) else feed.looking()
    groups = formats.gathered(formats.long_readings(lines(), header, delimiter, nodes, name, looked), period_s)
    first = next(groups, [])
    known = tuple(dict.fromkeys(reading.channel for reading in first)) if channels is None else tuple(channels)
    links = len(nodes.names) * (len(nodes.names) - 1)

    def rows() -> Iterator[Row]:
        if comes_once(name):
            every: Iterator[list[formats.Reading]] = chain([first] if first else [], groups)
        else:
            every = formats.gathered(formats.long_readings(lines(), header, delimiter, nodes, name, feed), period_s)
        merge = period_s is not None
        yield from (feed or STRICT).each(
            every, lambda group: formats.long_row(group, links, known, merge=merge, above=missing_above_dbm)
        )

    return LinkLog(name, known, rows, missing_above_dbm, not comes_once(name))
