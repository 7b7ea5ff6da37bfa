"""Frames as they come: growing folders, pipes, streams; whole ones alone, in order, what is lost said so."""

import io
import os
import re
import socket
import socketserver
import subprocess
import sys
import threading
import time
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image

from elusive.errors import DataError
from elusive.io import _growing, open_frames
from elusive.io.live_frames import is_live, open_live_frames

HUNG_S = 30.0
ROWS, COLUMNS = 20, 24
MOVIE = np.random.default_rng(1).integers(0, 255, (12, ROWS, COLUMNS), dtype=np.uint8)


def save(path: Path, pixels: np.ndarray) -> None:
    """Write an image whole: beside, then renamed."""
    beside = path.with_name(f".{path.name}")
    if path.suffix == ".tif":
        tifffile.imwrite(beside, pixels)
    else:
        Image.fromarray(pixels).save(beside, format={"jpg": "JPEG", "pgm": "PPM"}.get(path.suffix[1:], path.suffix[1:]))
    os.replace(beside, path)


def taken(frames, count):
    """The next frames; what never comes ends in a failure."""
    came = list(islice(frames, count))
    frames.stop()
    assert list(frames._coming) == []
    return came


def written(folder: Path, names: list[str], wait_s: float = 0.0, first: int = 0) -> threading.Thread:
    """Write the movie under these names from another thread, from a frame on."""

    def write() -> None:
        for name, pixels in zip(names[first:], MOVIE[first:], strict=False):
            time.sleep(wait_s)
            save(folder / name, pixels)

    thread = threading.Thread(target=write)
    thread.start()
    return thread


@pytest.mark.parametrize("form", ["f{}.png", "f{:04d}.tif", "f_{}0.bmp", "run2_{:03d}_ir.pgm"])
def test_a_folder_that_grows_gives_every_frame_in_natural_order(tmp_path, form):
    names = [form.format(k) for k in range(len(MOVIE))]
    for name, pixels in zip(names[:3], MOVIE, strict=False):
        save(tmp_path / name, pixels)
    frames = open_live_frames(tmp_path, idle_s=HUNG_S)
    assert frames.shape == (ROWS, COLUMNS)
    assert (frames.timed, frames.interval_s) == (False, 1.0)
    writer = written(tmp_path, names, wait_s=0.005, first=3)  # what is written again is a frame of its own
    came = taken(frames, len(MOVIE))
    writer.join()
    assert [frame.time_s for frame in came] == list(range(len(MOVIE)))
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE)
    np.testing.assert_array_equal(list(open_frames(tmp_path)), MOVIE)  # as the folder does afterwards
    assert (frames.dropped, frames.late, frames.unusable) == (0, 0, 0)


def test_numbered_files_that_come_out_of_order_are_put_in_order(tmp_path):
    order = [0, 1, 2, 3, 4, 6, 5, 7, 9, 8, 10, 11]
    for k in range(4):
        save(tmp_path / f"{k}.png", MOVIE[k])
    frames = open_live_frames(tmp_path, idle_s=HUNG_S, rate_hz=50.0)
    assert frames.shape == (ROWS, COLUMNS)

    def write():
        for k in order[4:]:
            save(tmp_path / f"{k}.png", MOVIE[k])
            time.sleep(0.01)

    writer = threading.Thread(target=write)
    writer.start()
    came = taken(frames, len(MOVIE))
    writer.join()
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE)
    np.testing.assert_allclose([frame.time_s for frame in came], np.arange(12) / 50)


def test_a_missing_number_is_not_waited_for_for_ever_and_then_is_late(tmp_path):
    for k in (0, 1, 2, 3, 4, 6):
        save(tmp_path / f"{k}.png", MOVIE[k])
    frames = open_live_frames(tmp_path, idle_s=0.5)
    came = []
    for frame in frames:
        came.append(frame)
        if len(came) == 6:
            save(tmp_path / "5.png", MOVIE[5])
            save(tmp_path / "7.png", MOVIE[7])
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE[[0, 1, 2, 3, 4, 6, 7]])
    assert frames.late == 1


