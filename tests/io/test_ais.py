"""AIS positions: what pyais writes reads back, times wherever logs put them, and what is damaged."""

from __future__ import annotations

import math
import sys
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyais import encode_dict

from elusive.errors import DataError
from elusive.io import AisPosition, read_ais

fuzzed = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
UNIX_S = 1671533231  # 2022-12-20 10:47:11 UTC


def sentences(**fields: object) -> list[str]:
    data = {"type": 1, "mmsi": 244660000, "lon": 4.5, "lat": 52.25, "speed": 10.0, "course": 90.0} | fields
    return encode_dict(data, talker_id="AI", sentence_type="VDM", radio_channel="A")


def tagged(sentence: str, text: str | None = None) -> str:
    told = f"c:{UNIX_S},s:station" if text is None else text
    check = 0
    for octet in told.encode():
        check ^= octet
    return f"\\{told}*{check:02X}\\{sentence}"


def saved(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "a.nmea"
    path.write_bytes("\n".join(lines).encode("latin-1"))
    return path


# A published example (the AIVDM page of gpsd): payload 177KQJ5000G?tO`K>RA1wUbN0TKH is MMSI 477553000, moored,
# 0 knots, 122.345833 W, 47.582833 N, course 51.
EXAMPLE = "!AIVDM,1,1,,B,177KQJ5000G?tO`K>RA1wUbN0TKH,0*5C"


def test_a_published_sentence(tmp_path: Path) -> None:
    (position,) = read_ais(saved(tmp_path, tagged(EXAMPLE)))
    assert position.time_s == UNIX_S
    assert position.mmsi == 477553000
    assert position.lon_deg == pytest.approx(-122.345833, abs=1e-6)
    assert position.lat_deg == pytest.approx(47.582833, abs=1e-6)
    assert position.sog_mps == 0
    assert math.degrees(position.cog_rad) == pytest.approx(51)


@pytest.mark.parametrize("kind", [1, 2, 3, 18, 19, 27])
def test_each_message_with_a_position(tmp_path: Path, kind: int) -> None:
    lines = sentences(type=kind, speed=9, course=271)
    counts = Counter[str]()
    (position,) = read_ais(saved(tmp_path, *map(tagged, lines)), counts=counts)
    coarse = 1 / 600 if kind == 27 else 1e-6
    assert position[:2] == (UNIX_S, 244660000)
    assert position.lon_deg == pytest.approx(4.5, abs=coarse)
    assert position.lat_deg == pytest.approx(52.25, abs=coarse)
    assert position.sog_mps == pytest.approx(9 * 1852 / 3600)
    assert math.degrees(position.cog_rad) == pytest.approx(271)
    assert counts == {"positions": 1}


@pytest.mark.parametrize(
    ("speed", "course", "sog_mps", "cog_rad"),
    [
        (102.3, 360.0, math.nan, math.nan),
        (102.2, 359.9, 102.2 * 1852 / 3600, math.radians(359.9)),
        (0.0, 0.0, 0.0, 0.0),
    ],
)
def test_what_is_not_known_is_nan(tmp_path: Path, speed: float, course: float, sog_mps: float, cog_rad: float) -> None:
    (position,) = read_ais(saved(tmp_path, *map(tagged, sentences(speed=speed, course=course))))
    assert position[4:] == pytest.approx((sog_mps, cog_rad), nan_ok=True)


def test_long_range_messages_have_their_own_unknowns(tmp_path: Path) -> None:
    (position,) = read_ais(saved(tmp_path, *map(tagged, sentences(type=27, speed=63, course=511))))
    assert math.isnan(position.sog_mps)
    assert math.isnan(position.cog_rad)


# ------------------------------------------------------------------------------------------------------------ times


@pytest.mark.parametrize(
    ("line", "time_s"),
    [
        (tagged("{1}"), UNIX_S),
        (f"{UNIX_S} {{1}}", UNIX_S),
        (f"{UNIX_S}.25,{{1}}", UNIX_S + 0.25),
        (f"{UNIX_S}250\t{{1}}", UNIX_S + 0.25),
        ("2022-12-20T10:47:11Z {1}", UNIX_S),
        ("2022-12-20 10:47:11.5, {1}", UNIX_S + 0.5),
        ("[2022-12-20 10:47:11] {1}", UNIX_S),
        ("2022-12-20T12:47:11+02:00;{1}", UNIX_S),
        (f"{{1}},{UNIX_S}", UNIX_S),
        (f"{{1}},r003669945,{UNIX_S}", UNIX_S),
        ("1500000000 " + tagged("{1}"), UNIX_S),
    ],
)
def test_times_wherever_logs_put_them(tmp_path: Path, line: str, time_s: float) -> None:
    path = saved(tmp_path, line.replace("{1}", EXAMPLE))
    assert [position.time_s for position in read_ais(path)] == [time_s]


def test_a_tag_block_in_milliseconds(tmp_path: Path) -> None:
    (position,) = read_ais(saved(tmp_path, tagged(EXAMPLE, f"s:x,c:{UNIX_S}500,n:4")))
    assert position.time_s == UNIX_S + 0.5


def test_without_a_time_it_is_counted(tmp_path: Path) -> None:
    odd = [EXAMPLE, "yesterday " + EXAMPLE, tagged(EXAMPLE, "s:x"), f"\\c:{UNIX_S}*00\\{EXAMPLE}", "12 " + EXAMPLE]
    counts = Counter[str]()
    assert len(list(read_ais(saved(tmp_path, *odd, tagged(EXAMPLE)), counts=counts))) == 1
    assert counts == {"positions": 1, "without time": 5}
    with pytest.raises(DataError, match=r"a\.nmea: holds no AIS position with a time \(without time 5\); give a log"):
        list(read_ais(saved(tmp_path, *odd)))


# ---------------------------------------------------------------------------------------------------------- damage


def test_damage_is_left_out_and_counted(tmp_path: Path) -> None:
    bad = [
        EXAMPLE[:-1] + "D",
        EXAMPLE.replace("7", "8", 1),
        EXAMPLE[:20],
        EXAMPLE.replace("K", "\xe9"),
        checked("AIVDM,1,1,,B,1,0"),  # six bits
        checked("AIVDM,1,1,,B,177KQJ5000G?,0"),
    ]
    others = ["", "# note", "$GPZDA,104711,20,12,2022,00,00*4B", checked("AIVDM,1,1,,B,402OviAuho;N>,0"), "noise"]
    counts = Counter[str]()
    lines = [f"{UNIX_S} {line}" for line in [*bad, *others, EXAMPLE, *bad]]
    assert len(list(read_ais(saved(tmp_path, *lines), counts=counts))) == 1
    assert counts == {"positions": 1, "damaged": 12}


def checked(text: str) -> str:
    check = 0
    for octet in text.encode():
        check ^= octet
    return f"!{text}*{check:02X}"


def test_a_position_that_is_none(tmp_path: Path) -> None:
    counts = Counter[str]()
    lines = [*sentences(lon=181, lat=91), *sentences(lon=181), *sentences(lat=91), EXAMPLE]
    assert len(list(read_ais(saved(tmp_path, *map(tagged, lines)), counts=counts))) == 1
    assert counts == {"positions": 1, "without position": 3}


def test_messages_in_parts_may_mingle_and_break_off(tmp_path: Path) -> None:
    first, second = halves(mmsi=1, group=4), halves(mmsi=2, group=5)
    counts = Counter[str]()
    order = [second[1], first[0], second[0], EXAMPLE, first[1], second[1], first[1], second[0]]
    path = saved(tmp_path, *(f"{UNIX_S + k} {line}" for k, line in enumerate(order)))
    found = [(position.time_s - UNIX_S, position.mmsi) for position in read_ais(path, counts=counts)]
    assert found == [(3, 477553000), (1, 1), (2, 2)]
    assert counts == {"positions": 3}


def test_a_message_with_a_gap_is_none(tmp_path: Path) -> None:
    (line,) = sentences(type=19)
    payload = line.split(",")[5]
    parts = [checked(f"AIVDM,3,{k + 1},4,A,{payload[20 * k : 20 * k + 20]},0") for k in range(3)]
    counts = Counter[str]()
    path = saved(tmp_path, *map(tagged, [parts[0], parts[2], parts[1], EXAMPLE]))
    assert len(list(read_ais(path, counts=counts))) == 1
    assert counts == {"positions": 1}


def test_messages_never_finished_are_forgotten(tmp_path: Path) -> None:
    first, last = halves(mmsi=1, group=4), halves(mmsi=2, group=5)
    unfinished = [checked(f"AIVDM,{total},1,{group},B,C3aDo8,0") for total in range(2, 10) for group in range(10)]
    lines = [first[0], *unfinished, last[0], last[1], first[1]]
    assert [position.mmsi for position in read_ais(saved(tmp_path, *map(tagged, lines)))] == [2]


def halves(mmsi: int, group: int) -> list[str]:
    """Write a message in two sentences."""
    (line,) = sentences(type=19, mmsi=mmsi)
    payload = line.split(",")[5]
    return [checked(f"AIVDM,2,{k + 1},{group},A,{payload[30 * k : 30 * k + 30]},0") for k in range(2)]


def test_one_ship_only(tmp_path: Path) -> None:
    lines = [tagged(line) for mmsi in (1, 2, 1) for line in sentences(mmsi=mmsi)]
    assert [position.mmsi for position in read_ais(saved(tmp_path, *lines), mmsi=1)] == [1, 1]
    with pytest.raises(DataError, match="holds no AIS position of 3 with a time"):
        list(read_ais(saved(tmp_path, *lines), mmsi=3))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"gone\.nmea: cannot be read"):
        list(read_ais(tmp_path / "gone.nmea"))
    with pytest.raises(DataError, match=r"a\.nmea: holds no AIS position with a time \(no sentence at all\)"):
        list(read_ais(saved(tmp_path)))


