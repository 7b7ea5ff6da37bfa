"""A live run's checkpoint: after a kill it goes on with the numbers of its tracks, and nothing is told twice."""

from __future__ import annotations

import hashlib
import math
import os
import pickle
import struct
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from elusive.errors import DataError
from elusive.io.atomic import existing_folder, refused
from elusive.io.sinks.seen import is_shown
from elusive.tracking.memory import Memory

EVERY_S = 1.0  # at most so long between two, and where a track begins, ends, is shown or hidden at once
SHARE = 20  # between two passes so many times what one takes: what was measured since is not in the state
STATES, MARK = ("state.bin", "spare.bin"), "told.bin"
TIME = struct.Struct("<d")
HEAD = struct.Struct("<8sQQ32s")  # what it is, its number, the state's length and digest
KIND = b"elusive\x06"
ROOM = 1 << 16  # a file is so many times as large, with room for twice the state: a full disk refuses none of the next
OWN = 0o600


class Saved(NamedTuple):
    """What stands in a checkpoint."""

    digest: str  # of what was run
    unix_s: float  # when it was saved
    held: Any
    first: Any
    time_s: float
    place: Any
    told: Any  # what is known of what was told: see :attr:`elusive.io.sinks.Sinks.state`


class Checkpoint:
    """Keeps a run's memory in a folder that is this user's alone.

    A number that was told is in the state that stands in the file, for that is written before it is told; and a time
    that was told is not told again. Of two files the older is written over in its place: one is whole at any time, and
    a disk that is full later does not matter.

    Parameters
    ----------
    folder
        Made if need be.
    what
        What is run; the checkpoint of something else is refused.

    Raises
    ------
    DataError
        If it holds another run's, belongs to another user, is another process's now, or cannot be read or written.
    """

    def __init__(self, folder: Path, what: str) -> None:
        self._folder, self._digest = existing_folder(folder), hashlib.sha256(what.encode()).hexdigest()
        with refused(folder):
            folder.chmod(0o700)
            self._mark = _alone(folder / MARK)
        self._states: list[int] = []
        try:
            with refused(folder):
                for name in STATES:
                    self._states.append(_own(folder / name))
                self.saved = self._read()
                if not os.fstat(self._mark).st_size:
                    os.pwrite(self._mark, TIME.pack(-math.inf), 0)  # its place is had from now on
        except DataError:
            self.close()
            raise
        self._tracks: dict[int, tuple[str, bool]] = {}
        self._due_s, self._gone_s = 0.0, math.nan
        told = os.pread(self._mark, TIME.size, 0)
        self.told_s = TIME.unpack(told)[0] if self.saved is not None and len(told) == TIME.size else -math.inf
        """Time of the last step that was told before."""

    @property
    def memory(self) -> Memory:
        """What a tracker goes on from; empty where nothing was saved."""
        saved = self.saved
        if saved is None:
            return Memory()
        return Memory(saved.held, saved.first, saved.time_s, max(0.0, time.time() - saved.unix_s), saved.place)

    def keep(self, memory: Memory, record: Mapping[str, Any], told: Any) -> str:
        """Save what is due, before a step is told; returns what is to be said, where the system begins to refuse it.

        Raises
        ------
        DataError
            If the tracker's state cannot be kept at all.
        """
        tracks = {track["track"]: (track["status"], is_shown(track)) for track in record["tracks"]}
        now_s, said = time.monotonic(), ""
        try:
            if memory.held is not None and (tracks != self._tracks or now_s >= self._due_s):
                self._save(Saved(self._digest, time.time(), *memory.kept, told))
                saved_s = time.monotonic()
                self._tracks, self._due_s = tracks, saved_s + min(EVERY_S, SHARE * (saved_s - now_s))
                if not math.isnan(self._gone_s):
                    said = f"{self._folder}: the checkpoint is written again after {now_s - self._gone_s:.1f} s."
                self._gone_s = math.nan
            os.pwrite(self._mark, TIME.pack(record["time_s"]), 0)
        except OSError as error:
            if not math.isnan(self._gone_s):
                return ""
            self._gone_s = now_s
            said = (
                f"{self._folder}: the checkpoint cannot be written ({error.strerror or error}); tracking goes on, but "
                "killed now it would begin again from the one before, and numbers told since may come twice."
            )
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise DataError(f"{self._folder}: this tracker's state cannot be kept ({error}).") from None
        return said

    def close(self) -> None:
        """Close its files."""
        for descriptor in (self._mark, *self._states):
            os.close(descriptor)

    def _save(self, saved: Saved) -> None:
        state = pickle.dumps(tuple(saved), protocol=pickle.HIGHEST_PROTOCOL)
        head = HEAD.pack(KIND, self._number + 1, len(state), hashlib.sha256(state).digest())
        descriptor = self._states[(self._number + 1) % len(STATES)]
        room = os.fstat(descriptor).st_size - HEAD.size - len(state)
        if room < 0:
            room = len(state) + -(HEAD.size + 2 * len(state)) % ROOM
            state += bytes(room)
        rest = memoryview(head + state)
        while len(rest):
            rest = rest[os.pwrite(descriptor, rest, len(head) + len(state) - len(rest)) :]
        self._number += 1

    def _read(self) -> Saved | None:
        """Return the newest state that is whole, if there is one."""
        self._number, found, torn = 0, None, 0
        for name, descriptor in zip(STATES, self._states, strict=True):
            path, size = self._folder / name, os.fstat(descriptor).st_size
            if not size:
                continue
            octets = os.pread(descriptor, size, 0)
            if len(octets) < HEAD.size or not octets.startswith(KIND):
                raise DataError(f"{path}: is no checkpoint of this version; remove it to begin anew.")
            _, number, length, digest = HEAD.unpack_from(octets)
            state = octets[HEAD.size : HEAD.size + length]
            if hashlib.sha256(state).digest() != digest:
                torn += 1  # killed as it was written: the other one stands
            elif number > self._number:
                self._number, found = number, (path, state)
        if found is None:
            if torn == len(STATES):
                raise DataError(f"{self._folder}: neither of its checkpoints is whole; remove them to begin anew.")
            return None
        path, state = found
        try:
            saved = Saved(*pickle.loads(state))
        except Exception as error:  # of another version: anything
            raise DataError(f"{path}: is no checkpoint of this version ({error}); remove it to begin anew.") from None
        if saved.digest != self._digest:
            raise DataError(f"{path}: is of another configuration; remove it to begin anew, or name another folder.")
        return saved


def _own(path: Path) -> int:
    """Open a file, made if need be, that nobody else can have written: a pickle runs what it says.

    Raises
    ------
    DataError
        If somebody else can.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, OWN)
    of = os.fstat(descriptor)
    if hasattr(os, "getuid") and (of.st_uid != os.getuid() or of.st_mode & 0o022):
        os.close(descriptor)
        raise DataError(f"{path}: may be written by others, and is not read; remove it.")
    return descriptor


def _alone(path: Path) -> int:
    """Open a file that no other process has; the system lets go of it when this one ends, however that comes.

    Raises
    ------
    DataError
        If another has it.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, OWN)
    if sys.platform == "win32":
        return descriptor
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise DataError(f"{path.parent}: another run is going on from it; end that, or name another folder.") from None
    except OSError:  # a file system without locks
        pass
    return descriptor
