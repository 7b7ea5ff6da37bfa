"""A checkpoint is whole at any time: killed while it is written, on a full disk, beside another run's."""

from __future__ import annotations

import errno
import os

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.results import checkpoint
from elusive.results.checkpoint import STATES, Checkpoint
from elusive.tracking.memory import Memory

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows writes at no place")


def told(time_s, *numbers):
    return {"time_s": time_s, "tracks": [{"track": number, "status": "confirmed"} for number in numbers]}


def kept(folder, *steps, size=100):
    """Keep steps, each with a track that begins; return what was said."""
    one, memory = Checkpoint(folder, "run"), Memory()
    said = []
    for k in steps:
        memory.keep(float(k), np.full(size, k))
        memory.place = ("frame", k)
        said.append(one.keep(memory, told(float(k), k), k))
    one.close()
    return said


def known(folder):
    one = Checkpoint(folder, "run")
    one.close()
    return one


def test_the_newest_is_gone_on_from(tmp_path):
    assert known(tmp_path).memory.held is None
    assert kept(tmp_path, 1, 2, 3) == ["", "", ""]
    one = known(tmp_path)
    assert (one.memory.time_s, one.told_s, one.memory.place, one.saved.told) == (3.0, 3.0, ("frame", 3), 3)
    kept(tmp_path, 4)
    assert known(tmp_path).memory.time_s == 4.0


def test_a_track_that_is_shown_from_now_on_is_in_the_state_before_it_is_told(tmp_path, monkeypatch):
    """Its age was counted from the restart."""
    monkeypatch.setattr(checkpoint, "SHARE", 1e9)
    monkeypatch.setattr(checkpoint, "EVERY_S", 1e9)
    one, memory = Checkpoint(tmp_path, "run"), Memory()
    for k, shown in enumerate((0.0, 0.0, 1.0, 1.0)):
        memory.keep(float(k), k)
        one.keep(memory, {"time_s": float(k), "tracks": [{"track": 1, "status": "confirmed", "shown": shown}]}, k)
    one.close()
    assert known(tmp_path).saved.told == 2


@pytest.mark.parametrize("steps", [4, 5])
def test_killed_while_it_is_written_the_one_before_stands(tmp_path, steps):
    kept(tmp_path, *range(steps))
    newest = tmp_path / STATES[steps % 2]
    octets = bytearray(newest.read_bytes())
    octets[150] ^= 1
    newest.write_bytes(octets)
    assert known(tmp_path).memory.time_s == steps - 2
    kept(tmp_path, 9)  # in place of the one that is cut
    assert known(tmp_path).memory.time_s == 9


def test_killed_while_the_first_is_written_it_begins(tmp_path):
    kept(tmp_path, 1)
    path = tmp_path / STATES[1]
    path.write_bytes(path.read_bytes()[:200])
    assert known(tmp_path).memory.held is None


def test_where_neither_is_whole_it_is_said(tmp_path):
    kept(tmp_path, 1, 2)
    for name in STATES:
        (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[:200])
    with pytest.raises(DataError, match="neither of its checkpoints is whole"):
        known(tmp_path)


def test_a_disk_that_is_full_later_does_not_matter(tmp_path):
    """Each file has room for a state twice as large: none of the next needs more of the disk."""
    kept(tmp_path, 1, 2, size=20_000)
    sizes = [(tmp_path / name).stat().st_size for name in STATES]
    kept(tmp_path, 3, 4, 5, size=39_000)
    assert [(tmp_path / name).stat().st_size for name in STATES] == sizes
    assert known(tmp_path).memory.held[0].tolist() == [5] * 39_000


def test_what_cannot_be_kept_is_said_once_and_tracking_goes_on(tmp_path, monkeypatch):
    one, memory, write, gone = Checkpoint(tmp_path, "run"), Memory(), os.pwrite, []

    def writing(descriptor, octets, offset):
        if gone:
            raise OSError(errno.EIO, "Input/output error")
        return write(descriptor, octets, offset)

    monkeypatch.setattr(os, "pwrite", writing)
    said = []
    for k in range(6):
        gone[:] = [1] if 2 <= k < 4 else []
        memory.keep(float(k), k)
        said.append(one.keep(memory, told(float(k), k), k))
    one.close()
    assert [bool(sentence) for sentence in said] == [False, False, True, False, True, False]
    assert "cannot be written (Input/output error); tracking goes on" in said[2]
    assert "is written again after" in said[4]
    assert known(tmp_path).memory.time_s == 5.0


def test_another_runs_is_refused(tmp_path):
    kept(tmp_path, 1)
    with pytest.raises(DataError, match="of another configuration"):
        Checkpoint(tmp_path, "something else")


def test_of_an_earlier_version_is_refused(tmp_path):
    (tmp_path / STATES[0]).write_bytes(b"?" * 200)
    (tmp_path / STATES[0]).chmod(0o600)
    with pytest.raises(DataError, match="is no checkpoint of this version"):
        known(tmp_path)
    assert checkpoint.OWN == 0o600


@pytest.mark.parametrize(("cost_s", "behind"), [(0.001, 1), (0.004, 6), (10.0, 83)])
def test_the_state_is_as_new_as_a_twentieth_of_the_time_allows(tmp_path, monkeypatch, cost_s, behind):
    """Of a source that cannot be read again, what the state does not know is lost at a kill."""
    now, write = [0.0], os.pwrite

    def slow(descriptor, octets, place):
        now[0] += cost_s * (len(octets) > checkpoint.TIME.size)
        return write(descriptor, octets, place)

    monkeypatch.setattr(os, "pwrite", slow)
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: now[0])
    one, memory, lags = Checkpoint(tmp_path, "run"), Memory(), []
    saved = [0.0]
    monkeypatch.setattr(one, "_save", lambda state, save=one._save: (saved.append(state.time_s), save(state)))
    for k in range(100):
        now[0] += 0.012
        memory.keep(float(k), np.full(100, k))
        one.keep(memory, told(float(k), 1), k)
        lags.append(k - saved[-1])
    one.close()
    assert max(lags) == behind
