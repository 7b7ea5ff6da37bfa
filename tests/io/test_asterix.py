"""ASTERIX category 048: bytes decoded by hand, records of every item, captures of every kind, and what is broken."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from elusive.errors import DataError
from elusive.io import TargetReport, asterix_plots, open_radar_plots, read_asterix, summarize_asterix
from elusive.io.pcap import udp_payloads
from tests import recordings

DATA = recordings.DATA / "asterix"
needs_recordings = pytest.mark.skipif(
    not DATA.is_dir(), reason=f"no recordings: {DATA} is missing; point ELUSIVE_DATA at the data"
)


def fuzzed(cases: int) -> settings:
    return settings(deadline=None, max_examples=cases, suppress_health_check=[HealthCheck.function_scoped_fixture])


# Each item of the user application profile in its order, as one example of its bytes.
ITEMS = {
    "010": "19c9",
    "140": "356d4d",
    "020": "a14110",  # two extents
    "040": "c5aff1e0",
    "070": "0200",
    "090": "0528",
    "130": "fe01020304050607",
    "220": "3c660c",
    "240": "10c236d41820",
    "250": "02" + "c0780031bc000040" * 2,
    "161": "0deb",
    "042": "ff800100",
    "200": "07b9582e",
    "170": "4100",
    "210": "01020304",
    "030": "030504",
    "080": "0fff",
    "100": "01020304",
    "110": "3fff",
    "120": "c0" + "03f6" + "02" + "000102030405" * 2,
    "230": "20f5",
    "260": "01020304050607",
    "055": "1f",
    "050": "0200",
    "065": "1f",
    "060": "0fff",
    "SP": "04ffffff",
    "RE": "0380ff",
}


def record(**items: str) -> bytes:
    """Write a record: the field specification, then the items in the profile's order."""
    present = [name in items for name in ITEMS]
    while present and not any(present[-7:]) and len(present) > 7:
        present = present[:-7]
    octets = []
    for start in range(0, len(present), 7):
        bits = sum(there << 7 - k for k, there in enumerate(present[start : start + 7]))
        octets.append(bits | (start + 7 < len(present)))
    return bytes(octets) + b"".join(bytes.fromhex(items[name]) for name in ITEMS if name in items)


def block(*records: bytes, category: int = 48) -> bytes:
    body = b"".join(records)
    return bytes([category]) + struct.pack(">H", 3 + len(body)) + body


def plot(time_s: float = 100.0, radar: str = "1901", bearing: int = 0, **items: str) -> bytes:
    """Write the record of a plot at 2 NM."""
    return record(
        **{"010": radar, "140": f"{round(time_s * 128):06x}", "020": "20", "040": f"0200{bearing:04x}"} | items
    )


