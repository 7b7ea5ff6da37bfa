"""`elusive replay`: what is played arrives whole, at the pace that was asked for."""

from __future__ import annotations

import socket
import struct
import threading
import time

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError
from elusive.io.bearings import open_bearings
from elusive.io.replay import replay
from elusive.io.sensor_files import read_sensors
from elusive.io.sources import Feed
from tests.bearing_flight import STEPS, write_flight
from tests.brokers import free_port
from tests.processes import HUNG_S


def capture(packets):
    """A pcap of IPv4 packets with UDP payloads: (seconds, octets)."""
    octets = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 101)
    for time_s, payload in packets:
        udp = struct.pack(">HHHH", 5, 6, 8 + len(payload), 0) + payload
        whole = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 9, 17, 0, bytes(4), bytes(4)) + udp
        octets += struct.pack("<IIII", int(time_s), round(time_s % 1 * 1e6), len(whole), len(whole)) + whole
    return octets


def test_a_captures_packets_come_at_its_pace(tmp_path):
    sent = [(1000 + 0.5 * k, bytes([k]) * 9) for k in range(5)]
    (tmp_path / "x.pcap").write_bytes(capture(sent))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(HUNG_S)
        began_s = time.monotonic()
        to = f"udp://127.0.0.1:{ear.getsockname()[1]}"
        with pytest.raises(SystemExit) as ended:
            main(["replay", str(tmp_path / "x.pcap"), "--to", to, "--speed", "10"])
        assert not ended.value.code
        assert [ear.recv(99) for _ in sent] == [payload for _, payload in sent]
        assert time.monotonic() - began_s >= 0.2


@pytest.mark.parametrize("scheme", ["udp", "tcp"])
def test_a_table_that_is_played_is_read_as_the_file(tmp_path, scheme):
    flight = write_flight(tmp_path)
    sites, path = read_sensors(flight / "sensors.csv"), flight / "bearings.csv"
    port = free_port(socket.SOCK_DGRAM if scheme == "udp" else socket.SOCK_STREAM)
    feed, heard, enough = Feed(), [], threading.Event()
    source = open_bearings(f"{scheme}://127.0.0.1:{port}", sites, feed=feed)

    def listen():
        for measurement in source:
            heard.append(measurement)
            if len(heard) == STEPS - 1:  # the last is whole when a later one comes
                enough.set()

    listener = threading.Thread(target=listen)
    listener.start()
    try:
        if scheme == "udp":
            time.sleep(0.2)
            while not enough.is_set():  # played again, what was heard is late
                replay(path, f"udp://127.0.0.1:{port}", 1000.0, print)
        else:
            replay(path, f"tcp://127.0.0.1:{port}?listen=1", 1000.0, print)
            assert enough.wait(60.0)
    finally:
        feed.halt()
        listener.join()
    whole = list(open_bearings(path, sites))
    for found, measurement in zip(heard[: STEPS - 1], whole, strict=False):
        assert found.time_s == measurement.time_s
        np.testing.assert_array_equal(found.azimuth_rad, measurement.azimuth_rad)


def test_a_listener_that_goes_is_said_to_have_gone(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time_s,x\n" + "".join(f"{0.01 * k:.2f},1\n" for k in range(3000)))
    with socket.create_server(("127.0.0.1", 0)) as server:
        going = threading.Thread(target=lambda: server.accept()[0].close())
        going.start()
        with pytest.raises(DataError, match="who listened has gone"):
            replay(path, f"tcp://127.0.0.1:{server.getsockname()[1]}", 1.0, print)
        going.join()


@pytest.mark.parametrize(
    ("text", "to", "sentence"),
    [
        ("x,y\n1,2\n", "udp://127.0.0.1:5", "names no column time_s"),
        ("time_s,x\n1\n", "udp://127.0.0.1:5", "line 2: does not fit its header"),
        ("time_s,x\n1,2\n", "mqtt://127.0.0.1", "names no topic"),
        ("time_s,x\n1,2\n", "http://127.0.0.1", "http:// has no meaning here"),
    ],
)
def test_what_cannot_be_played_is_said(tmp_path, text, to, sentence):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(DataError, match=sentence):
        replay(tmp_path / "a.csv", to, 1.0, print)
