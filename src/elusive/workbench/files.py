"""Files that a page's user names or sends: inside one folder, small, of known kinds, and never trusted."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from elusive.errors import DataError, ElusiveError

Read = TypeVar("Read")
UPLOAD_MOST_BYTES = 64 * 1024 * 1024
FOLDER = "runs"  # where a workbench keeps them, in its folder
CONFIG, SCENE = "config.yaml", "scene.yaml"  # of results: how they were tracked, and what was simulated for it
SCENES = (".yaml", ".yml")
PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}")


def inside(folder: Path, name: str, kinds: Sequence[str]) -> Path:
    """Return the file of that name in the folder.

    Parameters
    ----------
    folder
        The one folder a page may use.
    name
        As the user gave it.
    kinds
        Endings that are allowed, ``.csv``.

    Raises
    ------
    DataError
        If the name is no plain name of a file in the folder, or of another kind.
    """
    if not PLAIN.fullmatch(name):
        raise DataError(f"{name!r:.60}: is no plain file name; use letters, digits, '.', '-' and '_', and no folder.")
    path = (folder / name).resolve()
    if path.suffix.lower() not in kinds:
        raise DataError(f"{name}: has no ending of {', '.join(kinds)}; name it so.")
    if not path.is_relative_to(folder.resolve()):
        raise DataError(f"{name}: leads out of the workbench's folder; choose a file in it.")
    return path


def read_upload(name: str, data: bytes, kinds: Sequence[str], read: Callable[[Path], Read]) -> Read:
    """Let a reader of the library judge what was sent.

    Parameters
    ----------
    name
        As the browser gave it: its ending alone is used, and the name in sentences.
    data
        What was sent.
    kinds
        Endings that are allowed.
    read
        Reads a path.

    Raises
    ------
    DataError
        If it is too large, of another kind, or cannot be read; the sentence is the reader's.
    """
    shown = re.sub(r"[^A-Za-z0-9 ._-]", "_", Path(name.replace("\\", "/")).name)[-80:] or "upload"
    suffix = Path(shown).suffix.lower()
    if suffix not in kinds:
        raise DataError(f"{shown}: is of no kind that is read here; send {', '.join(kinds)}.")
    if len(data) > UPLOAD_MOST_BYTES:
        raise DataError(f"{shown}: holds {len(data)} bytes, more than {UPLOAD_MOST_BYTES}; send a shorter one.")
    with tempfile.TemporaryDirectory(prefix="elusive-") as folder:
        path = Path(folder) / f"upload{suffix}"
        path.write_bytes(data)
        try:
            return read(path)
        except ElusiveError as error:
            raise DataError(str(error).replace(str(path), shown)) from None


def stranger(folder: Path, path: Path) -> str:
    """Return the name of what in a folder leads out of the one folder a page may use; empty if nothing does."""
    home = folder.resolve()
    inner = path.iterdir() if path.is_dir() else ()
    return next((one.name for one in inner if not one.resolve().is_relative_to(home)), "")


def scene_in(folder: Path, name: str) -> Path:
    """Return a scene of that name in the folder, or the one in a folder of results.

    Raises
    ------
    DataError
        If there is none.
    """
    path = inside(folder, name, (*SCENES, ""))
    path = path / SCENE if path.is_dir() else path
    if not path.is_file() or not path.resolve().is_relative_to(folder.resolve()):
        raise DataError(f"{name}: is no scene in the workbench's folder; put it there.")
    return path


def in_folder(folder: Path) -> list[str]:
    """Return what stands in a workbench's folder and can be a recording or a part of one."""
    return sorted(one.name for one in folder.iterdir() if PLAIN.fullmatch(one.name) and one.name != FOLDER)
