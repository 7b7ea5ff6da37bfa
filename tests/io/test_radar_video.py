"""Radar video as recorded: Navico captures, what is none, what is spoilt, and what comes over a network."""

from __future__ import annotations

import gzip
import math
import socket
import struct
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.ais import read_ais
from elusive.io.asterix_video import send_asterix_video, write_asterix_video
from elusive.io.nmea import checksum
from elusive.io.radar_video import open_radar_video
from elusive.io.radar_video_arrays import write_radar_video_arrays
from elusive.io.replay import replay
from elusive.io.sources import Feed
from elusive.sensors.spokes import Spokes, check_spokes, join_spokes
from tests.brokers import free_port
from tests.io.test_asterix import block, pcap, pcapng, plot
from tests.io.test_asterix_video import agree, video
from tests.processes import HUNG_S
from tests.recordings import DATA

NOON = 1_777_636_800
RADAR, GROUP = b"\x0a\x38\x00\x9e", b"\xec\x06\x07\x08"
SPOKES = 32


def navico(first: int, *, large: int = 0x80, small: int = 780, heading: int = 0x8000, high: int = 0) -> bytes:
    """Make a packet of spokes, of which each sample says where it is."""
    spokes = b""
    for k in range(first, first + SPOKES):
        head = (24, 2, k % 4096 | high, 0x4400, large, 2 * k % 4096, heading, small, 0)
        samples = (np.arange(1024) + k) % 16
        data = (samples[0::2] | samples[1::2] << 4).astype(np.uint8).tobytes()
        spokes += struct.pack("<BBHHHHHHH", *head) + b"\xaa" * 8 + data
    return b"\x01\x00\x00\x00\x00\x20\x00\x02" + spokes


def ip(payload: bytes, protocol: int, identity: int = 0, fragment: int = 0) -> bytes:
    head = struct.pack(">BBHHHBBH", 0x45, 0, 20 + len(payload), identity, fragment, 64, protocol, 0)
    return head + RADAR + GROUP + payload


