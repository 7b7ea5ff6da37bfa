"""Signals read: what other programs wrote comes back, part by part, and every broken file is one sentence."""

from __future__ import annotations

import struct
import tracemalloc
import wave
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.io import wavfile

from elusive.errors import DataError
from elusive.io import (
    open_signal,
    read_truth,
)

FINITE = st.floats(-1e9, 1e9)


def frames_of(path: Path, **options: Any) -> np.ndarray:
    return np.stack([frame.samples for frame in open_signal(path, **options)])


def times_of(path: Path, **options: Any) -> list[float]:
    return [frame.time_s for frame in open_signal(path, **options)]


def noise(*shape: int) -> np.ndarray:
    return np.random.default_rng(1).standard_normal(shape)


# ------------------------------------------------------------------------------------------------------------- arrays


@pytest.mark.parametrize("dtype", ["f8", "f4", ">f8", "i2", "u1", "i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_an_array_is_read_as_numpy_saved_it(tmp_path: Path, dtype: str, order: Any) -> None:
    given = np.array(np.abs(50 * noise(6, 9)), dtype=dtype, order=order)
    np.save(tmp_path / "a.npy", given)
    source = open_signal(tmp_path / "a.npy")
    assert (source.samples, source.length, source.rate_hz, source.timed) == (9, 6, None, False)
    found = frames_of(tmp_path / "a.npy")
    assert found.dtype == np.float64
    np.testing.assert_array_equal(found, given)
    assert times_of(tmp_path / "a.npy") == [0, 1, 2, 3, 4, 5]


def test_a_part_keeps_its_numbers_and_a_rate_makes_seconds(tmp_path: Path) -> None:
    given = noise(10, 4)
    np.save(tmp_path / "a.npy", given)
    source = open_signal(tmp_path / "a.npy", start=3, stop=8, rate_hz=2.0)
    assert source.length == 5
    assert source.timed
    assert [frame.time_s for frame in source] == [1.5, 2.0, 2.5, 3.0, 3.5]
    np.testing.assert_array_equal(np.stack([frame.samples for frame in source]), given[3:8])
    assert len(list(open_signal(tmp_path / "a.npy", start=7, stop=99))) == 3


@pytest.mark.parametrize(("size", "hop", "count"), [(100, None, 10), (300, None, 3), (100, 150, 7), (334, None, 2)])
def test_a_long_array_is_cut_into_frames(tmp_path: Path, size: int, hop: int | None, count: int) -> None:
    given = noise(1000)
    np.save(tmp_path / "a.npy", given)
    found = frames_of(tmp_path / "a.npy", frame_samples=size, hop_samples=hop)
    expected = [given[s : s + size] for s in range(0, 1000 - size + 1, hop or size)]
    assert len(expected) == count
    np.testing.assert_array_equal(found, expected)
    part = frames_of(tmp_path / "a.npy", frame_samples=size, hop_samples=hop, start=count - 2)
    np.testing.assert_array_equal(part, expected[-2:])


def test_a_frame_is_the_callers_own(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", noise(3, 4))
    source = open_signal(tmp_path / "a.npy")
    for frame in source:
        frame.samples[:] = 0.0
    np.testing.assert_array_equal(np.stack([frame.samples for frame in source]), noise(3, 4))


# --------------------------------------------------------------------------------------------------------------- wave


@pytest.mark.parametrize("dtype", ["u1", "i2", "i4", "f4", "f8"])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_wave_file_gives_what_scipy_wrote(tmp_path: Path, dtype: str, channels: int) -> None:
    values = np.clip(0.3 * noise(900, channels), -0.99, 0.99)
    full = {"u1": 128.0, "i2": 2.0**15, "i4": 2.0**31}.get(dtype, 1.0)
    raw = (values * full + (128 if dtype == "u1" else 0)).astype(dtype)
    wavfile.write(tmp_path / "a.wav", 8000, raw)
    for channel in range(channels):
        found = frames_of(tmp_path / "a.wav", frame_samples=200, channel=channel if channels > 1 else None)
        expected = (raw[:800, channel].astype(float) - (128 if dtype == "u1" else 0)) / full
        np.testing.assert_array_equal(found.ravel(), expected)
    source = open_signal(tmp_path / "a.wav", frame_samples=200, channel=0)
    assert source.rate_hz == 40.0
    assert [frame.time_s for frame in source] == [0.0, 0.025, 0.05, 0.075]


def test_24_bits_and_a_chunk_of_odd_length_before_them(tmp_path: Path) -> None:
    raw = (noise(400) * 2**20).astype(np.int32)
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setparams((1, 3, 44100, 0, "NONE", ""))
        file.writeframes(raw.astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3].tobytes())
    np.testing.assert_array_equal(frames_of(tmp_path / "a.wav", frame_samples=200).ravel(), raw / 2**23)
    data = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(data[:36] + b"note" + struct.pack("<I", 3) + b"abc\0" + data[36:])
    np.testing.assert_array_equal(frames_of(tmp_path / "a.wav", frame_samples=200).ravel(), raw / 2**23)
    with pytest.warns(wavfile.WavFileWarning, match="skipping"):
        np.testing.assert_array_equal(wavfile.read(tmp_path / "a.wav")[1] / 2**31, raw / 2**23)


def rewritten(path: Path, form: bytes, size: int, *, before: bytes = b"") -> None:
    """Give a plain WAVE file another form and another size of its samples."""
    data = path.read_bytes()
    path.write_bytes(form + data[4:12] + before + data[12:40] + struct.pack("<I", size) + data[44:])


def test_rf64_and_what_was_written_into_a_pipe(tmp_path: Path) -> None:
    raw = (1000 * noise(300)).astype(np.int16)
    for form in (b"RF64", b"RIFF"):
        wavfile.write(tmp_path / "a.wav", 8000, raw)
        told = b"ds64" + struct.pack("<IQQQI", 28, 0, raw.nbytes, raw.size, 0) if form == b"RF64" else b""
        rewritten(tmp_path / "a.wav", form, 0xFFFFFFFF, before=told)
        np.testing.assert_array_equal(frames_of(tmp_path / "a.wav", frame_samples=100).ravel(), raw / 2**15)


# --------------------------------------------------------------------------------------------------------------- text


@settings(deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    values=arrays(np.float64, st.tuples(st.integers(2, 6), st.integers(2, 7)), elements=FINITE),
    delimiter=st.sampled_from([",", ";", " ", "\t", ", ", "  "]),
    header=st.sampled_from(["", "names", "numbers", "comment"]),
    timed=st.booleans(),
    suffix=st.sampled_from([".csv", ".txt", ".tsv"]),
)
def test_what_numpy_writes_as_text_reads_back(
    tmp_path: Path, values: np.ndarray, delimiter: str, header: str, timed: bool, suffix: str
) -> None:
    values[:, 0] += np.arange(1, len(values) + 1) * 1e10  # no constant frame
    table, names = values, [f"s{k}" for k in range(values.shape[1])]
    if header == "numbers":
        names = [str(k) for k in range(values.shape[1])]
    if timed:
        table, names = np.column_stack([0.5 * np.arange(len(values)), values]), ["time_s", *names]
    line = delimiter.join(names) if timed or header in ("names", "numbers") else ""
    if header == "comment" and not timed:
        line = "# measured on a Sunday"
    path = tmp_path / f"a{suffix}"
    if header == "numbers" and len(names) < 3:
        return  # two bare numbers could be a frame
    np.savetxt(path, table, fmt="%.17g", delimiter=delimiter, header=line, comments="")
    np.testing.assert_array_equal(frames_of(path), values)
    wanted = 0.5 * np.arange(len(values)) if timed else np.arange(len(values))
    np.testing.assert_array_equal(times_of(path), wanted)
    source = open_signal(path)
    assert (source.length, source.rate_hz, source.timed) == (None, None, timed)


def test_a_header_that_numpy_makes_a_comment_is_heeded(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.txt", np.column_stack([[3.0, 4.0], noise(2, 5)]), header="time_s a b c d e")
    assert times_of(tmp_path / "a.txt") == [3.0, 4.0]
    np.testing.assert_allclose(frames_of(tmp_path / "a.txt"), noise(2, 5))


@pytest.mark.parametrize("header", ["", "volts\n"])
def test_one_column_is_a_long_recording(tmp_path: Path, header: str) -> None:
    given = noise(55)
    (tmp_path / "a.csv").write_text(header + "\n".join(map(repr, given.tolist())) + "\n")
    np.testing.assert_array_equal(frames_of(tmp_path / "a.csv", frame_samples=20).ravel(), given[:40])
    skipped = frames_of(tmp_path / "a.csv", frame_samples=10, hop_samples=20, start=1)
    np.testing.assert_array_equal(skipped, [given[20:30], given[40:50]])


def test_a_clock_and_one_column_is_a_long_recording_with_times(tmp_path: Path) -> None:
    given = noise(30)
    lines = [f"{10 + 0.1 * k:.1f},{value!r}" for k, value in enumerate(given.tolist())]
    (tmp_path / "a.csv").write_text("time_s,volts\n" + "\n".join(lines))
    source = open_signal(tmp_path / "a.csv", frame_samples=10)
    assert [frame.time_s for frame in source] == [10.0, 11.0, 12.0]
    np.testing.assert_array_equal(np.concatenate([frame.samples for frame in source]), given)


# ------------------------------------------------------------------------------------------------------------- faults


def text(content: str, name: str = "a.csv") -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(content)
        return folder / name

    return write


def saved(array: Any, **options: Any) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        np.save(folder / "a.npy", array, **options)
        return folder / "a.npy"

    return write


def wav(change: Callable[[bytes], bytes]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        wavfile.write(folder / "a.wav", 8000, (1000 * noise(400)).astype(np.int16))
        (folder / "a.wav").write_bytes(change((folder / "a.wav").read_bytes()))
        return folder / "a.wav"

    return write


def broken(array: np.ndarray, place: tuple[int, ...], value: float) -> np.ndarray:
    array = array.copy()
    array[place] = value
    return array


CUT = {"frame_samples": 100}


@pytest.mark.parametrize(
    ("make", "options", "sentence"),
    [
        (text("1,2,3\n4,5\n"), {}, "a.csv, line 2: has 2 cells, the first line of numbers 3"),
        (text("a,b,c\n1,2,3\n4,x,6\n"), {}, "a.csv, line 3, field 2: 'x' is no number; every cell"),
        (text("1.5;2,5,5;3\n"), {}, "line 1, field 2: '2,5,5' is no number; every cell"),
        (text("1,2,x\n1,2,3\n"), {}, "line 1, field 3: 'x' is no number"),
        (text("time_s,a,b\n0,1,2\n0,2,3\n"), {}, "line 3: time_s is 0 after 0; times must go forwards"),
        (text("time_s,a,b\n0,1,2\nnan,2,3\n"), {}, "line 3: time_s is nan; give every line its time"),
        (text("time,a,b\n0,1,2\n1,2,3\n"), {}, "line 1: the first column is named 'time'; name it time_s"),
        (text(",0,1\n0,1,2\n1,2,3\n"), {}, "line 1: the first column is named ''"),
        (text("time_s\n0\n1\n"), {}, "line 2: has a time and no sample"),
        (text("time_s,a,b\n0,1,2\n1,2,3\n"), {"rate_hz": 2.0}, "has times of its own"),
        (text(""), {}, "a.csv: holds no line of numbers"),
        (text("a,b,c\n"), {}, "a.csv: holds no line of numbers"),
        (text("# nothing\n\n"), {}, "a.csv: holds no line of numbers"),
        (text("1,2,3\n"), {}, "a.csv: gives one frame only"),
        (text("1\n2\n3\n"), {}, "holds 3 samples, fewer than one frame of 1200; choose shorter frames"),
        (text("1\n2\n3\n"), {"frame_samples": 2}, "gives one frame only"),
        (text("1,2,3\n3,2,1\n"), {"start": 5}, "holds no frame in the part"),
        (text("1,2,3\n3,2,1\n"), {"frame_samples": 2}, "holds frames already, of 3 samples"),
        (saved(noise(1, 9)), {}, "a.npy: gives one frame only"),
        (saved(noise(5, 9)), {"start": 4}, "a.npy: gives one frame only"),
        (saved(noise(5, 9)), {"start": 5}, "has 5 frames, numbered from 0; start=5"),
        (saved(noise(5, 9)), {"start": -1}, "choose 0 <= start < stop"),
        (saved(noise(5, 9)), {"start": 2, "stop": 2}, "choose 0 <= start < stop"),
        (saved(noise(5, 9)), {"rate_hz": 0.0}, "rate_hz=0.0: must be a positive"),
        (saved(noise(5, 9)), {"channel": 0}, "channel=0 chooses in a WAVE file"),
        (saved(noise(5, 9)), CUT, "holds frames already, of 9 samples"),
        (saved(noise(5, 9)), {"hop_samples": 2000}, "holds frames already, of 9 samples"),
        (saved(noise(5, 1)), {}, "its frames have 1 samples"),
        (saved(noise(0, 9)), {}, "a.npy"),
        (saved(noise(5, 9, 2)), {}, "has shape (5, 9, 2); a signal is an array (time, sample)"),
        (saved(np.float64(3)), {}, "has shape ()"),
        (saved(np.array([{1: 2}, "x"], dtype=object), allow_pickle=True), {}, "without pickled objects"),
        (saved(np.array(["a", "b"])), {}, "holds <U1 values"),
        (saved(noise(500)), {}, "holds 500 samples, fewer than one frame of 1200"),
        (saved(noise(150)), CUT, "gives one frame only"),
        (saved(noise(500)), {"frame_samples": 100, "hop_samples": 0}, "the next begins at least one later"),
        (saved(noise(500)), {"frame_samples": 1}, "a frame has at least 2 samples"),
        (text("not an array", "a.npy"), {}, "a.npy: cannot be read"),
        (text("", "a.npy"), {}, "a.npy: cannot be read"),
        (wav(lambda b: b[:-100]), CUT, "is cut short: its header promises 800 bytes of samples and 700 are there"),
        (wav(lambda b: b[:30]), CUT, "it ends within its header"),
        (wav(lambda b: b""), CUT, "it ends within its header"),
        (wav(lambda b: b"OggS" + b[4:]), CUT, "does not begin as a WAVE file does"),
        (wav(lambda b: b[:20] + b"\x07\x00" + b[22:]), CUT, "are compressed (WAVE format 7)"),
        (wav(lambda b: b[:22] + b"\0\0" + b[24:]), CUT, "a.wav: cannot be read"),
        (wav(lambda b: b[:32] + b"\x05\0" + b[34:]), CUT, "a.wav: cannot be read"),
        (wav(lambda b: b[:40] + bytes(4)), CUT, "holds no sample"),
        (wav(lambda b: b), {"frame_samples": 100, "channel": 1}, "has 1 channels; choose one with"),
        (wav(lambda b: b), {}, "holds 400 samples, fewer than one frame"),
        (text("1 2\n", "a.dat"), {}, "files of type .dat are not read; give one of .npy, .wav"),
        (lambda folder: folder / "none.npy", {}, "none.npy: there is no such file"),
        (lambda folder: folder, {}, "is a folder"),
    ],
)
def test_a_fault_is_one_sentence(
    tmp_path: Path, make: Callable[[Path], Path], options: dict[str, Any], sentence: str
) -> None:
    path = make(tmp_path)
    with pytest.raises(DataError) as caught:
        list(open_signal(path, **options))
    said = str(caught.value)
    assert sentence in said
    assert said.endswith(".")
    assert "\n" not in said


def test_what_is_missing_comes_as_it_is(tmp_path: Path) -> None:
    """A gap is no end: what tracks the signal leaves it out."""
    given = broken(broken(noise(5, 9), (3, 4), np.nan), (2,), 7.5)
    np.testing.assert_array_equal(frames_of(saved(given)(tmp_path)), given)
    np.testing.assert_array_equal(
        frames_of(text("1,2,3\n1,,3\n2,nan,2\n")(tmp_path)), [[1, 2, 3], [1, np.nan, 3], [2, np.nan, 2]]
    )


def test_complex_samples_are_kept(tmp_path: Path) -> None:
    given = noise(5, 9) + 1j * noise(5, 9)
    np.testing.assert_array_equal(frames_of(saved(given)(tmp_path)), given)
    np.testing.assert_array_equal(frames_of(saved(given.ravel())(tmp_path), frame_samples=9), given)


@pytest.mark.parametrize("suffix", [".npy", ".csv"])
def test_frames_may_overlap(tmp_path: Path, suffix: str) -> None:
    given = noise(50)
    path = saved(given)(tmp_path) if suffix == ".npy" else tmp_path / "a.csv"
    if suffix == ".csv":
        np.savetxt(path, given, fmt="%.17g")
    expected = np.lib.stride_tricks.sliding_window_view(given, 20)[::8]
    np.testing.assert_array_equal(frames_of(path, frame_samples=20, hop_samples=8), expected)
    np.testing.assert_array_equal(frames_of(path, frame_samples=20, hop_samples=8, start=1, stop=3), expected[1:3])


def test_several_channels_ask_which(tmp_path: Path) -> None:
    wavfile.write(tmp_path / "a.wav", 8000, noise(400, 2).astype(np.float32))
    with pytest.raises(DataError, match="has 2 channels; choose one with"):
        open_signal(tmp_path / "a.wav", frame_samples=100)


def test_text_that_is_none_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"1,2,3\n4,5,\xff\xfe\n")
    with pytest.raises(DataError, match="is not text in UTF-8"):
        list(open_signal(tmp_path / "a.csv"))


@settings(deadline=None, max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), suffix=st.sampled_from([".npy", ".wav", ".csv"]))
def test_a_damaged_file_never_ends_in_a_traceback(tmp_path: Path, data: st.DataObject, suffix: str) -> None:
    whole = tmp_path / f"whole{suffix}"
    if suffix == ".npy":
        np.save(whole, noise(4, 20))
    elif suffix == ".wav":
        wavfile.write(whole, 8000, (1000 * noise(80)).astype(np.int16))
    else:
        np.savetxt(whole, noise(4, 20), delimiter=",")
    content = bytearray(whole.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(len(content) - 1, 140)))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))])
    try:
        for frame in open_signal(path, frame_samples=20 if suffix == ".wav" else None):
            # an empty field, as where a line ends in its comma, is a sample that is missing
            assert not np.isinf(frame.samples).any()
    except DataError as error:
        assert str(path) in str(error)  # noqa: PT017