def saved(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "a.raw"
    path.write_bytes(data)
    return path


def times_of(path: Path, **options: object) -> list[float]:
    return [p.time_s for p in asterix_plots(path, **options)]  # type: ignore[arg-type]


# ---------------------------------------------------------------------------------------------------- values by hand

HAND = "300030 fdf702 19c9 356d4d a0 c5aff1e0 0200 0528 3c660c 10c236d41820 01c0780031bc000040 0deb 07b9582e 4100 20f5"


def test_a_record_decoded_by_hand(tmp_path: Path) -> None:
    (report,) = read_asterix(saved(tmp_path, bytes.fromhex(HAND)))
    assert report.radar == (25, 201)  # 19, c9
    assert report.time_s == 3501389 / 128 == 27354.6015625  # 07:35:54.6
    assert (report.kind, report.real) == (5, True)  # 101 0 0 0 0: roll-call
    assert report.range_m == 50607 / 256 * 1852 == 366110.015625
    assert math.degrees(report.bearing_rad) == pytest.approx(61920 * 360 / 65536)  # 340.137
    assert report.mode_3a == "1000"
    assert report.address == 0x3C660C
    # 000100 001100 001000 110110 110101 000001 100000 100000: 4 D, 12 L, 8 H, 54 '6', 53 '5', 1 A, 32 blank twice
    assert report.callsign == "DLH65A"
    assert report.track == 3563
    assert report.speed_mps == pytest.approx(1977 / 16384 * 1852)  # 223.47, 434 knots
    assert math.degrees(report.heading_rad) == pytest.approx(22574 * 360 / 65536)  # 124.00
    assert math.isnan(report.doppler_mps + report.x_m)


@pytest.mark.parametrize(
    ("item", "expected"),
    [
        ("80" + "0007", 7.0),
        ("80" + "03f6", -10.0),  # 1024 - 10
        ("80" + "0200", -512.0),
        ("80" + "01ff", 511.0),
        ("80" + "8007", math.nan),  # doubtful
        ("40" + "01" + "000700010002", math.nan),  # raw and ambiguous
        ("c0" + "0003" + "01" + "000700010002", 3.0),
        ("c0" + "0003" + "00", 3.0),
        ("00", math.nan),
    ],
)
def test_doppler(tmp_path: Path, item: str, expected: float) -> None:
    (report,) = read_asterix(saved(tmp_path, block(plot(**{"120": item, "230": "20f5"}))))
    assert report.doppler_mps == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(("x", "metres"), [("0080", 1852.0), ("ff80", -1852.0), ("8000", -256 * 1852.0)])
def test_cartesian_position_has_a_sign(tmp_path: Path, x: str, metres: float) -> None:
    (report,) = read_asterix(saved(tmp_path, block(plot(**{"042": x + "0001"}))))
    assert (report.x_m, report.y_m) == (metres, 1852 / 128)


@pytest.mark.parametrize(
    ("item", "kind", "real", "beyond"),
    [
        ("20", 1, True, False),
        ("00", 0, True, False),
        ("f0", 7, False, False),  # simulated
        ("22", 1, False, False),  # fixed transponder
        ("2180", 1, False, False),  # test target
        ("2140", 1, True, True),  # beyond 256 NM
        ("ed3ffe", 7, True, False),  # every other bit
    ],
)
def test_descriptor(tmp_path: Path, item: str, kind: int, real: bool, beyond: bool) -> None:
    (report,) = read_asterix(saved(tmp_path, block(plot(**{"020": item}))))
    assert (report.kind, report.real, math.isnan(report.range_m)) == (kind, real, beyond)
    assert report.bearing_rad == 0.0


def test_flags_beside_a_number_are_not_of_it(tmp_path: Path) -> None:
    (report,) = read_asterix(saved(tmp_path, block(plot(**{"070": "fe53", "161": "f123"}))))
    assert (report.mode_3a, report.track) == ("7123", 0x123)


# ------------------------------------------------------------------------------------------------------ every item


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_is_passed_by_its_length(tmp_path: Path, name: str) -> None:
    last = "161" if name != "161" else "042"
    alone = record(**{name: ITEMS[name]})
    with_others = record(**{"010": "1901", name: ITEMS[name], last: ITEMS[last], "RE": ITEMS["RE"]})
    counts = Counter[str]()
    reports = list(read_asterix(saved(tmp_path, block(alone, with_others, plot())), counts))
    assert counts == {"reports": 3}
    assert reports[1].track == 3563
    assert reports[2].range_m == 2 * 1852


@fuzzed(100)
@given(names=st.lists(st.sets(st.sampled_from(list(ITEMS)), min_size=1), min_size=1, max_size=4), data=st.data())
def test_records_of_any_items(tmp_path: Path, names: list[set[str]], data: st.DataObject) -> None:
    records = []
    for chosen in names:
        items = {name: ITEMS[name] for name in chosen}
        octets = data.draw(st.integers(0, 3))
        items |= {"SP": f"{octets + 1:02x}" + "5a" * octets} if "SP" in chosen else {}
        items |= {"250": f"{octets:02x}" + "5a" * 8 * octets} if "250" in chosen else {}
        items |= {"030": "51" * octets + "50"} if "030" in chosen else {}
        records.append(record(**items))
    counts = Counter[str]()
    reports = list(read_asterix(saved(tmp_path, block(*records)), counts))
    assert counts == {"reports": len(names)}
    for chosen, report in zip(names, reports, strict=True):
        assert report.radar == ((25, 201) if "010" in chosen else None)
        assert report.track == (3563 if "161" in chosen else None)
        assert report.speed_mps == pytest.approx(223.474365234375 if "200" in chosen else math.nan, nan_ok=True)
        assert report.doppler_mps == pytest.approx(-10.0 if "120" in chosen else math.nan, nan_ok=True)
        assert report.callsign == ("DLH65A" if "240" in chosen else None)


# ------------------------------------------------------------------------------------------------------- malformed


@pytest.mark.parametrize(
    "bad",
    [
        b"\x00",  # no item
        b"\x01\x00",  # no item, in two octets
        b"\x01\x01\x01\x01\x80",  # item 29
        b"\x01\x01\x01\x03\x80\x00",  # a fifth octet
        b"\xff" * 8,  # a specification without end
        record(**{"010": "19"}),
        record(**{"140": "a8c000"}),  # 86400 s
        record(**{"020": "a1a1"}),  # extents without end
        record(**{"250": "02" + "00" * 15}),
        record(**{"120": "20"}),  # a part that there is not
        record(**{"120": "21"}),
        record(**{"130": "ff" + "00" * 7}),
        record(**{"120": "4001"}),
        record(**{"SP": "00"}),
        record(**{"RE": "05ff"}),
    ],
)
def test_a_malformed_record_is_left_out_and_counted(tmp_path: Path, bad: bytes) -> None:
    data = block(plot(1.0), bad) + block(bad) + block(plot(2.0)) + block()
    counts = Counter[str]()
    reports = list(read_asterix(saved(tmp_path, data), counts))
    assert [report.time_s for report in reports] == [1.0, 2.0]
    assert counts == {"reports": 2, "malformed": 2}


@pytest.mark.parametrize("tail", [b"0", b"0\x00", b"0\x00\x02", b"0\x00\x00", block(plot())[:-1], b"0\xff\xff\x80"])
def test_what_follows_a_damaged_length_is_left_out(tmp_path: Path, tail: bytes) -> None:
    summary = summarize_asterix(saved(tmp_path, block(plot(), plot()) + tail))
    assert (summary.reports, summary.malformed) == (2, 1)


def test_other_categories_are_passed_over(tmp_path: Path) -> None:
    data = block(b"abc", category=34) + block(plot()) + block(b"\xff" * 40, category=1) + block(b"", category=34)
    summary = summarize_asterix(saved(tmp_path, data))
    assert summary.others == {34: 2, 1: 1}
    assert summary.radars == {(25, 1): 1}
    assert math.isnan(summary.midnight_unix_s)


def test_a_file_without_the_category_is_a_sentence(tmp_path: Path) -> None:
    for data, told in [
        (b"", "nothing at all"),
        (block(b"abc", category=34), "category 34 1"),
        (b"0\x00\x01 a block of one octet", "malformed 1"),
        (block(b"\x00"), "malformed 1"),
        (pcap([ethernet(b"\x12\x34no radar")]), "other packets 1"),
    ]:
        path = saved(tmp_path, data)
        for read in (lambda path: list(read_asterix(path)), lambda path: list(asterix_plots(path)), summarize_asterix):
            with pytest.raises(DataError, match=rf"a\.raw: holds no ASTERIX record of category 048 \({told}\)"):
                read(path)
    with pytest.raises(DataError, match=r"gone\.raw: cannot be read"):
        summarize_asterix(tmp_path / "gone.raw")


@fuzzed(300)
@given(data=st.binary(max_size=200), form=st.sampled_from(["raw", "block", "pcap", "pcapng"]))
def test_random_bytes_never_raise_more_than_a_sentence(tmp_path: Path, data: bytes, form: str) -> None:
    wrapped = {
        "raw": lambda: data,
        "block": lambda: block(data),
        "pcap": lambda: b"\xd4\xc3\xb2\xa1" + data,
        "pcapng": lambda: b"\x0a\x0d\x0d\x0a" + data,
    }[form]()
    outcome(saved(tmp_path, wrapped))


@fuzzed(400)
@given(data=st.data())
def test_damaged_recordings_never_raise_more_than_a_sentence(tmp_path: Path, data: st.DataObject) -> None:
    every = record(**ITEMS)
    frames = [ethernet(block(every, plot(k), every)) for k in range(3)]
    whole = data.draw(st.sampled_from([block(every, every) * 3, pcap(frames), pcapng(frames), pcapng(frames, ">")]))
    damaged = bytearray(whole[: data.draw(st.integers(0, len(whole)))])
    for _ in range(data.draw(st.integers(0, 4)) if damaged else 0):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    outcome(saved(tmp_path, bytes(damaged)))


def outcome(path: Path) -> None:
    """Read a file; nothing but a sentence may come of it, and every report holds possible numbers."""
    counts = Counter[str]()
    try:
        reports = list(read_asterix(path, counts))
    except DataError as error:
        assert str(error).startswith(str(path))  # noqa: PT017
        return
    assert counts["reports"] == len(reports) > 0
    for report in reports:
        assert math.isnan(report.time_s) or 0 <= report.time_s < 86400
        assert math.isnan(report.bearing_rad) or 0 <= report.bearing_rad < 2 * math.pi
        assert math.isnan(report.range_m) or 0 <= report.range_m < 256 * 1852
    for radar in {report.radar for report in reports} - {None}:
        try:
            times = times_of(path, radar=radar)
        except DataError as error:
            assert "no plot" in str(error)  # noqa: PT017
        else:
            assert times == sorted(times)


# -------------------------------------------------------------------------------------------------------- captures


def udp(payload: bytes) -> bytes:
    return struct.pack(">HHHH", 4000, 8600, 8 + len(payload), 0) + payload


def ipv4(payload: bytes, *, options: int = 0, fragment: int = 0, protocol: int = 17) -> bytes:
    datagram = udp(payload)
    size = 20 + 4 * options + len(datagram)
    head = struct.pack(">BBHHHBBH8s", 0x45 + options, 0, size, 1, fragment, 64, protocol, 0, b"\x0a\x00\x00\x01" * 2)
    return head + b"\x01" * 4 * options + datagram


def ipv6(payload: bytes, *, extensions: tuple[int, ...] = ()) -> bytes:
    datagram, following = udp(payload), 17
    for kind in reversed(extensions):
        octets = 1 if kind == 43 else 0
        datagram, following = bytes([following, octets]) + b"\xee" * (6 + 8 * octets) + datagram, kind
    return struct.pack(">IHBB32s", 0x60000000, len(datagram), following, 64, b"\x01" * 32) + datagram


def ethernet(payload: bytes, *, tags: tuple[int, ...] = (), packet: Callable[..., bytes] = ipv4, pad: int = 0) -> bytes:
    kind = 0x86DD if packet is ipv6 else 0x0800
    tagged = b"".join(struct.pack(">HH", tag, 7) for tag in tags)
    return b"\x01" * 12 + tagged + struct.pack(">H", kind) + packet(payload) + b"\x00" * pad


def pcap(frames: list[bytes], *, magic: str = "d4c3b2a1", link: int = 1, unix_s: int = 1462433756) -> bytes:
    order = "<" if magic.endswith("a1") or magic == "4d3cb2a1" else ">"
    extra = b"\x00" * 8 if magic in ("34cdb2a1", "a1b2cd34") else b""
    head = bytes.fromhex(magic) + struct.pack(order + "HHIIII", 2, 4, 0, 0, 65535, link)
    packets = [struct.pack(order + "IIII", unix_s, 500, len(f), len(f)) + extra + f for f in frames]
    return head + b"".join(packets)


def pcapng(frames: list[bytes], order: str = "<", *, kind: int = 6, resolution: bytes = b"", link: int = 1) -> bytes:
    def wrapped(block_kind: int, body: bytes) -> bytes:
        body += b"\x00" * (-len(body) % 4)
        size = 12 + len(body)
        return struct.pack(order + "II", block_kind, size) + body + struct.pack(order + "I", size)

    ticks = 1462433756 * (1000 if resolution else 10**6)
    options = struct.pack(order + "HH", 9, 1) + resolution + b"\x00" * 3 if resolution else b""
    data = wrapped(0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    data += wrapped(1, struct.pack(order + "HHI", link, 0, 0) + options)
    data += wrapped(5, b"statistics..")
    for f in frames:
        head = struct.pack(order + "IIIII", 0, ticks >> 32, ticks & 0xFFFFFFFF, len(f), len(f))
        data += wrapped(kind, head + f if kind == 6 else struct.pack(order + "I", len(f)) + f)
    return data


ONE = block(plot(27356.0))
CAPTURES = {
    **{f"pcap {m}": pcap([ethernet(ONE)], magic=m) for m in ("d4c3b2a1", "4d3cb2a1", "34cdb2a1")},
    "pcap a1b2c3d4": b"\xa1\xb2\xc3\xd4"
    + struct.pack(">HHIIIIIIII", 2, 4, 0, 0, 65535, 1, 1462433756, 0, len(ethernet(ONE)), len(ethernet(ONE)))
    + ethernet(ONE),
    "frame check": pcap([ethernet(ONE)], link=0x14000001),
    "pcapng": pcapng([ethernet(ONE)]),
    "pcapng >": pcapng([ethernet(ONE)], ">"),
    "pcapng in ms": pcapng([ethernet(ONE)], resolution=b"\x03"),
    "pcapng simple": pcapng([ethernet(ONE)], kind=3),
    "two sections": pcapng([b"noise"], ">", link=113) + pcapng([ethernet(ONE)]),
    "vlan": pcap([ethernet(ONE, tags=(0x8100,))]),
    "double vlan": pcap([ethernet(ONE, tags=(0x88A8, 0x8100))]),
    "options": pcap([ethernet(ONE, packet=lambda payload: ipv4(payload, options=3))]),
    "padding": pcap([ethernet(ONE, pad=9)]),
    "ipv6": pcap([ethernet(ONE, packet=ipv6)]),
    "raw ip": pcap([ipv4(ONE)], link=101),
    "loopback": pcap([b"\x02\x00\x00\x00" + ipv4(ONE)], link=0),
    "cooked": pcap([b"\x00" * 14 + b"\x08\x00" + ipv4(ONE)], link=113),
    "cooked 2": pcap([b"\x08\x00" + b"\x00" * 18 + ipv4(ONE)], link=276),
    "extensions": pcap([ipv6(ONE, extensions=(0, 43, 60))], link=229),
    "do not fragment": pcap([ethernet(ONE, packet=lambda payload: ipv4(payload, fragment=0x4000))]),
}


@pytest.mark.parametrize("kind", CAPTURES)
def test_captures_of_every_kind(tmp_path: Path, kind: str) -> None:
    summary = summarize_asterix(saved(tmp_path, CAPTURES[kind]))
    assert (summary.reports, summary.malformed, summary.others) == (1, 0, {})
    expected = math.nan if "simple" in kind else 1462406400.0  # 2016-05-05; the packet came at 07:35:56
    assert summary.midnight_unix_s == pytest.approx(expected, nan_ok=True, rel=0)


@pytest.mark.parametrize(
    ("data", "unix_s"),
    [
        (pcap([ethernet(ONE, pad=9)]), 1462433756.0005),
        (pcap([ethernet(ONE, pad=9)], magic="4d3cb2a1"), 1462433756.0000005),
        (pcapng([ethernet(ONE, pad=9)]), 1462433756.0),
        (pcapng([ethernet(ONE, pad=9)], resolution=b"\x03"), 1462433756.0),
        (pcapng([ethernet(ONE, pad=9)], resolution=b"\x8a"), 1462433756000 / 1024),
    ],
)
def test_what_a_packet_carried_and_when(tmp_path: Path, data: bytes, unix_s: float) -> None:
    with saved(tmp_path, data).open("rb") as file:
        ((captured_s, payload),) = udp_payloads(file)
    assert captured_s == unix_s
    assert payload == ONE


def test_other_traffic_is_passed_over(tmp_path: Path) -> None:
    others = [
        ethernet(ONE, packet=lambda payload: ipv4(payload, fragment=0x2000)),  # the first of several fragments
        ethernet(ONE, packet=lambda payload: ipv4(payload, fragment=0x0001)),
        ethernet(ONE, packet=lambda payload: ipv4(payload, protocol=6)),
        b"\x01" * 12 + b"\x08\x06" + b"\x00" * 28,  # an address query
        b"\x01" * 12 + b"\x81\x00",
        b"",
        ethernet(b""),
        ethernet(b"\x12\x34\x01\x00\x00\x01 a name query"),
    ]
    counts = Counter[str]()
    assert len(list(read_asterix(saved(tmp_path, pcap([*others, ethernet(ONE), *others])), counts))) == 1
    assert counts == {"reports": 1, "other packets": 2}


def test_a_capture_that_cuts_packets_short(tmp_path: Path) -> None:
    path = saved(tmp_path, pcap([ethernet(block(plot(), plot()))[:-2], ethernet(ONE)]))
    counts = Counter[str]()
    assert len(list(read_asterix(path, counts))) == 1
    assert counts["malformed"] == 1
    whole = pcap([ethernet(ONE), ethernet(ONE)])
    assert summarize_asterix(saved(tmp_path, whole[:-60])).reports == 1


def test_a_packet_cut_short_is_not_lengthened_by_padding(tmp_path: Path) -> None:
    for cut in range(1, 5):
        with saved(tmp_path, pcapng([ethernet(ONE)[:-cut]])).open("rb") as file:
            assert [payload for _, payload in udp_payloads(file)] == [ONE[:-cut]]


def test_nothing_is_read_behind_a_damaged_length(tmp_path: Path) -> None:
    data = bytearray(pcap([ethernet(ONE)] * 3))
    second = 24 + 16 + len(ethernet(ONE))
    data[second + 8 : second + 12] = b"\xff\xff\xff\x7f"
    assert summarize_asterix(saved(tmp_path, bytes(data))).reports == 1


def test_a_capture_is_streamed(tmp_path: Path) -> None:
    path = saved(tmp_path, pcap([ethernet(ONE)] * 3))
    with path.open("rb") as file:
        payloads = udp_payloads(file)
        assert next(payloads)[1] == ONE
        assert file.read(1) != b""


# ----------------------------------------------------------------------------------------------------------- plots


def test_plots_are_put_in_order_and_each_taken_once(tmp_path: Path) -> None:
    times = [5.0, 7.0, 6.0, 6.0, 7.0, 3.0, 30.0, 29.0, 21.0, 31.0]
    counts = Counter[str]()
    path = saved(tmp_path, b"".join(block(plot(t)) for t in times))
    assert times_of(path, counts=counts) == [3.0, 5.0, 6.0, 7.0, 21.0, 29.0, 30.0, 31.0]
    assert counts == {"reports": 10, "duplicates": 2}


def test_what_comes_too_late_is_left_out(tmp_path: Path) -> None:
    counts = Counter[str]()
    path = saved(tmp_path, block(*map(plot, [5.0, 6.0, 30.0, 5.5, 31.0])))
    assert times_of(path, counts=counts) == [5.0, 6.0, 30.0, 31.0]
    assert counts["late"] == 1


def test_midnight(tmp_path: Path) -> None:
    path = saved(tmp_path, block(*map(plot, [86398.0, 86399.5, 0.25, 86399.75, 2.0, 43000.0, 86000.0, 1.0])))
    expected = [86398.0, 86399.5, 86399.75, 86400.25, 86402.0, 129400.0, 172400.0, 172801.0]
    assert times_of(path) == expected


def test_what_is_no_plot_is_left_out(tmp_path: Path) -> None:
    odd = {"no detection": {"020": "00"}, "not real": {"020": "30"}, "no position": {"020": "2140"}}
    records = [plot(float(k), **items) for k, items in enumerate(odd.values())]
    counts = Counter[str]()
    path = saved(tmp_path, block(*records, record(**{"010": "1901", "161": "0001"}), plot(9.0, **{"120": "800007"})))
    (only,) = asterix_plots(path, counts=counts)
    assert only[:4] == (9.0, 2 * 1852.0, 0.0, 7.0)
    assert counts == {"reports": 5, "no detection": 1, "not real": 1, "no position": 2}
    with pytest.raises(DataError, match=r"hold no plot \(reports 3, no detection 1, not real 1, no position 1\)"):
        list(asterix_plots(saved(tmp_path, block(*records))))


def test_several_radars_need_a_choice(tmp_path: Path) -> None:
    path = saved(tmp_path, block(plot(1.0, "1901"), plot(2.0, "1902"), plot(3.0, "1902")))
    with pytest.raises(DataError, match=r"several radars report: 25/1 \(1 reports\), 25/2 \(2 reports\); choose one"):
        times_of(path)
    assert times_of(path, radar=(25, 2)) == [2.0, 3.0]
    with pytest.raises(DataError, match=r"no report of radar 1/2; there are 25/1"):
        times_of(path, radar=(1, 2))


def test_a_turn_of_the_antenna_is_a_scan(tmp_path: Path) -> None:
    period, truth = 4.0, {0: [0.1, 0.5], 1: [0.1, 0.5], 2: [], 3: [0.51], 4: [0.09]}
    records = [
        plot(1000 + period * (turn + part), bearing=round(part * 65536)) for turn in truth for part in truth[turn]
    ]
    source = open_radar_plots(saved(tmp_path, block(*records)), rotation_s=period)
    for _ in range(2):
        scans = list(source)
        assert [len(scan.range_m) for scan in scans] == [2, 2, 0, 1, 1]
        assert source.counts == {"reports": 6}
    assert scans[0].time_s == pytest.approx(1000 + 0.3 * period, abs=1 / 128)
    assert scans[2].time_s == pytest.approx(1000 + 2.5 * period, abs=0.05)
    with pytest.raises(DataError, match="give rotation_s"):
        open_radar_plots(saved(tmp_path, block(*records)))


# -------------------------------------------------------------------------------------------------- the recordings


@needs_recordings
def test_the_recordings_hold_what_is_said_of_them() -> None:
    assert summarize_asterix(DATA / "cat048.raw")[:3] == (1, 0, {})
    summary = summarize_asterix(DATA / "cat_034_048.pcap")
    assert summary[:3] == (128, 0, {34: 34})
    assert sum(summary.radars.values()) == 128
    assert {radar[0] for radar in summary.radars if radar} == {25}
    assert summary.midnight_unix_s == 1462406400.0
    with (DATA / "cat_034_048.pcap").open("rb") as file:
        assert len(list(udp_payloads(file))) == 100


@needs_recordings
def test_the_recording_is_of_two_networks_and_so_each_plot_comes_twice() -> None:
    reports = list(read_asterix(DATA / "cat_034_048.pcap"))
    assert len(set(map(repr, reports))) == 64
    total, unique = Counter[str](), 0
    for radar in summarize_asterix(DATA / "cat_034_048.pcap").radars:
        counts = Counter[str]()
        unique += len(list(asterix_plots(DATA / "cat_034_048.pcap", radar, counts)))
        total += counts
    assert unique == 64 - total["no detection"] == 63


@needs_recordings
def test_measured_and_tracked_positions_of_the_recording_agree() -> None:
    checked = 0
    for report in read_asterix(DATA / "cat_034_048.pcap"):
        if math.isnan(report.x_m) or report.kind == 0:
            continue
        # the tracked position is in the plane, the measured range slant: up to some 11 km of height between them
        assert math.hypot(report.x_m, report.y_m) == pytest.approx(report.range_m, abs=2500)
        apart = math.atan2(report.x_m, report.y_m) - report.bearing_rad
        assert abs(math.remainder(apart, 2 * math.pi)) < 0.02
        checked += 1
    assert checked > 50


def test_a_report_says_what_it_lacks() -> None:
    empty = TargetReport()
    assert empty.radar is None
    assert math.isnan(empty.time_s + empty.range_m)


def test_radar_video_as_arrays_is_no_recording_of_plots(tmp_path):
    np.savez(tmp_path / "video.npz", amplitude=np.zeros((30, 40)))
    with pytest.raises(DataError, match=r"video\.npz: holds arrays, .* `elusive track video`"):
        summarize_asterix(tmp_path / "video.npz")