def test_without_pyais_the_sentence_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyais", None)
    with pytest.raises(
        DataError, match=r"a\.nmea: reading AIS needs pyais; install it with: pip install 'elusive\[ais\]'"
    ):
        list(read_ais(saved(tmp_path, tagged(EXAMPLE))))


@fuzzed
@given(
    payload=st.text("".join(map(chr, [*range(48, 88), *range(96, 120)])), max_size=90),
    fill=st.integers(0, 5),
    first=st.sampled_from("123BCK"),
    parts=st.sampled_from(["1,1,", "2,1,3"]),
)
def test_any_payload_is_a_position_or_counted(tmp_path: Path, payload: str, fill: int, first: str, parts: str) -> None:
    lines = [f"{UNIX_S} " + checked(f"AIVDM,{parts},A,{first}{payload},{fill}")]
    lines += [f"{UNIX_S} " + checked(f"AIVDM,2,2,3,A,{payload},{fill}")] if parts[0] == "2" else []
    counts = Counter[str]()
    found = list(read_ais(saved(tmp_path, *lines, tagged(EXAMPLE)), counts=counts))
    assert found[-1].mmsi == 477553000
    assert counts.total() == 2
    assert all(possible(position) for position in found)


@fuzzed
@given(noise=st.binary(max_size=120), at=st.integers(0, 200))
def test_any_octets_spoil_their_own_line_only(tmp_path: Path, noise: bytes, at: int) -> None:
    lines = "\n".join([tagged(EXAMPLE)] * 2).encode()
    path = tmp_path / "a.nmea"
    path.write_bytes(lines[:at] + noise + lines[at:] + b"\n" + tagged(EXAMPLE).encode())
    found = list(read_ais(path))
    assert found[-1].mmsi == 477553000
    assert all(possible(position) for position in found)


def possible(position: AisPosition) -> bool:
    return abs(position.lon_deg) <= 180 and abs(position.lat_deg) <= 90 and not position.sog_mps < 0
