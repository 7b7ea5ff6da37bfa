"""Heading and place of the own ship: the best instrument counts, between its sentences, while it is not silent."""

from __future__ import annotations

import math

import numpy as np
import pytest

from elusive.io._own_ship import STALE_S, OwnShip
from elusive.io.nmea import checksum

NOON = 1_777_636_800.0


def told(*heard: tuple[float, str]) -> OwnShip:
    own = OwnShip()
    for at_s, body in heard:
        own.hear(NOON + at_s, f"${body}*{checksum(body):02X}")
    return own


def headings(own: OwnShip, *at_s: float) -> list[float]:
    return np.degrees(own.heading_rad(NOON + np.array(at_s))).round(3).tolist()


def test_a_heading_is_between_those_before_and_after_through_north():
    own = told((0, "HEHDT,358.0,T"), (1, "HEHDT,2.0,T"))
    assert headings(own, 0.0, 0.25, 0.5, 1.0) == [358, 359, 0, 2]


def test_the_best_instrument_counts_and_of_equals_the_first():
    own = told((0, "HCHDG,90.0,,,1.0,E"), (0, "IIHDT,95.0,T"), (0, "HEHDT,96.0,T"), (0, "XXHDM,70.0,M"))
    assert headings(own, 0.0) == [95]
    assert own.headings == ["IIHDT", "HEHDT", "HCHDG", "XXHDM"]


def test_an_instrument_that_is_silent_gives_way():
    own = told((0, "IIHDT,95.0,T"), *((float(k), "HCHDG,90.0,,,1.0,E") for k in range(60)))
    assert headings(own, 1.0) == [95]
    assert headings(own, 50.0) == [91]
    assert math.isnan(headings(own, 60 + STALE_S)[0])


def test_a_magnetic_heading_needs_a_variation():
    assert math.isnan(headings(told((0, "XXHDM,70.0,M")), 0.0)[0])
    rmc = "GPRMC,120000.00,A,5356.0,N,01012.0,E,,,010526,2.5,W"
    assert headings(told((0, rmc), (0, "XXHDM,70.0,M")), 0.0) == [67.5]


def test_places_cross_the_date_line():
    own = told((0, "GPGLL,1000.0,N,17959.0,E,,A,A"), (1, "GPGLL,1001.0,N,17959.0,W,,A,A"))
    lon, lat = own.lonlat_deg(NOON + np.array([0.25, 0.5])).T
    assert lon == pytest.approx([180 - 1 / 120, -180])
    assert lat == pytest.approx([10 + 0.25 / 60, 10 + 0.5 / 60])


def test_receivers_are_not_mixed():
    own = told((0, "AAGLL,1000.0,N,01000.0,E,,A,A"), (0.5, "BBGLL,1001.0,N,01000.0,E,,A,A"))
    assert own.lonlat_deg(NOON + np.array([0.0, 0.5]))[:, 1].tolist() == [10, 10]
    better = told((0, "AAGLL,1000.0,N,01000.0,E,,A,A"), (0, "BBGGA,,1001.0,N,01000.0,E,1,8,1.0,2,M,,M,,"))
    assert better.lonlat_deg(NOON + np.array([0.0]))[0, 1] == pytest.approx(10 + 1 / 60)


def test_what_is_awaited_is_not_known():
    own = told((2, "HEHDT,1.0,T"))
    assert own.known_until_s(awaited=False) == NOON + 2
    assert own.known_until_s(awaited=True) == -math.inf
    assert OwnShip().known_until_s(awaited=False) == math.inf
