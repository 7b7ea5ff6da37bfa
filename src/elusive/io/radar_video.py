"""Radar video from files and from the network, told by what they hold: ASTERIX category 240, Navico, arrays."""

from __future__ import annotations

import io
import os
import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from elusive.errors import DataError, ParameterError
from elusive.io._asterix_blocks import raw_blocks
from elusive.io._file_kinds import is_asterix, kind_of
from elusive.io._internet import Datagram, datagrams
from elusive.io._opened import existing_file, is_cut_short, opened, readable
from elusive.io._spoke_arrays import is_arrays, spokes_of_arrays
from elusive.io._spoke_assembly import Assembly, UntimedError
from elusive.io._standard_input import STANDARD_INPUT, standard_input
from elusive.io.pcap import frames_of, is_capture
from elusive.io.sources import Feed, Packet, is_address, packets_of
from elusive.sensors.spokes import Spokes

NO_VIDEO = "give radar video: ASTERIX category 240, a capture of a Navico 4G or HALO, or arrays (.npz, netCDF)"
PLOTS = (1, 48)  # categories of plots
NO_TIMES = "its spokes have no time; give rotation_s, the antenna's period, or a capture, which has times."
HELD = 4096  # packets that wait at most, where several addresses are listened to


@dataclass(frozen=True)
class RadarVideoSource:
    """A radar's spokes, some at a time; a file's are read afresh at each iteration and never held whole in memory."""

    name: str
    _read: Callable[[Counter[str], list[str]], Iterator[Spokes]] = field(repr=False)
    counts: Counter[str] = field(default_factory=Counter)
    """What the latest iteration met, so far: ``spokes``, ``lost``, ``malformed``, ``incomplete`` packets, ..."""
    _said: list[str] = field(default_factory=list, repr=False)

    def __iter__(self) -> Iterator[Spokes]:
        """Yield the spokes in the order of time.

        Raises
        ------
        DataError
            If the source cannot be read or holds no radar video; the sentence says what it holds.
        """
        self.counts.clear()
        self._said.clear()
        some = False
        for spokes in self._read(self.counts, self._said):
            some = True
            yield spokes
        if not some and is_address(self.name) and not self.counts:
            raise DataError(f"{self.name}: nothing came; check that the radar sends there, and the address.")
        if not some:
            raise DataError(f"{self.name}: holds no radar video{_instead(self.counts)}; {NO_VIDEO}.")

    def remarks(self) -> list[str]:
        """Return what is to be said of the latest iteration: sentences on what was lost, damaged or left out."""
        met = [said.format(n=self.counts[key]) for key, said in REMARKS.items() if self.counts[key]] + self._said
        return met + [
            f"Spokes of another radar, {key.rpartition(' ')[2]}, left out: {count}; choose it with radar."
            for key, count in self.counts.items()
            if key.startswith("spokes of radar ")
        ]


REMARKS = {
    "lost": "Spokes missing by their numbers: {n}.",
    "malformed": "Messages that could not be read, left out: {n}.",
    "damaged": "Damaged spokes, left out: {n}.",
    "incomplete": "Packets that came in part only, left out: {n}.",
    "cut short": "The file ends early; what stands before was read.",
    "older radar": "Spokes of a Navico BR24 or 3G, left out because how far they reach is not known here: {n}.",
    "lowest octet first": "Amplitudes were read with their lowest octet first, against the standard: else they jump.",
    "from north": "Azimuths were taken to count from north, as category 240 has it; a heading is told too: if they "
    "count from the bow, say so (from_bow).",
}


