"""What sinks write is read back by readers that others wrote, and one that is gone for a while catches up."""

from __future__ import annotations

import contextlib
import csv
import errno
import json
import math
import os
import socket
import struct
import sys
import threading
import time
from collections import Counter
from contextlib import closing

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.geometry.local_frame import LocalFrame
from elusive.io.sinks import Ground, open_sinks, presence
from elusive.io.sinks import outlet as outlets
from elusive.io.sinks.outlet import HELD, file_outlet, tcp_outlet
from elusive.io.sources import address_of
from elusive.io.sources.feed import FIRST_S
from tests.brokers import broker, free_port
from tests.processes import HUNG_S

FRAME = LocalFrame.at(5.428, 53.18)
UNIX_S = 1.75e9


def record(number, tracks, **more):
    return {"time_s": float(number), "unix_s": UNIX_S + number, "tracks": [*tracks], **more}


def track(number, x, y, vx=0.0, vy=0.0, status="confirmed", existence=0.97, sd=3.0, u="m"):
    places = {f"x_{u}": x, f"y_{u}": y, f"vx_{u}ps": vx, f"vy_{u}ps": vy, f"sd_x_{u}": sd, f"sd_y_{u}": sd / 2}
    return {"track": number, "status": status, "existence": existence, **places}


STEPS = [
    record(0, [track(7, 1200.0, -3400.5, 3.0, -4.0), track(8, 10.0, 20.0, status="candidate")]),
    record(2, [track(7, 1206.0, -3408.5, 3.0, -4.0)]),
    record(4, [track(7, 1212.0, -3416.5, status="deleted")]),
]


def opened(*names, unit="m", ground=None, system="radar", said=None):
    ground = Ground(FRAME) if ground is None and unit == "m" else ground
    return open_sinks(names, system=system, unit=unit, ground=ground, say=(said if said is not None else []).append)


def waiting(happened):
    until = time.monotonic() + HUNG_S
    while not happened():
        assert time.monotonic() < until
        time.sleep(0.005)


def told(sinks, steps=STEPS):
    for step in steps:
        sinks.tell(step)
    sinks.close()


def lonlat(x, y):
    return FRAME.to_lonlat(np.array([[x, y]]))[0]


@pytest.fixture
def ear():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        one.settimeout(HUNG_S)
        yield one


def heard(ear, count):
    return [ear.recv(65535) for _ in range(count)]


def test_lines_of_json_and_geojson_carry_all_and_tell_who_has_ended(tmp_path):
    sinks = opened(f"ndjson:{tmp_path / 'a'}", f"geojson:{tmp_path / 'b'}")
    told(sinks)
    plain = [json.loads(line) for line in (tmp_path / "a").read_text().splitlines()]
    assert [line["ended"] for line in plain] == [[], [8], [7]]
    assert plain[1]["tracks"][0] == {**STEPS[1]["tracks"][0], "age_s": 2.0}
    first, second, third = (json.loads(line) for line in (tmp_path / "b").read_text().splitlines())
    feature = next(feature for feature in first["features"] if feature["id"] == 7)
    np.testing.assert_allclose(feature["geometry"]["coordinates"], lonlat(1200.0, -3400.5), atol=1e-8)
    assert feature["properties"]["existence"] == 0.97
    assert feature["properties"]["course_deg"] == pytest.approx(math.degrees(math.atan2(3, -4)))
    ends = [(each["id"], each["properties"]["status"]) for each in (*second["features"], *third["features"])]
    assert ends == [(7, "confirmed"), (8, "deleted"), (7, "deleted")]


