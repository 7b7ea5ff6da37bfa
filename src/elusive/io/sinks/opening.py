"""Opens sinks by their names, and tells each step to all of them."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from elusive.errors import DataError
from elusive.io.atomic import refused
from elusive.io.sinks.cot import Cot
from elusive.io.sinks.formats import Mot, geojson, ndjson
from elusive.io.sinks.nmea import Nmea
from elusive.io.sinks.outlet import Outlet, file_outlet, tcp_outlet
from elusive.io.sinks.presence import Presence
from elusive.io.sinks.seen import Ground, Told, Watch
from elusive.io.sinks.standard_output import StandardOutput
from elusive.io.sinks.udp import UdpOutlet
from elusive.io.sources.address import address_of

Write = Callable[[Told], Iterator[bytes]]
GEOGRAPHIC = ("geojson", "nmea", "cot")
FORMATS = ("ndjson", *GEOGRAPHIC, "mot")
BEGINS = {"ndjson": rb"\{", "geojson": rb'\{"type"', "nmea": rb"\$RA", "cot": rb"<\?xml", "mot": rb"\d+,\d+,"}
STDOUT = "-"
UDP = ("interface", "broadcast")
OWN = {"cot": ("uid", "type", "stale_s")}
KINDS = {"links": "a-u-G", "radar": "a-u-S", "video": "a-u-S", "bearings": "a-u-A"}  # on the ground, at sea, in the air
STALE_S, LONGEST_STALE_S, HALF_PX = 30.0, 86_400.0, 2.0
LIKE = "write ndjson:FILE, geojson:FILE, nmea+udp://HOST:PORT, cot+tcp://HOST:PORT, mqtt://HOST/SITE or mot:FILE"


class Sink(Protocol):
    """Takes steps."""

    @property
    def name(self) -> str:
        """For sentences."""
        ...

    @property
    def counts(self) -> Counter[str]:
        """Messages ``sent``, ``dropped``."""
        ...

    def prepared(self, told: Told) -> Callable[[], None]:
        """Make ready what a step is to be told by; returns what sends it."""
        ...

    def close(self) -> None:
        """End."""
        ...


class _Written(NamedTuple):
    name: str
    counts: Counter[str]
    write: Write
    outlet: Outlet

    def prepared(self, told: Told) -> Callable[[], None]:
        messages = list(self.write(told))

        def send() -> None:
            for message in messages:
                self.outlet.send(message)

        return send

    def close(self) -> None:
        self.outlet.close()


class Sinks:
    """Several sinks; what one cannot take keeps no other waiting."""

    def __init__(self, sinks: Sequence[Any], watch: Watch, *, own_stdout: bool = False) -> None:
        self.each, self._watch = tuple(sinks), watch
        self.own_stdout = own_stdout
        """Whether one of them writes to standard output, in place of the usual lines."""

    def tell(self, record: Mapping[str, Any]) -> None:
        """Tell a step's record."""
        self.prepared(record)()

    def prepared(self, record: Mapping[str, Any]) -> Callable[[], None]:
        """Take a step's record in, and return what tells it: a checkpoint between the two knows what will be told."""
        told = self._watch.take(record)
        ready = [sink.prepared(told) for sink in self.each]

        def send() -> None:
            for each in ready:
                each()

        return send

    @property
    def state(self) -> Any:
        """What a restart needs to tell the same tracks by the same numbers and ages."""
        return self._watch.state, [sink.write.state if _keeps(sink) else None for sink in self.each]

    def resume(self, state: Any) -> None:
        """Go on from an earlier run's state; sinks that were added since begin anew."""
        self._watch.state, written = state
        for sink, known in zip(self.each, written, strict=False):
            if _keeps(sink) and known is not None:
                sink.write.state = known

    def close(self) -> None:
        """Tell that the tracks have ended, and end."""
        if self.each:
            told = self._watch.end()
            for sink in self.each:
                sink.prepared(told)()
            for sink in self.each:
                sink.close()


def _keeps(sink: Any) -> bool:
    return hasattr(getattr(sink, "write", None), "state")