@pytest.mark.parametrize("suffix", ["png", "tif", "jpg", "bmp", "pgm"])
def test_no_part_of_a_file_is_taken_for_a_frame(tmp_path, suffix):
    save(tmp_path / f"whole.{suffix}", MOVIE[0])
    octets = (tmp_path / f"whole.{suffix}").read_bytes()
    (tmp_path / f"whole.{suffix}").unlink()
    (whole,) = list(open_whole(tmp_path / "at once", octets, suffix))
    frames = open_live_frames(tmp_path, idle_s=0.5)
    cuts = np.linspace(0, len(octets), 12).astype(int)

    def write():
        with (tmp_path / f"a.{suffix}").open("wb", buffering=0) as file:
            for start, stop in pairwise(cuts):
                file.write(octets[start:stop])
                time.sleep(0.03)

    writer = threading.Thread(target=write)
    writer.start()
    came = [frame.pixels for frame in frames]
    writer.join()
    np.testing.assert_array_equal(came, [whole])


def open_whole(folder, octets, suffix):
    folder.mkdir()
    (folder / f"a.{suffix}").write_bytes(octets)
    return open_frames(folder)


def test_what_cannot_be_read_is_a_missing_frame_with_a_sentence(tmp_path):
    for k in range(4):
        save(tmp_path / f"{k}.png", MOVIE[k])
    (tmp_path / "1.png").write_bytes((tmp_path / "1.png").read_bytes()[:90])
    save(tmp_path / "2.png", np.full((ROWS, COLUMNS), 7, np.uint8))
    said = []
    frames = open_live_frames(tmp_path, idle_s=0.2, on_fault=said.append)
    came = [frame.pixels for frame in frames]
    assert [pixels is None for pixels in came] == [False, True, True, False]
    assert frames.unusable == 2
    assert "1.png" in said[0]
    assert "cannot be read" in said[0]
    assert said[1].endswith("all its pixels are 7, so there is nothing to see in it; it is left out.")


def test_a_slow_reader_loses_the_oldest_and_is_told_how_many(tmp_path):
    save(tmp_path / "0.png", MOVIE[0])
    frames = open_live_frames(tmp_path, idle_s=0.5, held_bytes=4 * ROWS * COLUMNS)
    first, *_ = iterated = iter(frames), frames
    assert next(iterated[0]).time_s == 0
    written(tmp_path, [f"{k}.png" for k in range(12)]).join()
    time.sleep(0.4)
    came = list(first)
    assert [frame.time_s for frame in came][-4:] == [8, 9, 10, 11]  # the time of those that are dropped passes
    assert frames.dropped == 11 - len(came) > 0


def test_a_folder_is_gone_on_from_where_an_earlier_run_was_and_what_was_removed_is_counted(tmp_path):
    names = [f"f{2 * k:03d}.png" for k in range(12)]
    written(tmp_path, names[:7]).join()
    places = [frame.place for frame in taken(open_live_frames(tmp_path, rate_hz=10.0), 7)]
    assert [(place.number, place.name) for place in places] == list(enumerate(names[:7]))
    for name in names[:7]:
        (tmp_path / name).unlink()
    for name, pixels in list(zip(names, MOVIE, strict=True))[9:]:  # two came and went meanwhile
        save(tmp_path / name, pixels)
    for elapsed_s, lost in ((60.0, 2), (0.1, 1)):  # there was time for one only
        frames = open_live_frames(tmp_path, rate_hz=10.0)
        frames.go_on(places[-1], elapsed_s)
        came = taken(frames, 3)
        np.testing.assert_allclose([frame.time_s for frame in came], (7 + lost + np.arange(3)) / 10)
        np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE[9:])
        assert frames.late == 0


def begun_anew(folder: Path, count: int) -> None:
    for path in folder.glob("*.png"):
        path.unlink()
    time.sleep(0.05)  # the clock of a file system has steps
    for name, pixels in zip((f"f{k:03d}.png" for k in range(count)), MOVIE, strict=False):
        save(folder / name, pixels)


@pytest.mark.parametrize(("elapsed_s", "lost"), [(2.0, 16), (0.2, 0)])
def test_a_folder_that_was_begun_anew_meanwhile_is_read_from_its_start_and_the_time_since_is_a_gap(
    tmp_path, elapsed_s, lost
):
    said, names = [], [f"f{k:03d}.png" for k in range(20, 26)]
    written(tmp_path, names).join()
    place = taken(open_live_frames(tmp_path, rate_hz=10.0), 6)[-1].place
    begun_anew(tmp_path, 4)
    frames = open_live_frames(tmp_path, rate_hz=10.0, idle_s=10.0, on_fault=said.append)
    frames.go_on(place, elapsed_s)
    frames._source._read_s = min(path.stat().st_ctime for path in tmp_path.glob("*.png")) - 0.01
    came = taken(frames, 4)
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE[:4])
    np.testing.assert_allclose([frame.time_s for frame in came], (6 + lost + np.arange(4)) / 10)
    assert len(said) == 1
    assert "was begun anew: f025.png is gone, and 4 frames came after it" in said[0]