def test_nmea_is_read_back_by_another_reader(ear):
    pynmea2 = pytest.importorskip("pynmea2", reason="needs elusive[test]")
    told(opened(f"nmea+udp://127.0.0.1:{ear.getsockname()[1]}"))
    sentences = [octets.decode("ascii") for octets in heard(ear, 6)]
    assert max(map(len, sentences)) <= 82
    ttm, tll = ([pynmea2.parse(text, check=True) for text in sentences[k::2]] for k in (0, 1))
    for message, step in zip(ttm, STEPS, strict=True):
        x, y = step["tracks"][0]["x_m"], step["tracks"][0]["y_m"]
        assert float(message.data[1]) * 1852 == pytest.approx(math.hypot(x, y), abs=0.0005 * 1852)
        assert float(message.data[2]) == pytest.approx(math.degrees(math.atan2(x, y)) % 360, abs=0.005)
    assert float(ttm[0].data[4]) * 1852 / 3600 == pytest.approx(5.0, abs=0.005)
    assert float(ttm[0].data[5]) == pytest.approx(math.degrees(math.atan2(3, -4)), abs=0.05)
    assert [(message.data[0], message.data[10], message.data[11]) for message in ttm] == [
        ("00", "E7", "T"), ("00", "E7", "T"), ("00", "E7", "L")
    ]  # fmt: skip
    for message, step in zip(tll, STEPS, strict=True):
        lon, lat = lonlat(step["tracks"][0]["x_m"], step["tracks"][0]["y_m"])
        read = [float(message.data[k][:n]) + float(message.data[k][n:]) / 60 for k, n in ((1, 2), (3, 3))]
        np.testing.assert_allclose(read, [lat, lon], atol=0.5e-4 / 60 + 1e-9)
        assert (message.data[2], message.data[4]) == ("N", "E")
    assert [message.data[7] for message in tll] == ["T", "T", "L"]


def test_an_nmea_number_is_a_tracks_own_until_it_has_ended(ear):
    said, many = [], [track(number, number, 0) for number in range(1, 103)]
    sinks = opened(f"nmea+udp://127.0.0.1:{ear.getsockname()[1]}", said=said)
    sinks.tell(record(0, many))
    first = [octets.decode().split(",") for octets in heard(ear, 200)][::2]
    assert len({cells[1] for cells in first}) == 100
    assert "NMEA has 100 numbers" in said[0]
    sinks.tell(record(1, many[1:]))
    names = {cells[11]: cells[1] for cells in first}
    for octets in heard(ear, 202)[::2]:
        cells = octets.decode().split(",")
        assert names.setdefault(cells[11], names["E1"]) == cells[1]
    sinks.close()


@pytest.mark.parametrize("carrier", ["udp", "tcp"])
def test_cursor_on_target_is_read_back_by_another_reader(ear, carrier):
    cotdantic = pytest.importorskip("cotdantic", reason="a reader for the tests")
    if carrier == "udp":
        told(opened(f"cot+udp://127.0.0.1:{ear.getsockname()[1]}?uid=harbour"))
        events = heard(ear, 4)
    else:
        with socket.create_server(("127.0.0.1", 0)) as server:
            sinks = opened(f"cot+tcp://127.0.0.1:{server.getsockname()[1]}?uid=harbour")
            connection = server.accept()[0]
            told(sinks)
            with closing(connection):
                events = connection.makefile("rb").readlines()
    events = [cotdantic.Event.from_xml(octets.strip()) for octets in events]
    assert [event.uid for event in events] == ["harbour.7", "harbour.7", "harbour.8", "harbour.7"]
    for event, step in zip((events[0], events[1], events[3]), STEPS, strict=True):
        at = lonlat(step["tracks"][0]["x_m"], step["tracks"][0]["y_m"])
        np.testing.assert_allclose([event.point.lon, event.point.lat], at, atol=0.5e-7 + 1e-12)
        assert event.point.ce == pytest.approx(6.0)
    assert events[0].type == "a-u-S"
    assert events[0].detail.track.speed == pytest.approx(5.0, abs=5e-4)
    assert events[0].detail.contact.callsign == "harbour 7"
    assert "existence 0.9700, age 0.0 s" in events[0].to_xml().decode()
    assert [event.stale > event.time for event in events] == [True, True, False, False]