def open_sinks(
    names: Sequence[str], *, system: str, unit: str, ground: Ground | None, say: Callable[[str], None],
    located: bool = False,
) -> Sinks:  # fmt: skip
    """Open sinks.

    Parameters
    ----------
    names
        Each ``format:path`` (``-``: standard output), ``format+udp://host:port``, ``format+tcp://host:port`` or
        ``mqtt://host/prefix``.
    system, unit
        Whose tracks they are, and in what.
    ground
        Where the tracks' metres lie; needed by formats with longitude and latitude.
    say
        Told what becomes of a sink.
    located
        Whether the tracks themselves say longitude and latitude, with y to north: no ground is needed then.

    Raises
    ------
    DataError
        If a name has no meaning, two go to one place, or a format does not fit the tracks.
    """
    _check_apart(names)
    opened: list[Sink] = []
    try:
        opened.extend(_open(name, system, unit, located or ground is not None, say) for name in names)
    except DataError:
        for sink in opened:
            sink.close()
        raise
    own = any(name.endswith(f":{STDOUT}") for name in names)
    return Sinks(opened, Watch(unit, ground), own_stdout=own)


def is_geographic(name: str) -> bool:
    """Whether a sink's format has longitude and latitude."""
    return name.partition(":")[0].lower().partition("+")[0] in GEOGRAPHIC


def _open(name: str, system: str, unit: str, placed: bool, say: Callable[[str], None]) -> Sink:
    scheme = name.partition(":")[0].lower()
    if scheme in ("mqtt", "mqtts"):
        return Presence(address_of(name, {scheme: ("discovery",)}), unit, say)
    form, _, carrier = scheme.partition("+")
    if form not in FORMATS or carrier not in ("", "udp", "tcp"):
        raise DataError(f"--to {name}: is no sink; {LIKE}.")
    if form in GEOGRAPHIC and unit != "m":
        raise DataError(f"--to {name}: needs places on the ground, and these tracks are in {unit}; take ndjson.")
    if is_geographic(name) and not placed:
        raise DataError(f"--to {name}: needs to know where the site is; give --origin LON LAT, in degrees.")
    if form == "mot" and unit != "px":
        raise DataError(f"--to {name}: MOTChallenge needs pixels, and these tracks are in {unit}; take ndjson.")
    if form == "mot" and carrier:
        raise DataError(f"--to {name}: MOTChallenge is a file; write mot:FILE.")
    path = name.partition(":")[2]
    outlet: Outlet
    write = _format(form, system, {}, say)
    if carrier:
        own = OWN.get(form, ())
        address = address_of(name, {f"{form}+udp": (*UDP, *own), f"{form}+tcp": own})
        write = _format(form, system, address.options, say)
        outlet = UdpOutlet(address, say) if carrier == "udp" else tcp_outlet(address, say)
    elif path == STDOUT:
        outlet = StandardOutput(say)
    elif path and not path.startswith("//"):
        if _holds_other(Path(path), form):
            raise DataError(f"--to {name}: {path} holds something else, to which nothing is added; name another file.")
        outlet = file_outlet(path, say)
    else:
        raise DataError(f"--to {name}: names no file; {LIKE}.")
    return _Written(name, outlet.counts, write, outlet)


def _check_apart(names: Sequence[str]) -> None:
    """Refuse two sinks in one file, where lines of two kinds or each one twice would stand, or to one address."""
    taken: dict[str, str] = {}
    for name in names:
        scheme, _, path = name.partition(":")
        to_file = "+" not in scheme and not path.startswith("//")
        place = os.path.realpath(path) if to_file and path != STDOUT else path if to_file else name.partition("?")[0]
        if place in taken:
            raise DataError(f"--to {name}: goes where --to {taken[place]} goes; each needs a place of its own.")
        taken[place] = name


def _holds_other(path: Path, form: str) -> bool:
    """Whether a file holds something that was not written in a format: somebody's recording, say."""
    if not path.is_file():
        return False
    with refused(path), path.open("rb") as file:
        begins = file.read(64)
    return bool(begins) and re.match(BEGINS[form], begins) is None


def _stale_s(options: Mapping[str, str]) -> float:
    try:
        stale_s = float(options.get("stale_s", STALE_S))
    except ValueError:
        stale_s = -1.0
    if not 0.0 < stale_s <= LONGEST_STALE_S:
        raise DataError(
            f"--to: stale_s={options['stale_s']:.40} is no time; give seconds, above 0 and at most {LONGEST_STALE_S:g}."
        )
    return stale_s


def _format(form: str, system: str, options: Mapping[str, str], say: Callable[[str], None]) -> Write:
    if form == "nmea":
        return Nmea(say)
    if form == "cot":
        stale_s = _stale_s(options)
        kind = options.get("type", KINDS.get(system, "a-u-G"))
        return Cot(options.get("uid", f"elusive.{system}"), kind, stale_s).events
    if form == "mot":
        return Mot(HALF_PX)
    return geojson if form == "geojson" else ndjson
