"""A live run's checkpoint: after a kill it goes on with the numbers of its tracks, and nothing is told twice."""

from __future__ import annotations

import hashlib
import os
import pickle
import struct
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from elusive.errors import DataError
from elusive.io.atomic import existing_folder
from elusive.tracking.memory import Memory

EVERY_S = 1.0  # at most so long between two, and where a track begins or ends at once
STATE, MARK = "state.bin", "told.bin"
TIME = struct.Struct("<d")
OWN = 0o600


class Saved(NamedTuple):
    """What stands in a checkpoint."""

    digest: str  # of what was run
    unix_s: float  # when it was saved
    time_s: float
    first: Any
    held: Any
    told: Any  # what is known of what was told: see :attr:`elusive.io.sinks.Sinks.state`


class Checkpoint:
    """Keeps a run's memory in a folder that is this user's alone.

    A number that was told is in the state that stands in the file, for that is written before it is told; and a time
    that was told is not told again.

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
        folder.chmod(0o700)
        self._mark = _alone(folder / MARK)
        try:
            self.saved = self._read()
        except DataError:
            self.close()
            raise
        self._tracks: dict[int, str] = {}
        self._due_s = 0.0
        told = os.pread(self._mark, TIME.size, 0)
        self.told_s = TIME.unpack(told)[0] if self.saved is not None and len(told) == TIME.size else -float("inf")
        """Time of the last step that was told before."""

    @property
    def memory(self) -> Memory:
        """What a tracker goes on from; empty where nothing was saved."""
        saved = self.saved
        if saved is None:
            return Memory()
        return Memory(saved.held, saved.first, saved.time_s, max(0.0, time.time() - saved.unix_s))

    def keep(self, memory: Memory, record: Mapping[str, Any], told: Any) -> None:
        """Save what is due, before a step is told.

        Raises
        ------
        DataError
            If the system refuses to write.
        """
        tracks = {track["track"]: track["status"] for track in record["tracks"]}
        now_s = time.monotonic()
        if memory.held is not None and (tracks != self._tracks or now_s >= self._due_s):
            saved = Saved(self._digest, time.time(), memory.time_s, memory.first, memory.held, told)
            try:
                octets = pickle.dumps(tuple(saved), protocol=pickle.HIGHEST_PROTOCOL)
                temporary = self._folder / f".{STATE}"
                with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, OWN), "wb") as file:
                    file.write(octets)
                temporary.replace(self._folder / STATE)
            except OSError as error:
                raise DataError(
                    f"{self._folder}: the checkpoint cannot be written ({error.strerror or error}); check space."
                ) from None
            except (pickle.PicklingError, AttributeError, TypeError) as error:
                raise DataError(f"{self._folder}: this tracker's state cannot be kept ({error}).") from None
            self._tracks, self._due_s = tracks, now_s + EVERY_S
        os.pwrite(self._mark, TIME.pack(record["time_s"]), 0)

    def close(self) -> None:
        """Close its files."""
        os.close(self._mark)

    def _read(self) -> Saved | None:
        path = self._folder / STATE
        if not path.exists():
            return None
        of = path.stat()
        # a pickle runs what it says: it is read only where nobody else can have written it
        if hasattr(os, "getuid") and (of.st_uid != os.getuid() or of.st_mode & 0o022):
            raise DataError(f"{path}: may be written by others, and is not read; remove it.")
        try:
            saved = Saved(*pickle.loads(path.read_bytes()))
        except Exception as error:  # of another version: anything
            raise DataError(f"{path}: is no checkpoint of this version ({error}); remove it to begin anew.") from None
        if saved.digest != self._digest:
            raise DataError(f"{path}: is of another configuration; remove it to begin anew, or name another folder.")
        return saved


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