def test_mqtt_tells_home_automation_who_is_there_and_that_nobody_is_any_more():
    paho = pytest.importorskip("paho.mqtt.client", reason="needs elusive[live]")
    from paho.mqtt.enums import CallbackAPIVersion

    port, came = free_port(), []
    with broker(port):
        client = paho.Client(CallbackAPIVersion.VERSION2)
        client.on_message = lambda _, __, message: came.append((message.topic, message.payload.decode()))
        client.on_connect = lambda *_: client.subscribe("#", qos=1)
        client.connect("127.0.0.1", port)
        client.loop_start()
        waiting(client.is_connected)
        sinks = opened(f"mqtt://127.0.0.1:{port}/home/hall", unit="m", system="links")
        waiting(lambda: "home/hall/status" in dict(came))
        for step in STEPS:
            sinks.tell(step)
        waiting(lambda: ("home/hall/count", "0") in came)
        sinks.close()
        waiting(lambda: ("home/hall/status", "offline") in came)
        client.disconnect()
        client.loop_stop()
    configs = {topic: json.loads(text) for topic, text in came if topic.startswith("homeassistant/")}
    counted = configs["homeassistant/sensor/elusive_home_hall_count/config"]
    assert counted["state_topic"] == "home/hall/count"
    assert configs["homeassistant/binary_sensor/elusive_home_hall_presence/config"]["device_class"] == "occupancy"
    assert [text for topic, text in came if topic == "home/hall/presence"] == ["ON", "OFF"]
    where = [json.loads(text) for topic, text in came if topic == "home/hall/track/7" and text]
    assert (where[0]["x_m"], where[0]["y_m"], where[0]["existence"]) == (1200.0, -3400.5, 0.97)
    np.testing.assert_allclose([where[0]["longitude"], where[0]["latitude"]], lonlat(1200.0, -3400.5), atol=1e-7)
    assert where[-1] == {"track": 7, "present": False}
    assert ("home/hall/track/7", "") in came  # the topic is cleared


class Broker:
    """Keeps what is published before it says so; may fall silent, as one whose machine has lost its network."""

    def __init__(self):
        self.came, self.silent = [], threading.Event()
        self.start(0)

    def start(self, port):
        self.server, self.connection = socket.create_server(("127.0.0.1", port)), None
        self.port = self.server.getsockname()[1]
        threading.Thread(target=self.serve, args=(self.server,), daemon=True).start()

    def kill(self):
        for each in filter(None, (self.server, self.connection)):
            with contextlib.suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def serve(self, server):
        with contextlib.suppress(OSError):
            connection = self.connection = server.accept()[0]
            with connection.makefile("rb") as file:
                while head := file.read(1):
                    size = shift = 0
                    while (octet := file.read(1)[0]) & 128:
                        size, shift = size | (octet & 127) << shift, shift + 7
                    body = file.read(size | octet << shift)
                    if not self.silent.is_set():
                        self.answer(connection, head[0] >> 4, body)

    def answer(self, connection, kind, body):
        if kind == 1:
            connection.sendall(b"\x20\x02\x00\x00")
        elif kind == 3:
            topic, rest = body[2 : 2 + body[1]].decode(), body[2 + body[1] :]
            self.came.append((topic.removeprefix("hall/"), rest[2:].decode()))
            connection.sendall(b"\x40\x02" + rest[:2])

    def topic(self, name):
        return [text for topic, text in self.came if topic == name]


@pytest.fixture
def keeping():
    pytest.importorskip("paho.mqtt.client", reason="needs elusive[live]")
    one = Broker()
    yield one
    one.kill()


