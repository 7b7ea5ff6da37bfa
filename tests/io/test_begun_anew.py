"""Files that are begun anew while they are followed: read from their start, told once, whatever stands in them."""

from __future__ import annotations

import os
import struct
import threading
import wave
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io._signal_csv import open_table
from elusive.io.live_signals import follow_signal
from elusive.io.sources import Feed, in_order, lines_of
from tests.processes import HUNG_S

HEADER = "time_s,range_m,bearing_deg\n"


class Meanwhile(threading.Event):
    """What happens while a reader waits at the end of a file."""

    def __init__(self, *happens):
        super().__init__()
        self.happens = list(happens)

    def wait(self, timeout=None):
        if self.happens:
            self.happens.pop(0)()
        return super().wait(timeout)


def followed(*happens, said=None):
    feed = Feed(HUNG_S, say=[].append if said is None else said.append)
    feed.halted = Meanwhile(*happens)
    return feed


def rows(first, last):
    return "".join(f"{k},{1000 + k},{10 + k}\n" for k in range(first, last))


def cut_short(path, text):
    path.write_text(text)


def written_over(path, text):
    with path.open("r+") as file:  # one that is longer than what was read takes its place at once
        file.write(text)


def replaced(path, text):
    beside = path.with_name("beside")
    beside.write_text(text)
    os.replace(beside, path)


def removed(path, text):
    path.unlink()
    path.write_text(text)


@pytest.mark.parametrize(
    ("how", "why", "count"),
    [
        (cut_short, "got shorter", 2),
        (written_over, "was written anew", 20),
        pytest.param(replaced, "is another file now", 20, marks=pytest.mark.skipif(os.name == "nt", reason="in use")),
        pytest.param(removed, "is another file now", 20, marks=pytest.mark.skipif(os.name == "nt", reason="in use")),
    ],
)
def test_lines_are_read_from_the_start_of_what_bears_the_name_now(tmp_path, how, why, count):
    path, said = tmp_path / "plots.csv", []
    path.write_text(HEADER + rows(0, 5))
    feed = followed(lambda: how(path, HEADER + rows(5, 5 + count)), said=said)
    lines = lines_of(str(path), feed)
    texts = [text for _, text in islice(lines, 6 + count)]  # the header that came again is passed over
    assert "".join(f"{text}\n" for text in texts) == HEADER + rows(0, 5 + count)
    assert len(said) == 1
    assert f"plots.csv: {why}; it is read from its start" in said[0]
    assert feed.counts == {"restarted": 1}
    lines.close()


@pytest.mark.skipif(os.name == "nt", reason="an open file is not moved there")
def test_what_was_added_to_the_old_file_last_is_read_before_the_new_one(tmp_path, monkeypatch):
    path = tmp_path / "plots.csv"
    path.write_text(HEADER + rows(0, 2))
    lines = lines_of(str(path), Feed(HUNG_S))
    assert len(list(islice(lines, 3))) == 3
    samestat = os.path.samestat

    def rotated(one, other):
        """The last line and the new file come between the look for more and the look at the name."""
        if not (tmp_path / "plots.1").exists():
            path.rename(tmp_path / "plots.1")
            with (tmp_path / "plots.1").open("a") as file:
                file.write(rows(2, 3))
            path.write_text(HEADER + rows(3, 4))
            one = path.stat()
        return samestat(one, other)

    monkeypatch.setattr(os.path, "samestat", rotated)
    assert [text for _, text in islice(lines, 2)] == (rows(2, 3) + rows(3, 4)).split()
    lines.close()


def test_columns_in_another_order_are_put_in_their_place_and_others_end_the_reading(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text(HEADER + rows(0, 3))
    later = ("bearing_deg,time_s,range_m\n13,3,1003\n", HEADER + "4,1004,14\n", "time_s,range_m,azimuth_deg\n")
    lines = lines_of(str(path), followed(*(partial(path.write_text, text) for text in later)))
    assert [text for _, text in islice(lines, 6)] == (HEADER + rows(0, 5)).split()
    with pytest.raises(DataError, match=r"line 9: the columns are 'time_s,range_m,azimuth_deg' from here on, and were"):
        next(lines)


def sound(path, samples, rate_hz=1000):
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate_hz)
        file.writeframes(samples.astype("<i2").tobytes())


def table(path, samples):
    frames = samples.reshape(-1, 10)
    path.write_text("a,b,c,d,e,f,g,h,i,j\n" + "".join(",".join(map(str, one)) + "\n" for one in frames.tolist()))


def raw(path, samples):
    path.write_bytes(samples.astype("<i2").tobytes())