def test_a_folder_that_is_begun_anew_while_it_is_read_goes_on(tmp_path):
    said, names = [], [f"f{k:03d}.png" for k in range(20, 26)]
    written(tmp_path, names).join()
    frames = open_live_frames(tmp_path, rate_hz=10.0, idle_s=10.0, on_fault=said.append)
    coming = iter(frames)
    list(islice(coming, 6))
    begun_anew(tmp_path, 4)
    came = list(islice(coming, 4))
    frames.stop()
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE[:4])
    np.testing.assert_allclose([frame.time_s for frame in came], (6 + np.arange(4)) / 10)
    assert len(said) == 1


def later(path: Path, pixels: np.ndarray, at_s: list[float]) -> None:
    """Write an image over, at a later time of the file system whatever its steps."""
    at_s[0] += 1.0
    beside = path.with_name(f".later{path.suffix}")
    save(beside, pixels)
    os.utime(beside, (at_s[0], at_s[0]))
    os.replace(beside, path)


@pytest.mark.parametrize("names", [["frame.png"], ["f0.png", "f1.png", "f2.png", "f3.png"]])
def test_a_camera_that_writes_over_its_names_is_followed(tmp_path, names):
    said, at_s = [], [1.6e9]
    for k, name in enumerate(names):
        later(tmp_path / name, MOVIE[k], at_s)
    frames = open_live_frames(
        tmp_path / names[0] if len(names) == 1 else tmp_path, rate_hz=10.0, idle_s=HUNG_S, on_fault=said.append
    )
    coming = iter(frames)
    list(islice(coming, len(names)))
    stop = threading.Event()

    def written_over():
        while not said and not stop.wait(0.01):  # until it is found out
            for name in names:
                later(tmp_path / name, MOVIE[0], at_s)

    writer = threading.Thread(target=written_over)
    writer.start()
    first = next(coming)
    writer.join()
    np.testing.assert_array_equal(first.pixels, MOVIE[0])
    found = []
    for k in range(1, 9):  # each is taken before the next is written
        later(tmp_path / names[k % len(names)], MOVIE[k], at_s)
        found.append(next(frame.pixels for frame in coming if not np.array_equal(frame.pixels, MOVIE[0])))
    frames.stop()
    np.testing.assert_array_equal(found, MOVIE[1:9])
    assert len(said) == 1
    assert "files are written over; each time one of them is written is a frame" in said[0]
    assert frames.late == 0


def test_earlier_names_that_were_left_there_are_not_taken_for_a_folder_begun_anew(tmp_path):
    said, names = [], [f"f{k:03d}.png" for k in range(20, 26)]
    written(tmp_path, names).join()
    place = taken(open_live_frames(tmp_path, rate_hz=10.0), 6)[-1].place
    (tmp_path / names[-1]).unlink()
    frames = open_live_frames(tmp_path, rate_hz=10.0, idle_s=0.3, on_fault=said.append)
    frames.go_on(place, 0.0)
    with pytest.raises(DataError, match="no frame came"):
        list(frames)
    assert not said


def test_a_file_that_is_removed_while_it_is_read_ends_nothing(tmp_path, monkeypatch):
    read = _growing.read_image

    def read_and_removed(path, where):
        pixels = read(path, where)
        path.unlink()
        return pixels

    monkeypatch.setattr(_growing, "read_image", read_and_removed)
    frames = open_live_frames(tmp_path)
    written(tmp_path, [f"f{k}.png" for k in range(6)]).join()
    np.testing.assert_array_equal([frame.pixels for frame in taken(frames, 6)], MOVIE[:6])


def piped(octets, monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(octets)))
    return open_live_frames("-")


def joined(kind):
    stream = io.BytesIO()
    for pixels in MOVIE:
        if kind == "npy":
            np.save(stream, pixels)
        elif kind == "y4m":
            stream.write(b"YUV4MPEG2 W24 H20 F25:2 Ip C420jpeg\n" * (not stream.tell()) + b"FRAME\n")
            stream.write(pixels.tobytes() + bytes(2 * 10 * 12))
        else:
            Image.fromarray(pixels).save(stream, format=kind)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["npy", "PNG", "PPM", "y4m"])
def test_a_pipe_gives_every_frame(monkeypatch, kind):
    frames = piped(joined(kind), monkeypatch)
    came = list(frames)
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE)
    interval_s = 2 / 25 if kind == "y4m" else 1.0
    assert frames.interval_s == pytest.approx(interval_s)
    np.testing.assert_allclose([frame.time_s for frame in came], interval_s * np.arange(12))