def test_a_broker_that_falls_silent_and_dies_gets_every_step_once_it_is_back(keeping):
    sinks = opened(f"mqtt://127.0.0.1:{keeping.port}/hall")
    waiting(lambda: keeping.topic("status"))
    counts = sinks.each[0].counts
    for k in range(300):
        if k == 100:
            waiting(lambda: counts["sent"] >= counts["published"])
            keeping.silent.set()  # the loss is not noticed yet
        if k == 130:
            keeping.kill()
        sinks.tell(record(k, [track(1, k, 0)]))
    keeping.silent.clear()
    keeping.start(keeping.port)
    waiting(lambda: len(keeping.topic("tracks")) >= 300)
    assert [json.loads(text)["unix_s"] - UNIX_S for text in keeping.topic("tracks")] == list(range(300))
    assert keeping.topic("presence")[-1] == "ON"  # told again: a new broker knows nothing
    assert len(keeping.topic("presence")) == 2
    sinks.close()
    assert keeping.topic("status")[-1] == "offline"


def test_a_broker_that_was_never_there_is_said():
    pytest.importorskip("paho.mqtt.client", reason="needs elusive[live]")
    said = []
    sinks = opened(f"mqtt://127.0.0.1:{free_port()}/hall", said=said)
    sinks.tell(STEPS[0])
    waiting(lambda: said)
    sinks.close()
    assert "no broker answers there" in said[0]
    assert "messages could not be sent any more" in said[1]


def test_what_stands_at_a_broker_is_mended_where_too_much_waited(keeping, monkeypatch):
    monkeypatch.setattr(presence, "HELD", 12)
    keeping.silent.set()
    sinks = opened(f"mqtt://127.0.0.1:{keeping.port}/hall")
    for step in (record(0, [track(1, 0, 0)]), *(record(k, [track(1, k, 0)]) for k in range(1, 20)), record(20, [])):
        sinks.tell(step)
    waiting(lambda: keeping.connection)
    keeping.kill()
    keeping.silent.clear()
    keeping.start(keeping.port)
    waiting(lambda: sinks.each[0].counts["sent"] >= 12)
    assert keeping.topic("track/1")[-1]  # that it has ended was lost
    sinks.tell(record(21, []))
    waiting(lambda: keeping.topic("track/1")[-1] == "")
    sinks.close()
    assert (keeping.topic("count")[-1], keeping.topic("presence")[-1]) == ("0", "OFF")


def test_mot_lines_are_those_of_the_format(tmp_path):
    path = tmp_path / "mot.txt"
    steps = [record(k, [track(3, 9.0 + k, 4.0, u="px")]) for k in range(3)]
    told(opened(f"mot:{path}", unit="px", system="images"), steps)
    rows = np.array([[float(cell) for cell in line] for line in csv.reader(path.read_text().splitlines())])
    np.testing.assert_allclose(rows[:, :2], [[1, 3], [2, 3], [3, 3]])
    np.testing.assert_allclose(rows[:, 2:4] + rows[:, 4:6] / 2 - 1, [[9, 4], [10, 4], [11, 4]])
    np.testing.assert_allclose(rows[:, 6], 0.97)


def test_the_axes_of_a_site_may_be_turned(tmp_path):
    path = tmp_path / "a"
    told(opened(f"geojson:{path}", ground=Ground(FRAME, math.radians(90.0))), [record(0, [track(1, 0.0, 50.0)])])
    at = json.loads(path.read_text().splitlines()[0])["features"][0]["geometry"]["coordinates"]
    np.testing.assert_allclose(FRAME.to_local(np.array([at]))[0], [50.0, 0.0], atol=1e-3)  # y points east


def test_a_listener_that_is_gone_for_a_while_gets_what_was_held():
    said, port = [], free_port()
    sinks = opened(f"ndjson+tcp://127.0.0.1:{port}", said=said)
    steps = [record(k, [track(1, k, 0)]) for k in range(50)]
    for step in steps[:20]:
        sinks.tell(step)
    waiting(lambda: said)
    lines = []

    def listen(server, count):
        connection = server.accept()[0]
        with closing(connection), connection.makefile("r") as file:
            lines.extend(json.loads(next(file))["time_s"] for _ in range(count))

    for count, more in ((20, ()), (30, steps[20:])):
        with socket.create_server(("127.0.0.1", port)) as server:
            listener = threading.Thread(target=listen, args=(server, count))
            listener.start()
            if count == 20:
                listener.join()
                continue
            for step in more:
                sinks.tell(step)
            listener.join()
    sinks.close()
    assert lines == list(range(50))
    assert "is tried again" in said[0]
    assert any("is back after" in sentence for sentence in said)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell what has been received")
