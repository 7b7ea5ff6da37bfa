"""A ship's own instruments: places, dates and headings of NMEA sentences, beside pynmea2; what is damaged is left."""

from __future__ import annotations

import math
from pathlib import Path

import pynmea2
import pytest

from elusive.errors import DataError
from elusive.io.nmea import checksum, own_fixes, read_own_fixes

NOON = 1_777_636_800.0  # 2026-05-01T12:00:00Z


def sentence(body: str) -> str:
    return f"${body}*{checksum(body):02X}"


RMC = sentence("GPRMC,120000.00,A,5356.1234,N,01012.5678,E,10.1,091.2,010526,2.5,E")


def told(*lines: str, came_s: float = math.nan) -> list[tuple[float, ...]]:
    return [tuple(fix) for fix in own_fixes((came_s, line) for line in lines)]


def test_a_place_is_what_another_reader_says() -> None:
    (fix,) = own_fixes([(math.nan, RMC)])
    other = pynmea2.parse(RMC)
    assert (fix.lon_deg, fix.lat_deg) == pytest.approx((other.longitude, other.latitude), abs=1e-12)
    assert fix.time_s == other.datetime.timestamp() == NOON
    assert math.isnan(fix.heading_rad)
    south = sentence("GPRMC,120000.00,A,3350.50,S,15112.75,W,,,010526,,")
    assert told(south)[0][1:3] == pytest.approx((-(151 + 12.75 / 60), -(33 + 50.5 / 60)))


def test_a_time_of_day_takes_the_day_that_was_told() -> None:
    late = sentence("GPRMC,235959.50,A,5356.0000,N,01012.0000,E,,,010526,,")
    after = sentence("GNGGA,000000.50,5356.0000,N,01012.0000,E,1,10,1.0,2,M,,M,,")
    assert [fix[0] for fix in told(late, after)] == [NOON + 43_199.5, NOON + 43_200.5]
    assert told(after) == []  # of no day
    assert told(after, came_s=NOON + 43_201)[0][0] == NOON + 43_200.5
    zda = sentence("GPZDA,120000.00,01,05,2026,00,00")
    assert told(zda, sentence("GPGLL,5356.0,N,01012.0,E,120001.00,A,A"))[0][0] == NOON + 1


def test_headings_are_true_ones() -> None:
    hdg = sentence("HCHDG,100.0,1.5,W,,")
    assert told(hdg, came_s=NOON) == []  # magnetic, and the variation is not known
    assert told(RMC, hdg)[1][3] == pytest.approx(math.radians(101.0))
    assert told(sentence("HCHDG,359.0,,,3.0,E"), came_s=NOON)[0][3] == pytest.approx(math.radians(2.0))
    assert told(sentence("HEHDT,271.5,T"), came_s=NOON)[0][::3] == (NOON, pytest.approx(math.radians(271.5)))
    assert told(sentence("HETHS,271.5,V"), came_s=NOON) == []
    assert told(RMC, sentence("HEHDT,90.0,T"))[1][0] == NOON  # without a time of its own


@pytest.mark.parametrize(
    "line",
    [
        RMC[:-1] + "0",
        sentence("GPRMC,120000.00,V,5356.0,N,01012.0,E,,,010526,,"),
        sentence("GPRMC,120000.00,A,5356.0,,01012.0,E,,,010526,,"),
        sentence("GPRMC,120000.00,A,9956.0,N,01012.0,E,,,010526,,"),
        sentence("GPRMC,120000.00,A,5356.0,N,01012.0,E,,,310226,,"),
        sentence("GPGGA,120000.00,5356.0,N,01012.0,E,0,10,1.0,2,M,,M,,"),
        sentence("HEHDT,,T"),
        "noise $GP",
        "",
    ],
)
def test_what_is_damaged_or_unknown_says_nothing(line: str) -> None:
    assert told(line, came_s=NOON) == []


def test_a_log_without_a_place_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.log"
    path.write_text("\n".join(["2026-05-01T12:00:00Z " + sentence("HEHDT,90.0,T"), RMC]))
    first, second = read_own_fixes(path)
    assert first.heading_rad == pytest.approx(math.pi / 2)
    assert second.lat_deg > 53
    path.write_text(sentence("HEHDT,90.0,T"))
    with pytest.raises(DataError, match=r"own\.log: tells no place of the own ship"):
        list(read_own_fixes(path))