@pytest.mark.parametrize("suffix", [".npy", ".wav", ".csv"])
def test_a_long_recording_is_not_held_in_memory(tmp_path: Path, suffix: str) -> None:
    path, many = tmp_path / f"a{suffix}", 100_000 if suffix == ".csv" else 3_000_000
    values = noise(many).astype(np.float32)
    if suffix == ".npy":
        np.save(path, values)
    elif suffix == ".wav":
        wavfile.write(path, 8000, values)
    else:
        path.write_text("\n".join(f"{value:.3f}" for value in values))
    del values
    source = open_signal(path, frame_samples=1000)
    tracemalloc.start()
    try:
        assert sum(1 for _ in source) == many // 1000
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 1_000_000


# -------------------------------------------------------------------------------------------------- truth


def test_a_truth_of_one_and_of_several_objects(tmp_path: Path) -> None:
    (tmp_path / "one.txt").write_text("x_sample\n3.5\nnan # gone\n\n-1e1\n")
    np.testing.assert_array_equal(
        read_truth(tmp_path / "one.txt", "samples").at(np.arange(3))[:, :, 0], [[3.5], [np.nan], [-10]]
    )
    (tmp_path / "two.txt").write_text("1, nan\n2 7\n")
    np.testing.assert_array_equal(
        read_truth(tmp_path / "two.txt", "samples").at(np.arange(2))[:, :, 0], [[1, np.nan], [2, 7]]
    )


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "holds no position"),
        ("1\n2 3\n", "line 2: '2 3' has 2 places, the first line 1"),
        ("1\nx\n", "line 2: 'x' is no place"),
        ("1\ninf\n", "line 2: 'inf' is no place"),
        ("1_000\n", "line 1: '1_000' is no place"),
    ],
)
def test_a_truth_that_is_none_is_said(tmp_path: Path, content: str, sentence: str) -> None:
    (tmp_path / "t.txt").write_text(content)
    with pytest.raises(DataError, match=sentence):
        read_truth(tmp_path / "t.txt", "samples")