def udp(payload: bytes, port: int, identity: int = 0, mtu: int = 1480) -> list[bytes]:
    octets = struct.pack(">HHHH", 1066, port, 8 + len(payload) & 0xFFFF, 0) + payload
    parts = range(0, len(octets), mtu)
    return [ip(octets[at : at + mtu], 17, identity, at // 8 | 0x2000 * (at + mtu < len(octets))) for at in parts]


def tcp(text: bytes, sequence: int) -> bytes:
    return ip(struct.pack(">HHIIBBHHH", 2000, 40000, sequence & 0xFFFFFFFF, 0, 0x50, 0x10, 0, 0, 0) + text, 6)


def ethernet(packet: bytes) -> bytes:
    return b"\x01" * 12 + b"\x08\x00" + packet


def cooked(packet: bytes) -> bytes:
    return b"\x00" * 14 + b"\x08\x00" + packet


def sentence(body: str) -> bytes:
    return f"${body}*{checksum(body):02X}\r\n".encode("ascii")


def saved(path: Path, octets: bytes) -> Path:
    path.write_bytes(octets)
    return path


def timed(frames: list[tuple[float, bytes]]) -> bytes:
    records = [struct.pack("<IIII", int(s), round(s % 1 * 1e6), len(f), len(f)) + f for s, f in frames]
    return pcap([]) + b"".join(records)


def recorded() -> Path:
    if not (DATA / "radar").is_dir():
        pytest.skip("no radar video recordings beside the project")
    return DATA / "radar"


def read(path: Path) -> Spokes:
    return join_spokes([check_spokes(part) for part in open_radar_video(path)])


# ------------------------------------------------------------------------------------------------------- recordings


def turns_of(spokes: Spokes) -> float:
    """Turns of the antenna, against the ship."""
    azimuth_rad = spokes.azimuth_rad - spokes.heading_rad
    return float(np.sum(np.diff(azimuth_rad) % (2 * np.pi))) / (2 * np.pi)


def heading_deg_of(spokes: Spokes) -> float:
    return float(np.degrees(np.angle(np.exp(1j * spokes.heading_rad).mean())) % 360)


@pytest.mark.thorough
def test_the_harbour_is_what_is_known_of_it() -> None:
    path = recorded() / "navico_4g_harbour.pcap.gz"
    found = read(path)
    assert found.amplitude.shape == (41_664, 1024)
    assert (found.bits, found.from_north) == (4, True)
    assert found.time_s[-1] - found.time_s[0] == pytest.approx(51, abs=0.3)
    assert turns_of(found) == pytest.approx(20.34, abs=0.01)
    assert found.start_m + 1024 * found.step_m == pytest.approx(195, abs=0.05)
    assert heading_deg_of(found) == pytest.approx(183.8, abs=0.2)
    assert found.lonlat_deg[0] == pytest.approx((5.428, 53.180), abs=1e-3)
    assert len({position.mmsi for position in read_ais(path)}) == 186


def test_the_halo_is_what_is_known_of_it() -> None:
    path = recorded() / "navico_halo.pcap"
    found = read(path)
    assert (len(found.amplitude), found.bits) == (6528, 4)
    lasted_s = found.time_s[-1] - found.time_s[0]
    assert lasted_s == pytest.approx(6.4, abs=0.1)
    assert found.start_m + found.amplitude.shape[1] * found.step_m == pytest.approx(25_465, abs=0.05)
    assert heading_deg_of(found) == pytest.approx(296.0, abs=0.1)
    assert lasted_s / turns_of(found) == pytest.approx(2.0, abs=0.02)
    assert found.lonlat_deg[0] == pytest.approx((5.2676, 53.1790), abs=1e-3)
    assert len({position.mmsi for position in read_ais(path)}) == 122
    assert len(list(read_ais(path))) == 123
    # 2048 spokes a turn of 2 s, told by packets of 32 that come 29 to 34 ms after each other
    time_s = np.concatenate([part.time_s for part in open_radar_video(path)])
    off = time_s - np.polyval(np.polyfit(np.arange(6528), time_s - time_s[0], 1), np.arange(6528)) - time_s[0]
    assert np.abs(np.diff(time_s) - 2 / 2048).max() < 5e-4
    assert np.std(off) < 2e-3


def test_the_wind_farm_lies_south_of_the_halo() -> None:
    """Windpark Fryslan, eighty-nine turbines within 3 km of 53.00 N 5.27 E, fills no other part of its ring."""
    whole = join_spokes(list(open_radar_video(recorded() / "navico_halo.pcap")))
    ring = (whole.range_m > 18_000) & (whole.range_m < 22_000)
    strength = whole.amplitude[:, ring].mean(axis=1)
    resultant = (strength * np.exp(1j * whole.azimuth_rad)).sum()
    lon, lat = whole.lonlat_deg[0]
    expected = math.degrees(math.atan2((5.27 - lon) * math.cos(math.radians(lat)), 53.0 - lat)) % 360
    assert math.degrees(np.angle(resultant)) % 360 == pytest.approx(expected, abs=4)


def test_ships_are_where_ais_says_and_nowhere_else() -> None:
    path = recorded() / "navico_halo.pcap"
    whole = join_spokes(list(open_radar_video(path)))
    lon, lat = whole.lonlat_deg[0]
    places = {
        ship.mmsi: ((ship.lon_deg - lon) * 111_320 * math.cos(math.radians(lat)), (ship.lat_deg - lat) * 111_132)
        for ship in read_ais(path)
    }
    east, north = np.array(list(places.values())).T
    range_m, bearing = np.hypot(east, north), np.arctan2(east, north)
    in_range = range_m < 25_000

    def seen(turned_rad: float) -> float:
        """Return the share of ships that have an echo within 1.5 degrees and 150 m, all bearings turned."""
        found = []
        for far_m, bearing_rad in zip(range_m[in_range], bearing[in_range] + turned_rad, strict=True):
            off = np.abs(np.angle(np.exp(1j * (whole.azimuth_rad - bearing_rad))))
            near = np.abs(whole.range_m - far_m) < 150
            found.append(whole.amplitude[off < math.radians(1.5)][:, near].max() > 3)
        return float(np.mean(found))

    assert seen(0.0) > 0.75
    assert max(seen(math.radians(turned)) for turned in range(45, 316, 45)) < 0.45


# ---------------------------------------------------------------------------------------------------------- packets


@pytest.mark.parametrize("link", ["pcap", "pcapng", "cooked", "gzip", "one by one"])
def test_a_turn_is_read_from_any_capture(tmp_path: Path, link: str) -> None:
    frames = [part for k in range(64) for part in udp(navico(SPOKES * k), 6678, k)]
    if link == "cooked":
        octets = pcap([cooked(frame) for frame in frames], link=113)
    else:
        octets = (pcapng if link == "pcapng" else pcap)([ethernet(frame) for frame in frames])
    if link == "one by one":  # fragments of a datagram may come in any order
        octets = pcap([ethernet(part) for k in range(64) for part in udp(navico(SPOKES * k), 6678, k)[::-1]])
    found = read(saved(tmp_path / "capture", gzip.compress(octets) if link == "gzip" else octets))
    assert found.amplitude.shape == (2048, 1024)
    expected = (np.arange(1024)[None] + np.arange(2048)[:, None]) % 16
    np.testing.assert_array_equal(found.amplitude, expected)
    np.testing.assert_allclose(found.azimuth_rad, np.arange(2048) * 2 * np.pi / 2048)
    assert (found.from_north, found.start_m, found.bits) == (False, 0, 4)
    assert found.step_m * 1024 == 195


@pytest.mark.parametrize(
    ("header", "range_m"),
    [
        ({"large": 0x80, "small": 780}, 195.0),
        ({"large": 29, "small": 512}, 64 * 29.0),
        ({"large": 25_465, "small": 512, "high": 0x9000}, 25_465.0),
        ({"large": 926, "small": 512, "high": 0x1000}, 926.0),
        ({"large": 926, "small": 256, "high": 0x1000}, 463.0),
    ],
)
def test_both_kinds_of_range_are_known(tmp_path: Path, header: dict[str, int], range_m: float) -> None:
    frames = [ethernet(part) for part in udp(navico(0, **header), 6678)]
    assert read(saved(tmp_path / "capture", pcap(frames))).step_m * 1024 == pytest.approx(range_m)


def test_a_radar_says_itself_which_model_it_is(tmp_path: Path) -> None:
    for model, range_m in ((0, 926.0), (1, 64 * 926.0)):
        report = bytes([3, 0xC4, model]) + b"\0" * 126
        frames = [ethernet(part) for part in udp(report, 6679) + udp(navico(0, large=926, small=512), 6678, 1)]
        assert read(saved(tmp_path / "capture", pcap(frames))).step_m * 1024 == pytest.approx(range_m)


def test_heading_and_place_are_those_between_the_sentences(tmp_path: Path) -> None:
    """The ship turns at 6 degrees a second through north; a sentence is cut in two, and comes again."""
    frames: list[tuple[float, bytes]] = []
    sequence = 2**32 - 20
    for k in range(64):
        now_s = 0.04 * k
        if k % 8 == 0:
            text = sentence(f"HEHDT,{(356 + 6 * now_s) % 360:.2f},T")
            text += sentence(f"GPGLL,{5300 + now_s:.4f},N,00{500 + now_s:.4f},E,,A,A")
            cut = 7 if k else len(text) - 3
            parts = ((text[:cut], sequence), (text[:cut], sequence), (text[cut:], sequence + cut))
            frames += [(NOON + now_s, ethernet(tcp(*part))) for part in parts]
            sequence += len(text)
        frames += [(NOON + now_s, ethernet(part)) for part in udp(navico(SPOKES * k), 6678, k)]
    found = read(saved(tmp_path / "capture", timed(frames)))
    assert found.from_north
    heading = np.degrees(found.heading_rad[64:1700])
    expected = (356 + 6 * (found.time_s[64:1700] - NOON)) % 360
    assert np.abs((heading - expected + 180) % 360 - 180).max() < 0.05
    np.testing.assert_allclose(found.lonlat_deg[64:1700, 0], 5 + (found.time_s[64:1700] - NOON) / 60, atol=2e-5)
    bow = (np.degrees(found.azimuth_rad[64:1700]) - heading) % 360
    off = (bow - np.arange(64, 1700) * 360 / 2048 + 180) % 360 - 180
    assert np.abs(off).max() < 1e-6


def test_a_heading_that_may_be_magnetic_is_none(tmp_path: Path) -> None:
    for heading, from_north in ((0x07D6, False), (0x47D6, True), (0x8000, False)):
        frames = [ethernet(part) for part in udp(navico(0, heading=heading), 6678)]
        found = read(saved(tmp_path / "capture", pcap(frames)))
        assert found.from_north == from_north
        if from_north:
            assert np.degrees(found.heading_rad[0]) == pytest.approx(0x7D6 * 360 / 4096)


def test_what_is_lost_and_damaged_is_said(tmp_path: Path) -> None:
    packets = [udp(navico(SPOKES * k), 6678, k) for k in range(10)]
    del packets[4]
    del packets[6][3]
    source = open_radar_video(
        saved(tmp_path / "capture", pcap([ethernet(part) for parts in packets for part in parts]))
    )
    assert len(join_spokes(list(source)).amplitude) == 8 * SPOKES
    assert source.remarks() == [
        "Spokes missing by their numbers: 64.",
        "Packets that came in part only, left out: 1.",
    ]


# ------------------------------------------------------------------------------------------------- other, spoilt files


@pytest.mark.parametrize(
    ("octets", "said"),
    [
        (b"", "is empty"),
        (b"\x00\x00\x00\x18ftypisom" + b"\0" * 99, "camera's MP4 video .*track images"),
        (b"$GPRMC,120000.00,A", "log of NMEA sentences"),
        (b"\x89PNG\r\n\x1a\n" + b"\0" * 99, "PNG image"),
        (b"time_s,range_m,bearing_deg\n1,2,3\n", "text .*track radar"),
        (b"CDF\x01" + b"\0" * 99, "netCDF 3, to be saved as netCDF 4"),
        (block(plot(), plot()), "1 blocks of plots .*track radar"),
        (b"0,1,2\n1,2,3\n" * 9, "is text"),
        (pcap([]), "holds no radar video"),
        (pcap([ethernet(p) for p in udp(block(plot()), 8600)]), "1 blocks of plots .*track radar"),
        (pcap([ethernet(tcp(sentence("HEHDT,90.0,T"), 0))]), "sentences 1"),
        (b"\xf0\x00\x05\x00\x00", "malformed 1"),
        (b"PK\x03\x04" + b"\0" * 99, "cannot be read"),
    ],
)
def test_a_file_of_another_kind_is_named(tmp_path: Path, octets: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        list(open_radar_video(saved(tmp_path / "file", octets)))


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="is a folder"):
        open_radar_video(tmp_path)
    with pytest.raises(DataError, match="no such file"):
        open_radar_video(tmp_path / "none")


def test_a_compressed_capture_that_ends_early_gives_what_it_has(tmp_path: Path) -> None:
    frames = [ethernet(part) for k in range(64) for part in udp(navico(SPOKES * k), 6678, k)]
    octets = gzip.compress(pcap(frames))
    source = open_radar_video(saved(tmp_path / "capture", octets[: len(octets) // 2]))
    assert 0 < sum(len(part.amplitude) for part in source) < 2048
    assert "The file ends early; what stands before was read." in source.remarks()


def whole_files(folder: Path) -> list[bytes]:
    """Return one file of each kind."""
    frames = [ethernet(part) for k in range(6) for part in udp(navico(SPOKES * k), 6678, k)]
    frames[10:10] = [ethernet(tcp(sentence("HEHDT,90.0,T") + sentence("GPGLL,5300.0,N,00500.0,E,,A,A"), 7))]
    files = [pcap(frames), pcapng(frames), gzip.compress(pcap(frames))]
    for bits, name, compress in ((8, "raw", True), (4, "raw", False), (16, "a.pcap", True), (1, "raw", False)):
        write_asterix_video(folder / name, [video(bits, 40, 50)], compress=compress)
        files.append((folder / name).read_bytes())
    for name in ("a.npz", "a.nc"):
        write_radar_video_arrays(folder / name, [video(8, 40, 50)])
        files.append((folder / name).read_bytes())
    return files


def spoil(octets: bytes, rng: np.random.Generator) -> bytes:
    """Return a file with some octets changed, a part taken out or doubled, or its end gone."""
    changed = bytearray(octets)
    for _ in range(rng.integers(1, 5)):
        at, size = int(rng.integers(len(changed))), int(rng.integers(1, 60))
        kind = rng.integers(5)
        if kind == 0:
            changed[at : at + size] = rng.integers(0, 256, size, dtype=np.uint8).tobytes()
        elif kind == 1:
            changed[at] = int(rng.choice([0, 1, 127, 128, 255]))
        elif kind == 2:
            del changed[at : at + size]
        elif kind == 3:
            changed[at:at] = changed[max(at - size, 0) : at]
        elif len(changed) > 100:
            del changed[max(at, 50) :]
    return bytes(changed)


def check_spoilt(folder: Path, seeds: range) -> None:
    files = whole_files(folder)
    for seed in seeds:
        rng = np.random.default_rng(seed)
        path = saved(folder / "spoilt", spoil(files[seed % len(files)], rng))
        try:
            for part in open_radar_video(path):
                check_spokes(part)
        except DataError as error:
            assert str(error).startswith(str(path))  # noqa: PT017
            assert str(error).endswith(".")  # noqa: PT017


def test_a_spoilt_file_ends_in_a_sentence_or_in_fewer_spokes(tmp_path: Path) -> None:
    check_spoilt(tmp_path, range(24))


@pytest.mark.validate
def test_two_thousand_spoilt_files_end_so(tmp_path: Path) -> None:
    check_spoilt(tmp_path, range(100, 2100))


# --------------------------------------------------------------------------------------------------------------- live


@pytest.mark.parametrize("host", ["127.0.0.1", "239.255.240.17"])
def test_what_is_sent_over_a_network_is_read_as_it_comes(host: str) -> None:
    port, written = free_port(), video(8, 300, 50)
    address = f"udp://{host}:{port}" + "?interface=127.0.0.1" * host.startswith("239")
    feed = Feed(idle_s=HUNG_S)
    addresses = f"{address},udp://127.0.0.1:{free_port()}"  # of a radar and, silent here, of instruments
    source = open_radar_video(addresses, radar="0/2", feed=feed)

    def send() -> None:
        while not source.counts["spokes of radar 0/1"] and not feed.over:  # until the other side listens
            send_asterix_video(address, [video(8, 2, 50)], speed=math.inf)
            time.sleep(0.01)
        send_asterix_video(address, [written], speed=2.0, radar=(0, 2))  # no faster than a busy reader's socket holds

    sender, parts = threading.Thread(target=send), []
    sender.start()
    for part in source:
        parts.append(part)
        if sum(len(part.amplitude) for part in parts) >= 256:
            feed.halt()
    sender.join()
    found = join_spokes(parts)
    assert len(found.amplitude) >= 256
    agree(found, written.select_spokes(slice(0, len(found.amplitude))))


@pytest.mark.parametrize("kind", ["capture", "video.npz"])
def test_a_recording_is_replayed_with_its_heading(tmp_path: Path, kind: str) -> None:
    """A capture's own packets and sentences, also those of TCP; arrays as category 240."""
    frames = [(NOON + 0.0, ethernet(tcp(sentence("HEHDT,183.8,T"), 0)))]
    for k in range(96):
        frames += [(NOON + 0.04 * k, ethernet(part)) for part in udp(navico(SPOKES * k), 6678, k)]
    path = saved(tmp_path / "capture", gzip.compress(timed(frames)))
    if kind == "video.npz":
        path = tmp_path / kind
        write_radar_video_arrays(path, open_radar_video(tmp_path / "capture"))
    port, stopped = free_port(), threading.Event()
    address, feed, parts = f"udp://127.0.0.1:{port}", Feed(idle_s=HUNG_S), list[Spokes]()

    def play() -> None:
        while not stopped.is_set():
            replay(path, address, 20.0, lambda said: None, stopped)

    player = threading.Thread(target=play)
    player.start()
    try:
        for part in open_radar_video(address, feed=feed):
            parts.append(part)
            if sum(len(part.time_s) for part in parts if part.from_north) >= 640:
                feed.halt()
    finally:
        stopped.set()
        player.join()
    known = [part for part in parts if part.from_north]
    assert np.degrees(known[-1].heading_rad) == pytest.approx(183.8, abs=0.01)
    assert known[-1].amplitude.shape[1] == 1024


def test_a_recording_is_sent_at_its_own_pace() -> None:
    port, waited = free_port(), []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", port))
        started_s = time.monotonic()
        send_asterix_video(f"udp://127.0.0.1:{port}", [video(8, 3, 50)], speed=1e-3, wait=waited.append)
        assert sum(waited) == pytest.approx(1e3 * (0 + 2.4 / 256 * (1 + 2 + 2)), rel=0.7)
        assert time.monotonic() - started_s < 60


def test_a_network_that_says_nothing_ends_when_it_is_idle() -> None:
    with pytest.raises(DataError, match="nothing came"):
        list(open_radar_video(f"udp://127.0.0.1:{free_port()},udp://127.0.0.1:{free_port()}", feed=Feed(idle_s=0.2)))
