"""NMEA 0183 (IEC 61162-1) sentences of targets: TTM, seen from the site, and TLL, by latitude and longitude."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from datetime import UTC, datetime

from elusive.io._sentences import sentence_of
from elusive.io.sinks.seen import Seen, Told

NMI_M = 1852.0
KNOT_MPS = NMI_M / 3600
NUMBERS = 100  # of targets, in both sentences
TALKER = "RA"


class Nmea:
    """Writes confirmed tracks as TTM and TLL; a number of these is a track's until it has ended.

    Parameters
    ----------
    say
        Told when there are more tracks than numbers.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self.state: tuple[dict[int, int], list[int]] = {}, list(range(NUMBERS))
        """Numbers by track, and those that are free, the longest unused first."""
        self._say, self._said = say, False

    def __call__(self, told: Told) -> Iterator[bytes]:
        """Yield the sentences of a step, a line each."""
        numbers, freed = self.state
        for seen in told.ended:
            number = numbers.pop(seen.track, None)
            if number is not None:
                freed.append(number)
                yield from _sentences(number, seen, "L", told.unix_s)
        for seen in told.seen:
            if seen.status != "confirmed":
                continue
            if seen.track not in numbers:
                if not freed:
                    if not self._said:
                        self._say(f"NMEA has {NUMBERS} numbers of targets; tracks beyond those are left out.")
                    self._said = True
                    continue
                numbers[seen.track] = freed.pop(0)
            yield from _sentences(numbers[seen.track], seen, "T", told.unix_s)


def _sentences(number: int, seen: Seen, status: str, unix_s: float) -> Iterator[bytes]:
    clock = datetime.fromtimestamp(unix_s, UTC).strftime("%H%M%S.%f")[:9]
    distance, bearing = math.hypot(seen.east_m, seen.north_m), _degrees(seen.east_m, seen.north_m)
    speed, course = _fixed(seen.speed_mps / KNOT_MPS, 2), _fixed(seen.course_deg % 360, 1)
    near_m, near_s = _closest(seen)
    cells = (
        f"{number:02d},{distance / NMI_M:.3f},{bearing},T,{speed},{course},T,{_fixed(near_m / NMI_M, 2)}"
        f",{_fixed(near_s / 60, 1)},N,{_name(seen)},{status},,{clock},A"
    )
    yield sentence_of(f"{TALKER}TTM,{cells}")
    lat, lon = _minutes(seen.lat_deg, 2, "NS"), _minutes(seen.lon_deg, 3, "EW")
    yield sentence_of(f"{TALKER}TLL,{number:02d},{lat},{lon},{_name(seen)},{clock},{status},")


def _name(seen: Seen) -> str:
    """Name that carries the track's own number."""
    return f"E{seen.track}"


def _closest(seen: Seen) -> tuple[float, float]:
    """Distance [m] and time [s] at which a target that keeps its course is closest to the site."""
    squared = seen.speed_mps**2
    if not squared > 1e-6:
        return math.nan, math.nan
    time_s = -(seen.east_m * seen.v_east_mps + seen.north_m * seen.v_north_mps) / squared
    return math.hypot(seen.east_m + time_s * seen.v_east_mps, seen.north_m + time_s * seen.v_north_mps), time_s


def _degrees(east: float, north: float) -> str:
    text = f"{math.degrees(math.atan2(east, north)) % 360:.2f}"
    return "0.00" if text == "360.00" else text


def _fixed(value: float, digits: int) -> str:
    """Write a number; what is not known, or too large to fit a sentence, is empty."""
    return f"{value:.{digits}f}" if abs(value) < 1e4 else ""


def _minutes(degrees: float, width: int, names: str) -> str:
    """Write a latitude or longitude as degrees and minutes to four digits, 19 cm."""
    whole, minutes = divmod(round(abs(degrees) * 600_000), 600_000)
    return f"{whole:0{width}d}{minutes / 10_000:07.4f},{names[degrees < 0]}"