def test_sixteen_bits_stay_sixteen_bits(monkeypatch):
    deep = np.array([[300, 65535], [7, 256]])
    pgm = b"P5\n# by hand\n2 2\n65535\n" + deep.astype(">u2").tobytes()
    y4m = b"YUV4MPEG2 W2 H2 Cmono16\nFRAME\n" + deep.astype("<u2").tobytes()
    for octets in (pgm, y4m):
        (frame,) = piped(octets, monkeypatch)
        np.testing.assert_array_equal(frame.pixels, deep)


@pytest.mark.parametrize(
    ("octets", "sentence"),
    [
        (b"", "standard input: is empty"),
        (b"hello", "is no stream of YUV4MPEG2, PGM, PNG or .npy frames"),
        (b"P5 10 10 255\n123", "cannot be read .it ends in the middle of a frame"),
        (b"P5 100000 100000 255\n123", "cut out the region of interest"),
        (b"\x93NUMPY" + bytes(40), "cannot be read"),
    ],
)
def test_what_is_no_stream_is_refused(monkeypatch, octets, sentence):
    with pytest.raises(DataError, match=sentence):
        _ = piped(octets, monkeypatch).shape


def test_what_is_live():
    assert all(map(is_live, ("-", "camera:0", "rtsp://host/path", "HTTP://host/a.mjpg", "udp://@:5000")))
    assert not any(map(is_live, ("frames", "a.mp4", "C:\\frames", "file.h5::/x", "frames/*.png", "file:///etc/passwd")))


def test_what_cannot_be_followed_is_refused(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"")
    with pytest.raises(DataError, match="is no folder; --follow waits for the images that are written to one"):
        open_live_frames(tmp_path / "a.mp4")
    with pytest.raises(DataError, match="no frame came"):
        _ = open_live_frames(tmp_path, idle_s=0.05).shape
    with pytest.raises(DataError, match="rate_hz=0"):
        open_live_frames(tmp_path, rate_hz=0)


@pytest.fixture
def ffmpeg():
    return pytest.importorskip("imageio_ffmpeg", reason="network streams need the extra video").get_ffmpeg_exe()


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def served(ffmpeg):
    """A lossless stream of MOVIE on loopback, at 25 frames a second."""
    address = f"tcp://127.0.0.1:{free_port()}"
    process = serving(ffmpeg, address)
    yield address, process
    process.kill()
    process.communicate()


def serving(ffmpeg, address):
    return subprocess.Popen(
        [ffmpeg, "-v", "error", "-f", "rawvideo", "-pix_fmt", "gray", "-s", f"{COLUMNS}x{ROWS}", "-r", "25", "-i", "-",
         "-c:v", "ffv1", "-f", "matroska", f"{address}?listen=1"],
        stdin=subprocess.PIPE,
    )  # fmt: skip


def connected(address, **given):
    """Open a stream once its server listens."""
    deadline = time.monotonic() + HUNG_S
    while True:
        frames = open_live_frames(address, **given)
        try:
            shape = frames.shape
        except DataError as error:
            if "refused" not in str(error) or time.monotonic() > deadline:
                raise
            time.sleep(0.1)
        else:
            assert shape == (ROWS, COLUMNS)
            return frames


def test_a_network_stream_is_read_with_its_own_times(served):
    address, process = served
    process.stdin.write(MOVIE.tobytes())
    process.stdin.close()
    process.stdin = None
    frames = connected(address)
    assert frames.interval_s == pytest.approx(1 / 25)
    came = list(islice(frames, len(MOVIE)))
    frames.stop()
    np.testing.assert_array_equal([frame.pixels for frame in came], MOVIE)
    np.testing.assert_allclose([frame.time_s for frame in came], np.arange(12) / 25, atol=1e-3)


def test_a_stream_that_goes_is_read_again_and_its_clock_goes_on(ffmpeg):
    address, said, came = f"tcp://127.0.0.1:{free_port()}", [], []
    frames = None
    for _ in range(2):
        process = serving(ffmpeg, address)
        process.stdin.write(MOVIE.tobytes())
        process.stdin.close()
        process.stdin = None
        if frames is None:
            frames = connected(address, on_fault=said.append)
            taken = iter(frames)
        came += islice(taken, len(MOVIE))
        process.communicate()
    frames.stop()
    np.testing.assert_array_equal([frame.pixels for frame in came], [*MOVIE, *MOVIE])
    times_s = np.array([frame.time_s for frame in came])
    steps_s = np.diff(times_s)
    np.testing.assert_allclose(np.delete(steps_s, 11), 1 / 25, atol=1e-3)
    assert steps_s[11] > 0.2  # it was away
    assert frames.counts["reconnected"] == 1
    assert "has ended. It is tried again until it is back" in said[0]
    assert "is back after" in said[1]


