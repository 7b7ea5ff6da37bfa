"""Signals as they are written: the frames of the whole file, whatever its kind, and each broken one is a sentence."""

from __future__ import annotations

import io
import struct
import threading
import wave
from pathlib import Path

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io import open_signal
from elusive.io.live_signals import follow_signal
from elusive.io.sources import Feed

IDLE_S = 0.5
SIZE = 50


def octets(kind: str) -> tuple[bytes, str, dict[str, object]]:
    """A recording of 403 samples, its name, and what reads it."""
    x = np.random.default_rng(2).standard_normal(403)
    cut = {"frame_samples": SIZE, "hop_samples": 20}
    if kind == "wav":
        held = io.BytesIO()
        with wave.open(held, "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(1000)
            file.writeframes((x * 5000).astype("<i2").tobytes())
        return held.getvalue() + b"LIST\x04\x00\x00\x00none", "a.wav", cut
    if kind == "lines":
        rows = [f"{0.1 * k:.1f}," + ",".join(f"{v:.6f}" for v in x[10 * k : 10 * k + 10]) for k in range(40)]
        return "\n".join(["time_s," + ",".join(f"s{k}" for k in range(10)), *rows, ""]).encode(), "a.csv", {}
    if kind == "column":
        return "".join(f"{v:.6f}\n" for v in x).encode(), "a.txt", cut
    form, dtype = kind.split("-")
    pairs = np.column_stack([x, x[::-1]]) if form.startswith("c") else x
    return (20 * pairs).astype(dtype).tobytes(), "a.iq", {"raw": form, "rate_hz": 4.0, **cut}


KINDS = ("wav", "lines", "column", "s16-<i2", "cf32-<f4", "cu8-u1")


def written_slowly(path: Path, data: bytes) -> threading.Thread:
    """Write in pieces that end anywhere; the first few octets are there at once."""

    def write() -> None:
        with path.open("ab") as file:
            for k in range(7, len(data), 501):
                file.write(data[k : k + 501])
                file.flush()

    path.write_bytes(data[:7])
    return threading.Thread(target=write)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("piped", [False, True])
def test_what_grows_has_the_frames_of_the_whole_file(tmp_path, monkeypatch, kind, piped):
    data, name, how = octets(kind)
    path = tmp_path / name
    path.write_bytes(data)
    whole = open_signal(path, **how)
    recorded = list(whole)
    if piped:
        stream = io.BufferedReader(io.BytesIO(data))
        monkeypatch.setattr("elusive.io.live_signals.standard_input", lambda: stream)
        source = follow_signal("-", Feed(), **how)
        live = list(source)
    else:
        writer = written_slowly(path, data)
        writer.start()
        source = follow_signal(str(path), Feed(IDLE_S), **how)
        live = list(source)
        writer.join()
    assert (source.samples, source.rate_hz, source.timed, source.hop) == (
        whole.samples, whole.rate_hz, whole.timed, whole.hop,
    )  # fmt: skip
    assert [frame.time_s for frame in live] == [frame.time_s for frame in recorded]
    np.testing.assert_array_equal([frame.samples for frame in live], [frame.samples for frame in recorded])


@pytest.mark.parametrize("told", [0, 0x7FFFF000, 0xFFFFFFFF])
def test_a_length_that_is_not_known_yet_is_none(tmp_path, told):
    data, _, how = octets("wav")
    whole = data[: -len(b"LIST\x04\x00\x00\x00none")]
    (tmp_path / "a.wav").write_bytes(whole[:40] + struct.pack("<I", told) + whole[44:])
    assert len(list(follow_signal(str(tmp_path / "a.wav"), Feed(0.0), **how))) == 1 + (403 - SIZE) // 20


def test_a_line_that_is_spoilt_is_left_out_and_counted(tmp_path):
    (tmp_path / "a.csv").write_text("1,2,3\n4,x,6\n7,8\n9,9,9\n")
    said: list[str] = []
    feed = Feed(0.0, say=said.append)
    live = [frame.samples.tolist() for frame in follow_signal(str(tmp_path / "a.csv"), feed)]
    assert live == [[1, 2, 3], [9, 9, 9]]
    assert feed.counts["spoilt"] == 2
    assert "a.csv, line 2, field 2: 'x' is no number" in said[0]


@pytest.mark.parametrize(
    ("name", "data", "how", "sentence"),
    [
        ("a.npy", b"", {}, r"files of type \.npy are not followed; give a \.wav, text, or --raw"),
        ("tcp://127.0.0.1:9", b"", {}, "pipe it, and give -"),
        ("nothing.csv", None, {}, "cannot be read"),
        ("a.wav", b"RIFF", {}, "ends within its header"),
        ("a.iq", b"\0" * 8, {"raw": "s16", "channel": 1}, "channel=1 chooses in a WAVE file"),
        ("a.csv", b"1,2\n3,4\n", {"frame_samples": 4}, "holds frames already, of 2 samples"),
    ],
)
def test_what_cannot_be_followed_is_a_sentence(tmp_path, monkeypatch, name, data, how, sentence):
    monkeypatch.chdir(tmp_path)
    if data is not None and ":" not in name:
        Path(name).write_bytes(data)
    with pytest.raises(DataError, match=sentence):
        list(follow_signal(name, Feed(0.0), **how))


def test_samples_without_a_header_need_a_kind_that_says_nothing_itself(tmp_path):
    (tmp_path / "a.wav").write_bytes(octets("wav")[0])
    with pytest.raises(DataError, match=r"raw=s16 is of samples without a header, and \.wav says itself"):
        open_signal(tmp_path / "a.wav", raw="s16")
