"""Lines that a full disk refuses: held, written whole and once, and what a kill has cut left alone."""

from __future__ import annotations

import errno
import os

import pytest

from elusive.errors import DataError
from elusive.io import added_file
from elusive.io.added_file import AddedFile, HeldFile


@pytest.fixture
def disk(monkeypatch):
    """How many octets there is room for; None: for all."""
    room, write = [None], os.write

    def writing(descriptor, octets):
        if room[0] is None:
            return write(descriptor, octets)
        taken = min(room[0], len(octets))
        room[0] -= taken
        if not taken:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, octets[:taken])

    monkeypatch.setattr(os, "write", writing)
    monkeypatch.setattr(added_file, "AGAIN_S", 0.0)
    return room


def test_lines_are_held_while_the_disk_is_full_and_none_is_cut(tmp_path, disk):
    said, path = [], tmp_path / "t.csv"
    file = HeldFile(path, "head\n", said.append)
    for number in range(40):
        disk[0] = {10: 3, 20: None}.get(number, disk[0])
        file.write(f"line {number}\n")
        file.flush()
        whole = [f"line {k}" for k in range(number + 1 if number < 10 or number >= 20 else 10)]
        assert path.read_text().splitlines()[: len(whole) + 1] == ["head", *whole]
    file.close()
    assert path.read_text() == "head\n" + "".join(f"line {k}\n" for k in range(40))
    assert len(said) == 2  # once that it is gone, once that it is back
    assert "No space left on device" in said[0]
    assert "11 lines were held, 0 lost" in said[1]


def test_what_is_held_is_bounded_and_the_loss_is_told(tmp_path, disk, monkeypatch):
    monkeypatch.setattr(added_file, "MOST", 60)
    said, path = [], tmp_path / "t.csv"
    file = HeldFile(path, "", said.append)
    disk[0] = 4  # a part of the first stands there, and is completed
    for number in range(10, 30):
        file.write(f"line {number}\n")
        file.flush()
    disk[0] = None
    file.close()
    assert path.read_text().splitlines() == ["line 10", *(f"line {k}" for k in range(23, 30))]
    assert "7 lines were held, 13 lost" in said[1]


def test_what_cannot_be_written_at_the_end_is_told(tmp_path, disk):
    file = HeldFile(tmp_path / "t.csv", "", print)
    disk[0] = 0
    file.write("a\n")
    with pytest.raises(DataError, match="1 lines could not be written any more"):
        file.close()


def test_a_disk_that_is_full_from_the_start_is_refused(tmp_path, disk):
    disk[0] = 0
    with pytest.raises(DataError, match="No space left on device"):
        HeldFile(tmp_path / "t.csv", "head\n", print)


def test_after_a_line_that_a_kill_has_cut_a_new_one_begins(tmp_path):
    path = tmp_path / "told"
    for before, after in ((b"", b"x\n"), (b"a\n", b"a\nx\n"), (b"a\nhal", b"a\nhal\nx\n")):
        path.write_bytes(before)
        file = AddedFile(path)
        file.send(b"x\n")
        file.close()
        assert path.read_bytes() == after


@pytest.mark.skipif(os.name == "nt", reason="Windows moves no open file")
def test_a_file_that_was_moved_away_begins_with_the_head(tmp_path, disk):
    file = AddedFile(tmp_path / "t.csv", b"head\n")
    file.send(b"a\n")
    disk[0] = 1
    line = b"lost\n"
    with pytest.raises(OSError, match="No space"):
        file.send(line)
    (tmp_path / "t.csv").rename(tmp_path / "old.csv")
    disk[0] = None
    file.send(line)
    file.close()
    assert (tmp_path / "t.csv").read_text() == "head\nlost\n"