def test_what_the_other_machine_has_not_received_is_sent_again():
    port, size, said = free_port(), 1000, []
    with socket.create_server(("127.0.0.1", port)) as server:
        outlet = tcp_outlet(address_of(f"ndjson+tcp://127.0.0.1:{port}", {"ndjson+tcp": ()}), said.append)
        first = server.accept()[0]
        for k in range(HELD // 2):
            outlet.send(b"%0*d\n" % (size - 1, k))
        had = -1
        while had != (had := _waits(first)) or not outlet.counts["sent"]:  # until its machine takes no more
            time.sleep(0.3)
        first.close()
    assert outlet.counts["sent"] * size > had  # more was handed over than received
    with socket.create_server(("127.0.0.1", port)) as server:
        second = server.accept()[0]
        with closing(second), second.makefile("r") as file:
            numbers = [int(next(file))]
            numbers.extend(int(next(file)) for _ in range(HELD // 2 - 1 - numbers[0]))
        outlet.close()
    assert numbers == list(range(numbers[0], HELD // 2))
    assert numbers[0] * size <= had
    assert said


def _waits(connection):
    """Octets that a machine has received and nobody has read."""
    import fcntl
    import termios

    return struct.unpack("i", fcntl.ioctl(connection, termios.FIONREAD, bytes(4)))[0]


def test_a_full_disk_is_waited_for_and_no_line_is_cut(tmp_path, monkeypatch):
    path, said, full, write = tmp_path / "a", [], threading.Event(), os.write

    def filling(descriptor, octets):
        if full.is_set():
            if len(octets) > 3:
                return write(descriptor, octets[:3])
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, octets)

    monkeypatch.setattr(os, "write", filling)
    outlet = file_outlet(str(path), said.append)
    outlet.send(b"first\n")
    waiting(lambda: outlet.counts["sent"] == 1)
    full.set()
    outlet.send(b"second\n")
    outlet.send(b"third\n")
    waiting(lambda: said)
    time.sleep(3.5 * FIRST_S)  # tried again meanwhile
    full.clear()
    outlet.close()
    assert len(said) == 2  # that it is gone, and back: not at each try
    assert "is back after" in said[1]
    assert path.read_text() == "first\nsecond\nthird\n"
    assert "No space left on device" in said[0]


@pytest.mark.thorough
def test_broker_listener_and_disk_are_gone_for_half_a_minute(tmp_path, monkeypatch, keeping):
    (path, said, lines, heard), port = (tmp_path / "a", [], [], []), free_port()
    gone, write, steps = threading.Event(), os.write, [record(k, [track(1, k, 0)]) for k in range(400)]

    def failing(descriptor, octets):
        if gone.is_set() and octets.startswith(b"{"):
            raise OSError(errno.EIO, "Input/output error")
        return write(descriptor, octets)

    def listen(server):
        heard.append(server.accept()[0])
        with closing(heard[-1]), heard[-1].makefile("r") as file, contextlib.suppress(OSError):
            lines.extend(line for line in file if line.endswith("\n"))

    monkeypatch.setattr(os, "write", failing)
    names = (f"mqtt://127.0.0.1:{keeping.port}/hall", f"ndjson+tcp://127.0.0.1:{port}", f"ndjson:{path}")
    server = socket.create_server(("127.0.0.1", port))
    threading.Thread(target=listen, args=(server,)).start()
    sinks, took_s = opened(*names, said=said), []
    for k, step in enumerate(steps):  # ten a second
        if k == 50:
            waiting(lambda: len(lines) >= 50 and len(keeping.topic("tracks")) >= 50)
            gone.set()
            keeping.kill()
            server.close()
            heard[0].shutdown(socket.SHUT_RDWR)
        if k == 350:
            gone.clear()
            keeping.start(keeping.port)
            server = socket.create_server(("127.0.0.1", port))
            threading.Thread(target=listen, args=(server,)).start()
        began_s = time.monotonic()
        sinks.tell(step)
        took_s.append(time.monotonic() - began_s)
        time.sleep(0.1)
    back_s = time.monotonic()
    waiting(lambda: len(keeping.topic("tracks")) >= len(steps))
    waiting(lambda: len(lines) >= len(steps))
    back_s = time.monotonic() - back_s
    sinks.close()
    server.close()
    times = [step["time_s"] for step in steps]
    assert [json.loads(line).get("time_s") for line in path.read_text().splitlines()][: len(times)] == times
    assert [json.loads(text)["unix_s"] - UNIX_S for text in keeping.topic("tracks")][: len(times)] == times
    assert {json.loads(line).get("time_s") for line in lines} >= set(times)
    assert len(said) == 6, said  # each once: that it is gone, and that it is back
    print(f"the slowest step took {max(took_s) * 1e3:.0f} ms, the last came {back_s:.1f} s late; {len(said)} sentences")


@pytest.mark.skipif(os.name == "nt", reason="Windows moves no open file")
def test_a_file_that_was_moved_away_is_begun_anew(tmp_path):
    path, said = tmp_path / "told.ndjson", []
    outlet = file_outlet(str(path), said.append)
    for number, moved in enumerate(("told.1", "told.2", None)):
        outlet.send(b"%d\n" % number)
        waiting(lambda number=number: path.exists() and path.read_bytes() == b"%d\n" % number)
        if moved is not None:
            path.rename(tmp_path / moved)
    outlet.close()
    assert (tmp_path / "told.1").read_bytes() == b"0\n"
    assert not said


def test_a_time_that_is_no_year_is_told_by_this_machines(ear):
    name = f"cot+udp://127.0.0.1:{ear.getsockname()[1]}"
    for time_s in (1.75e12, 9e99):  # milliseconds since 1970; nonsense
        told(opened(name), [record(0, [track(7, 1.0, 2.0)]) | {"time_s": time_s}])
        assert b'time="2025-06-15' in heard(ear, 1)[0]
        heard(ear, 1)  # that it has ended


def test_what_is_held_is_bounded():
    sinks = opened(f"ndjson+tcp://127.0.0.1:{free_port()}")
    for k in range(HELD + 10):
        sinks.tell({"time_s": k, "unix_s": UNIX_S, "tracks": []})
    assert sinks.each[0].counts == Counter(dropped=10)
    sinks.each[0].outlet._held.clear()
    sinks.close()


@pytest.mark.parametrize(
    ("name", "unit", "sentence"),
    [
        ("tracks.csv", "m", "is no sink; write ndjson:FILE"),
        ("geojson:x", "px", "needs places on the ground, and these tracks are in px"),
        ("cot+udp://127.0.0.1:1", None, "give --origin LON LAT"),
        ("mot:x", "m", "MOTChallenge needs pixels"),
        ("nmea:", "m", "names no file"),
        ("ndjson:/nowhere/x", "m", "cannot be written"),
        ("mqtt://127.0.0.1", "m", "names no topic to write under"),
        ("cot+udp://no.host.invalid:1", "m", "has no address"),
        ("cot+udp://127.0.0.1:1?color=red", "m", "the option 'color' has no meaning"),
        ("cot+udp://127.0.0.1:1?stale_s=soon", "m", "stale_s=soon is no time; give seconds"),
        ("cot+udp://127.0.0.1:1?stale_s=nan", "m", "stale_s=nan is no time"),
        ("cot+udp://127.0.0.1:1?stale_s=1e99", "m", "stale_s=1e99 is no time"),
        ("nmea+udp://239.1.1.1:1?interface=eth0", "m", "interface=eth0 is no IPv4 address"),
        ("cot+tcp://.harbour:1", "m", "a part of the host's name is empty or too long"),
        ("mqtt://127.0.0.1/$SYS/hall", "m", "names no topic to write under"),
        ("mqtt://127.0.0.1/" + 70 * "0123456789abcdef", "m", "names no topic to write under"),
        ("ndjson:.", "m", "cannot be written"),
        ("kafka://127.0.0.1:9092/x", "m", "is no sink"),
    ],
)
def test_a_sink_without_meaning_is_refused(name, unit, sentence):
    with pytest.raises(DataError, match=sentence):
        open_sinks([name], system="radar", unit=unit or "m", ground=Ground(FRAME) if unit else None, say=print)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("ndjson:{}/a", "ndjson:{}/a"),
        ("ndjson:{}/a", "geojson:{}/../{}/a"),
        ("ndjson:-", "geojson:-"),
        ("nmea+udp://127.0.0.1:10110", "nmea+udp://127.0.0.1:10110?broadcast"),
    ],
)
def test_two_sinks_do_not_share_a_place(one, other, tmp_path):
    names = [one.format(tmp_path), other.format(tmp_path, tmp_path.name)]
    with pytest.raises(DataError, match="each needs a place of its own"):
        opened(*names)
    assert not list(tmp_path.iterdir())


def test_two_udp_sinks_are_both_told():
    with contextlib.ExitStack() as stack:
        ears = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for ear in ears:
            ear.bind(("127.0.0.1", 0))
            ear.settimeout(HUNG_S)
        told(opened(*(f"nmea+udp://127.0.0.1:{ear.getsockname()[1]}" for ear in ears)))
        first, second = (heard(ear, 6) for ear in ears)
    assert first == second


class NoNetwork:
    """A socket of a machine whose network is gone."""

    def sendto(self, message, where):
        raise OSError(errno.ENETUNREACH, "Network is unreachable")


def test_packets_are_lost_while_nobody_hears_them_or_the_network_is_gone(ear):
    port, said = ear.getsockname()[1], []
    sinks = opened(f"ndjson+udp://127.0.0.1:{port}", said=said)
    (sink,) = sinks.each
    sinks.tell(record(0, [track(1, 0.0, 0.0)]))
    assert json.loads(ear.recv(65535))["time_s"] == 0
    ear.close()
    sinks.tell(record(1, [track(1, 1.0, 0.0)]))  # nobody knows that it was for nobody
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
        again.bind(("127.0.0.1", port))
        again.settimeout(HUNG_S)
        sinks.tell(record(2, [track(1, 2.0, 0.0)]))
        there, sink.outlet._socket = sink.outlet._socket, NoNetwork()
        for k in (3, 4):
            sinks.tell(record(k, [track(1, float(k), 0.0)]))
        sink.outlet._socket = there
        sinks.tell(record(5, [track(1, 5.0, 0.0)]))
        sinks.close()
        lines = [json.loads(line) for line in heard(again, 3)]
    assert [line.get("time_s") for line in lines] == [2, 5, None]
    assert lines[-1]["ended"] == [1]
    assert lines[1]["tracks"][0]["age_s"] == 5.0
    assert len(said) == 2
    assert "packets are lost (Network is unreachable)" in said[0]
    assert "is back; 2 packets were lost" in said[1]


def test_nothing_is_added_to_a_file_of_something_else(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time_s,sensor,azimuth_deg\n")
    for form in ("ndjson", "geojson", "nmea", "cot"):
        with pytest.raises(DataError, match="holds something else"):
            opened(f"{form}:{path}")
    assert path.read_text() == "time_s,sensor,azimuth_deg\n"
    for form in ("ndjson", "geojson", "nmea", "cot"):  # and what was begun in the same format is gone on with
        own = tmp_path / form
        told(opened(f"{form}:{own}"))
        once = own.read_bytes()
        told(opened(f"{form}:{own}"))
        assert own.read_bytes() == 2 * once


@pytest.mark.skipif(os.name == "nt", reason="Windows has no named pipes in folders")
def test_a_pipe_without_a_reader_keeps_nobody_waiting_and_loses_nothing(tmp_path):
    path, said = tmp_path / "pipe", []
    os.mkfifo(path)
    sinks = opened(f"ndjson:{path}", said=said)
    for step in STEPS:
        sinks.tell(step)
    assert "is a pipe" in said[0]
    with path.open() as file:
        assert [json.loads(next(file))["time_s"] for _ in STEPS] == [0.0, 2.0, 4.0]
        sinks.close()


def test_a_listener_that_does_not_read_keeps_no_one_waiting_and_what_is_lost_is_said(monkeypatch):
    monkeypatch.setattr(outlets, "HELD_OCTETS", 200_000)
    said, message = [], b"%06d" + 9993 * b"x" + b"\n"
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"ndjson+tcp://127.0.0.1:{server.getsockname()[1]}"
        one = tcp_outlet(address_of(address, {"ndjson+tcp": ()}), said.append)
        connection = server.accept()[0]
        count = 0
        while not one.counts["dropped"]:  # never waits, whatever its machine takes
            one.send(message % count)
            count += 1
        assert one._octets <= 200_000
        assert len(one._held) <= 20
        with closing(connection), connection.makefile("rb") as file:  # it reads again
            numbers = [int(next(file)[:6])]
            while numbers[-1] < count - 1:
                numbers.append(int(next(file)[:6]))
            one.close()
    assert numbers == sorted(set(numbers))
    assert count - len(numbers) == one.counts["dropped"]
    assert "the oldest are lost" in said[0]
    assert f"{one.counts['dropped']} messages were lost" in said[1]
    assert len(said) == 2


def test_a_broker_that_refuses_is_said_once(keeping, monkeypatch):
    said, tries, answer = [], [], keeping.answer
    code, taken = [b"\x05"], threading.Event()  # not authorized

    def answering(connection, kind, body):
        if kind == 1 and code[0] != b"\0":
            tries.append(kind)
            connection.sendall(b"\x20\x02\x00" + code[0])
            connection.close()
        else:
            answer(connection, kind, body)

    def serve(server):
        with contextlib.suppress(OSError):
            while not taken.is_set():
                Broker.serve(keeping, server)

    monkeypatch.setattr(keeping, "answer", answering)
    keeping.kill()
    monkeypatch.setattr(keeping, "serve", serve)
    keeping.start(0)
    sinks = opened(f"mqtt://eve:wrong@127.0.0.1:{keeping.port}/hall", said=said)
    sinks.each[0]._client.reconnect_delay_set(1, 1)
    sinks.tell(STEPS[0])
    waiting(lambda: len(tries) >= 3)
    assert len(said) == 1, said
    assert "the broker refuses (Not authorized)" in said[0]
    assert "wrong" not in said[0]
    code[0] = b"\0"
    waiting(lambda: keeping.topic("presence"))
    taken.set()
    sinks.close()
    assert len(said) == 2, said
    assert "is back" in said[1]


def test_what_waits_for_a_broker_is_bounded_by_octets_too(monkeypatch):
    pytest.importorskip("paho.mqtt.client", reason="needs elusive[live]")
    monkeypatch.setattr(presence, "HELD_OCTETS", 5000)
    monkeypatch.setattr(presence, "CLOSING_S", 0.0)
    said = []
    sinks = opened(f"mqtt://127.0.0.1:{free_port()}/hall", said=said)
    for k in range(50):
        sinks.tell(record(k, [track(1, k, 0)]))
    one = sinks.each[0]
    assert one._octets <= 5000
    assert one.counts["published"] == one.counts["dropped"] + len(one._waits)
    assert sum("newer ones are lost" in sentence for sentence in said) == 1
    sinks.close()