def open_radar_video(
    source: str | os.PathLike[str],
    *,
    radar: str | None = None,
    rotation_s: float | None = None,
    from_bow: bool = False,
    feed: Feed | None = None,
) -> RadarVideoSource:
    """Open a radar's video without reading it.

    Parameters
    ----------
    source
        A file, told by what it holds and not by its name, and perhaps compressed by gzip: a network capture (pcap,
        pcapng) of ASTERIX category 240 or of a Navico 4G or HALO, with heading and place from the NMEA sentences in
        it, over UDP or TCP; raw data blocks of ASTERIX category 240; arrays (.npz, netCDF 4), as
        :mod:`elusive.io.radar_video_arrays` names them. ``-``: such a capture or blocks on standard input. Live:
        ``udp://host:port``, one address or several with commas between, of the radar's group and of NMEA sentences.
    radar
        Which radar, where a source holds several: ``SAC/SIC`` of category 240, the group that a Navico sends to; else
        the first that comes is read and the others are counted.
    rotation_s
        Period of the antenna, for spokes that have no time.
    from_bow
        Whether azimuths of category 240 count from the bow; the heading is then added, where it is known.
    feed
        How a live source is followed.

    Returns
    -------
    RadarVideoSource
        The spokes. Azimuths of category 240 count from north, as the standard has it; those of a Navico count from
        north where the heading is known. Times are after 1970 where the source says the day.

    Raises
    ------
    DataError
        If there is no such file, or it is known to hold something else; the sentence says what, and what to do.
    ParameterError
        If ``radar`` or ``from_bow`` is given for arrays.
    """
    name = str(source)

    def assembly(counts: Counter[str]) -> Assembly:
        return Assembly(counts, radar, rotation_s, from_bow)

    if is_address(name):
        addresses, follow = name.split(","), Feed() if feed is None else feed
        return RadarVideoSource(
            name, lambda counts, said: _spokes(_listened(addresses, follow), assembly(counts), name)
        )
    if name == STANDARD_INPUT:
        return RadarVideoSource(
            "standard input", lambda counts, said: _of_file(standard_input, assembly(counts), counts, said)
        )
    path = existing_file(source)
    with readable(name), opened(path) as file:
        head = file.peek(16)[:16]
    if is_arrays(head):
        for option, given in (("radar", radar is not None), ("from_bow", from_bow)):
            if given:
                raise ParameterError(f"{option}: has no meaning for arrays, which say it themselves; leave it out.")
        return RadarVideoSource(name, lambda counts, said: spokes_of_arrays(path, rotation_s))
    if not is_capture(head[:4]) and not is_asterix(head):
        raise DataError(f"{source}: is {kind_of(head)} and no radar video; {NO_VIDEO}.")
    return RadarVideoSource(
        name, lambda counts, said: _of_file(lambda: opened(path), assembly(counts), counts, said, name)
    )


def _of_file(
    opening: Callable[[], io.BufferedReader],
    assembly: Assembly,
    counts: Counter[str],
    said: list[str],
    name: str = "standard input",
) -> Iterator[Spokes]:
    with readable(name), opening() as file:
        is_network = is_capture(file.peek(4)[:4])
        blocks = (Datagram(unix_s, block) for unix_s, block in raw_blocks(file, counts))
        yield from _spokes(datagrams(frames_of(file), counts) if is_network else blocks, assembly, name)
        counts["cut short"] += is_cut_short(file)
        counts["lowest octet first"] += assembly.lowest_first
        counts["from north"] += assembly.from_north_unasked
        said += assembly.remarks()


def _spokes(found: Iterator[Datagram], assembly: Assembly, name: str) -> Iterator[Spokes]:
    try:
        for datagram in found:
            yield from assembly.take(datagram)
        yield from assembly.rest()
    except UntimedError:
        raise DataError(f"{name}: {NO_TIMES}") from None


def _listened(addresses: list[str], feed: Feed) -> Iterator[Datagram]:
    """Yield what comes to addresses, whichever it is."""
    coming = (
        packets_of(addresses[0], feed)
        if len(addresses) == 1
        else _merged([packets_of(a, feed) for a in addresses], feed)
    )
    for packet in coming:
        if packet.octets:
            yield Datagram(packet.unix_s, packet.octets, destination="the radar listened to")


def _merged(sources: list[Iterator[Packet]], feed: Feed) -> Iterator[Packet]:
    """Yield the packets of several sources as they come; where more come than are taken, new ones are dropped."""
    held, open_sources = queue.Queue[Packet | None](HELD), len(sources)

    def read(packets: Iterator[Packet]) -> None:
        for packet in packets:
            try:
                held.put_nowait(packet)
            except queue.Full:
                feed.counts["dropped"] += 1
        held.put(None)

    for packets in sources:
        threading.Thread(target=read, args=(packets,), name="packets", daemon=True).start()
    while open_sources:
        packet = held.get()
        if packet is None:
            open_sources -= 1
        else:
            yield packet


def _instead(counts: Counter[str]) -> str:
    """Say what a source held instead of spokes."""
    plots = sum(counts[f"category {number}"] for number in PLOTS)
    if plots:
        return f", but {plots} blocks of plots (ASTERIX category 048 or 001), for `elusive track radar`"
    told = ", ".join(f"{key} {count}" for key, count in sorted(counts.items()) if count)
    return f" ({told})" if told else ""
