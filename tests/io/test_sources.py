"""Sources over the network: what is sent arrives, and a source that goes is heard again when it is back."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import closing

import pytest

from elusive.errors import DataError
from elusive.io.bearings import open_bearings
from elusive.io.sources import Feed, address_of, lines_of, packets_of
from elusive.sensors.bearing_sets import SensorSites
from tests.brokers import broker, free_port
from tests.processes import HUNG_S


def waiting(happened):
    until = time.monotonic() + HUNG_S
    while not happened():
        assert time.monotonic() < until
        time.sleep(0.005)


def connected(port):
    until = time.monotonic() + HUNG_S
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            assert time.monotonic() < until
            time.sleep(0.01)


def serve_once(server, octets):
    connection = server.accept()[0]
    with closing(connection):
        connection.sendall(octets)


def test_lines_of_a_server_that_goes_and_comes_back_are_all_heard():
    port, said = free_port(), []
    feed = Feed(say=said.append)
    lines = lines_of(f"tcp://127.0.0.1:{port}", feed)

    def serve():
        for octets in (b"time_s,x\n1,2\n", b"time_s,x\n3,4\n5,"):  # the header comes again, a line is cut
            waiting(lambda: bool(said))
            with socket.create_server(("127.0.0.1", port)) as server:
                serve_once(server, octets)

    server = threading.Thread(target=serve)
    server.start()
    assert [next(lines)[1] for _ in range(3)] == ["time_s,x", "1,2", "3,4"]
    server.join()
    feed.halt()
    assert list(lines) == []
    assert feed.counts["reconnected"] == 2  # nobody served at first
    assert "is tried again until it is back" in said[0]
    assert "is back after" in said[1]


def test_who_connects_is_listened_to_and_a_line_without_end_is_left_out():
    port, feed = free_port(), Feed()
    lines = lines_of(f"tcp://:{port}?listen=1&columns=time_s,x", feed)

    def send():
        with connected(port) as connection:
            connection.sendall(b"1,2\n" + b"9" * (3 << 20) + b"\n3,4\n")

    sender = threading.Thread(target=send)
    sender.start()
    assert [next(lines)[1] for _ in range(3)] == ["time_s,x", "1,2", "3,4"]
    sender.join()
    feed.halt()
    lines.close()
    assert feed.counts["spoilt"] == 1


def test_a_file_that_grows_by_a_line_without_end_is_read_on_from_the_next(tmp_path):
    path, feed = tmp_path / "log.csv", Feed(idle_s=0.2)
    path.write_bytes(b"time_s,x\n1,2\n" + b"9" * (3 << 20) + b"\n3,4\n")
    assert [text for _, text in lines_of(str(path), feed)] == ["time_s,x", "1,2", "3,4"]
    assert feed.counts["spoilt"] == 1


@pytest.mark.parametrize(("host", "option"), [("127.0.0.1", ""), ("239.192.7.8", "?interface=127.0.0.1")])
def test_packets_come_whole_and_in_order(host, option):
    port, feed = free_port(socket.SOCK_DGRAM), Feed()
    packets = packets_of(f"udp://{host}:{port}{option}", feed)
    sent = [bytes([k]) * (k + 1) for k in range(200)]
    stop = threading.Event()

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
            while not stop.is_set():
                out.sendto(b"?", (host, port))
                time.sleep(0.01)
            for octets in sent:
                out.sendto(octets, (host, port))

    sender = threading.Thread(target=send)
    sender.start()
    try:
        assert next(packets).octets == b"?"
    finally:
        stop.set()
        sender.join()
    came = [packet.octets for packet in (next(packets) for _ in range(200)) if packet.octets != b"?"]
    while len(came) < len(sent):
        came.append(next(packets).octets)
    feed.halt()
    assert came == sent


SITES = SensorSites(("a", "b"), [[0, 0, 0], [10, 0, 0]], None)
BEARINGS = [
    {"time_s": k, "sensor": sensor, "azimuth_deg": azimuth}
    for k in range(4)
    for sensor, azimuth in (("a", 45), ("b", 315))
]


def test_bearings_of_a_broker_that_is_restarted_go_on():
    paho = pytest.importorskip("paho.mqtt.client", reason="needs elusive[live]")
    from paho.mqtt.enums import CallbackAPIVersion

    port, said = free_port(), []
    feed = Feed(say=said.append)
    source = iter(open_bearings(f"mqtt://127.0.0.1:{port}/site/+/bearings", SITES, feed=feed))
    came = []
    reader = threading.Thread(target=lambda: came.extend(source))

    def publish(records):
        waiting(lambda: feed.counts["connected"] > before)
        client = paho.Client(CallbackAPIVersion.VERSION2)
        client.connect("127.0.0.1", port)
        client.loop_start()
        for record in records:
            client.publish("site/roof/bearings", str(record).replace("'", '"'), qos=1).wait_for_publish(HUNG_S)
        client.disconnect()
        client.loop_stop()

    before = 0
    reader.start()
    with broker(port):
        publish([*BEARINGS[:4], BEARINGS[3], BEARINGS[0]])
        waiting(lambda: feed.counts["late"] == 1)
    before = feed.counts["connected"]
    waiting(lambda: any("gone" in sentence for sentence in said))
    with broker(port):
        publish(BEARINGS[4:])
        waiting(lambda: len(came) == 3)
        feed.halt()
        reader.join()
    assert [measurement.time_s for measurement in came] == [0, 1, 2, 3]
    assert [len(measurement.sensor) for measurement in came] == [2, 2, 2, 2]
    assert (feed.counts["repeated"], feed.counts["late"], feed.counts["reconnected"]) == (1, 1, 1)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("udp://127.0.0.1", "names no port; write udp://127.0.0.1:5000"),
        ("tcp://127.0.0.1:99999", "is no address"),
        ("tcp://127.0.0.1:5?lsten=1", "the option 'lsten' has no meaning; known are listen, columns"),
        ("mqtt://127.0.0.1", "names no topic"),
    ],
)
def test_an_address_without_meaning_is_refused(text, sentence):
    with pytest.raises(DataError, match=sentence):
        next(lines_of(text, Feed(idle_s=0.0)))


def test_a_password_is_kept_from_sight_and_the_host_is_loopback_where_none_is_given():
    address = address_of("mqtt://me:se%20cret@:1884/a/b", {"mqtt": ()})
    assert (address.host, address.user, address.password) == ("127.0.0.1", "me", "se cret")
    assert "cret" not in address.text