def test_a_stream_that_falls_silent_ends_after_a_while_and_a_stopped_one_at_once(served):
    address, process = served
    process.stdin.write(MOVIE.tobytes() * 20)
    process.stdin.flush()
    frames = connected(address, idle_s=1.0)
    assert len(list(frames)) > 100  # what ffmpeg holds back of an open stream does not come


def test_where_nobody_serves_is_said(ffmpeg):
    with pytest.raises(DataError, match=r"no video came of it \(.*refused.*\); check the address"):
        _ = open_live_frames(f"tcp://127.0.0.1:{free_port()}").shape


def test_a_password_is_not_told(ffmpeg):
    frames = open_live_frames(f"rtsp://me:secret@127.0.0.1:{free_port()}/x")
    assert frames.name.startswith("rtsp://me:***@127.0.0.1")
    with pytest.raises(DataError) as raised:
        _ = frames.shape
    assert "secret" not in str(raised.value)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="cameras are files of /dev on Linux alone")
def test_a_camera_that_is_not_there_is_said(ffmpeg):
    with pytest.raises(DataError, match="camera:173: there is no /dev/video173; the cameras here are"):
        open_live_frames("camera:173")


def test_without_the_extra_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(DataError, match=r"pip install 'elusive\[video\]'"):
        open_live_frames("rtsp://127.0.0.1/x")


class RtspServer(socketserver.BaseRequestHandler):
    """The least of RTSP (RFC 2326) that a client asks of a camera; ffmpeg sends the pictures by RTP over UDP."""

    ffmpeg = ""
    sender: subprocess.Popen | None = None

    def handle(self):
        sdp = "v=0\r\no=- 0 0 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\nm=video 0 RTP/AVP 26\r\n"
        lines, port = self.request.makefile("r", newline="\r\n"), "0"
        while request := lines.readline().strip():
            heads = dict(line.strip().split(": ", 1) for line in iter(lines.readline, "\r\n"))
            method, said, body = request.split()[0], f"CSeq: {heads['CSeq']}\r\nSession: 1\r\n", ""
            status = "200 OK"
            if method == "OPTIONS":
                said += "Public: OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN\r\n"
            elif method == "DESCRIBE":
                body = sdp
                said += f"Content-Type: application/sdp\r\nContent-Length: {len(sdp)}\r\n"
            elif method == "SETUP":
                asked = re.search(r"client_port=(\d+)", heads["Transport"])
                status = "200 OK" if asked else "461 Unsupported Transport"
                port = asked[1] if asked else port
                said += f"Transport: RTP/AVP;unicast;client_port={port}-{int(port) + 1};server_port=1-2\r\n" * bool(
                    asked
                )
            self.request.sendall(f"RTSP/1.0 {status}\r\n{said}\r\n{body}".encode())
            if method == "PLAY":
                type(self).sender = subprocess.Popen(
                    [self.ffmpeg, "-v", "error", "-re", "-f", "lavfi", "-i", "testsrc=s=64x48:r=25:d=20", "-c:v",
                     "mjpeg", "-pix_fmt", "yuvj420p", "-huffman", "default", "-force_duplicated_matrix", "1",
                     "-f", "rtp", f"rtp://127.0.0.1:{port}"],
                    stdout=subprocess.DEVNULL,
                )  # fmt: skip


def test_an_rtsp_camera_is_read_until_it_is_stopped(ffmpeg):
    RtspServer.ffmpeg = ffmpeg
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), RtspServer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        try:
            frames = open_live_frames(f"rtsp://127.0.0.1:{server.server_address[1]}/ir", idle_s=HUNG_S)
            assert frames.shape == (48, 64)
            came = taken(frames, 12)
        finally:
            server.shutdown()
            if RtspServer.sender is not None:
                RtspServer.sender.kill()
                RtspServer.sender.wait()
    assert frames.interval_s == pytest.approx(1 / 25, rel=0.1)
    times = np.array([frame.time_s for frame in came])
    assert (np.diff(times) > 0).all()
    assert all(frame.pixels.std() > 10 for frame in came)