KINDS = {
    "a.wav": (sound, {"frame_samples": 10}, 2.0**-15),
    "a.iq": (raw, {"frame_samples": 10, "raw": "s16", "rate_hz": 10.0}, 2.0**-15),
    "a.csv": (table, {"rate_hz": 10.0}, 1.0),
}


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("count", [10, 50])
def test_signals_are_read_from_their_start_and_their_frames_counted_on(tmp_path, name, count):
    write, how, scale = KINDS[name]
    path, said, samples = tmp_path / name, [], np.arange(80) * 100 + 7
    write(path, samples[:30])
    feed = followed(partial(write, path, samples[30 : 30 + count]), said=said)
    frames = iter(follow_signal(str(path), feed, **how))
    found = list(islice(frames, 3 + count // 10))
    frames.close()
    values = np.concatenate([frame.samples for frame in found])
    np.testing.assert_allclose(values, scale * samples[: 30 + count], rtol=1e-12)
    interval_s = 0.01 if name == "a.wav" else 0.1
    np.testing.assert_allclose([frame.time_s for frame in found], np.arange(len(found)) * interval_s)
    assert len(said) == 1
    assert "it is read from its start" in said[0]
    assert feed.counts["restarted"] == 1


@pytest.mark.parametrize("name", ["a.wav", "a.iq"])
@pytest.mark.parametrize("hop", [4, 10, 13])
@pytest.mark.parametrize("known", [0, 3])
def test_a_signal_is_gone_on_with_after_the_frame_that_was_known(tmp_path, name, hop, known):
    """It was read again from its start."""
    write, how, _ = KINDS[name]
    path, samples, how = tmp_path / name, np.arange(100) * 100 + 7, how | {"hop_samples": hop}
    write(path, samples)
    whole = list(follow_signal(str(path), Feed(0.0), **how))
    write(path, samples[: 10 + known * hop + 2])
    place = list(follow_signal(str(path), Feed(0.0), after=whole[0].place._replace(number=0), **how))
    place = ([whole[0], *place])[known].place
    write(path, samples)
    said = []
    later = list(follow_signal(str(path), Feed(0.0, say=said.append), after=place, **how))
    for one, same in zip(later, whole[known + 1 :], strict=True):
        assert one.time_s == same.time_s
        np.testing.assert_array_equal(one.samples, same.samples)
    assert not said


@pytest.mark.parametrize("name", ["a.wav", "a.iq"])
@pytest.mark.parametrize("count", [20, 50])
def test_a_signal_that_is_another_file_by_now_is_read_from_its_start_and_counted_on(tmp_path, name, count):
    """As many frames of it as were known of the other were passed over without a word."""
    write, how, scale = KINDS[name]
    path, said, samples = tmp_path / name, [], np.arange(80) * 100 + 7
    write(path, samples[:30])
    *_, last = follow_signal(str(path), Feed(0.0), **how)
    write(path, samples[30 : 30 + count])
    feed = Feed(0.0, say=said.append)
    found = list(follow_signal(str(path), feed, after=last.place, **how))
    np.testing.assert_allclose(np.concatenate([one.samples for one in found]), scale * samples[30 : 30 + count])
    interval_s = last.time_s / 2
    np.testing.assert_allclose([one.time_s for one in found], interval_s * (3 + np.arange(count // 10)))
    assert feed.counts == {"restarted": 1}
    assert len(said) == 1
    assert "was begun anew while nobody followed it; it is read from its start" in said[0]


def test_a_sound_whose_header_tells_its_length_anew_goes_on(tmp_path):
    path, said, samples = tmp_path / "a.wav", [], np.arange(60)
    sound(path, samples[:30])

    def added():
        octets = samples[30:].astype("<i2").tobytes()
        with path.open("r+b") as file:
            for at, size in ((4, 36), (40, 0)):
                file.seek(at)
                file.write(struct.pack("<I", size + 2 * len(samples)))
            file.seek(0, os.SEEK_END)
            file.write(octets)

    frames = iter(follow_signal(str(path), followed(added, said=said), frame_samples=10))
    found = np.concatenate([frame.samples for frame in islice(frames, 6)])
    frames.close()
    np.testing.assert_allclose(found, samples * 2.0**-15, rtol=1e-12)
    assert not said


def test_a_sound_of_another_rate_is_no_more_of_the_same(tmp_path):
    path = tmp_path / "a.wav"
    sound(path, np.arange(30))
    feed = followed(partial(sound, path, np.arange(20), rate_hz=2000))
    frames = iter(follow_signal(str(path), feed, frame_samples=10))
    list(islice(frames, 3))
    with pytest.raises(DataError, match="has 1 channels at 2000 Hz in blocks of 2 octets now, and had 1 at 1000 Hz"):
        next(frames)


def test_a_signal_whose_clock_begins_anew_goes_on_as_others_do(monkeypatch):
    """For five seconds earlier times are late; then they are counted on."""
    said, now = [], [100.0]
    times = [*range(50, 60), *range(10)]

    def written():
        yield 1, "time_s,a,b"
        for number, time_s in enumerate(times, 2):
            now[0] += 1.0
            yield number, f"{time_s},{number},4"

    monkeypatch.setattr("elusive.io._signal_csv.in_order", partial(in_order, now_s=lambda: now[0]))
    feed = Feed(say=said.append)
    found = [(number, time_s) for number, time_s, _ in open_table(Path("a.csv"), written(), feed).lines()]
    assert [time_s for _, time_s in found] == [*range(50, 60), 65, 66, 67, 68, 69]
    assert [number for number, _ in found] == [*range(2, 12), *range(17, 22)]
    assert feed.counts == {"late": 5, "clock set back": 1}
    assert "60.000 s are added to its times" in said[-1]
