"""Files and folders that appear whole or not at all: write beside, then rename."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from elusive.errors import DataError


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside ``path`` to write to; it takes its name when the block ends well.

    If the block raises (Ctrl-C too), the temporary file is removed and an earlier file of that name stays as it was.
    What is there but no regular file (``/dev/stdout``, a pipe) is written to directly.

    Raises
    ------
    DataError
        If the folder does not exist, the path is a folder, or the system refuses to write.
    """
    target = Path(os.path.realpath(path))
    with refused(path):
        if target.is_dir():
            raise DataError(f"{path}: is a folder; give the name of a file.")
        if not target.parent.is_dir():
            raise DataError(f"{path}: there is no folder {target.parent}; create it or choose another.")
        if target.exists() and not target.is_file():
            yield target
            return
        temporary = target.with_name(f".{secrets.token_hex(4)}{target.suffix}")
        try:
            yield temporary
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(out: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary folder to work in; its files go to ``out`` when the block ends well.

    A new ``out`` appears in one rename. Into one that exists, the files are moved one by one, each replacing the file
    of its name; other files stay. If the block raises (Ctrl-C too), nothing is left behind, not even a new ``out``.

    Raises
    ------
    DataError
        If ``out`` is a file, a file would replace a folder or the reverse, or the system refuses to write.
    """
    target = Path(os.path.realpath(out))
    with refused(out):
        if target.exists() and not target.is_dir():
            raise DataError(f"{out}: is a file; give the name of a folder.")
        existed = target.is_dir()
        made = [] if existed else [parent for parent in target.parents if not parent.exists()]
    # Inside an existing folder, because its parent may be read-only or another disk (a home, a mount).
    temporary = (target if existed else target.parent) / f".{secrets.token_hex(4)}.part"
    try:
        with refused(out):
            temporary.mkdir(parents=True)
        try:
            yield temporary
        except DataError as error:
            if str(temporary) not in str(error):
                raise
            raise DataError(str(error).replace(str(temporary), str(out))) from None  # the folder that the user named
        with refused(out):
            if existed:
                _move_into(temporary, target)
            else:
                os.rename(temporary, target)
                made.clear()
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        for parent in made:
            if parent.is_dir() and not any(parent.iterdir()):
                parent.rmdir()


def existing_folder(out: str | os.PathLike[str]) -> Path:
    """Return a folder, made if need be, for results that are added to it one by one.

    Raises
    ------
    DataError
        If it is a file or cannot be made.
    """
    folder = Path(out)
    if folder.exists() and not folder.is_dir():
        raise DataError(f"{out}: is a file; give the name of a folder.")
    with refused(out):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


@contextmanager
def refused(out: str | os.PathLike[str] | None) -> Iterator[None]:
    """Turn a refusal of the system to write there into a sentence: a DataError."""
    try:
        yield
    except OSError as error:
        raise DataError(f"{out}: cannot be written ({error.strerror or error}); check space and permissions.") from None


def _move_into(source: Path, target: Path) -> None:
    made = sorted(source.rglob("*"))
    for path in made:
        goal = target / path.relative_to(source)
        if goal.exists() and goal.is_dir() != path.is_dir():
            raise DataError(
                f"{goal}: is in the way, a file where a folder goes or the reverse; move it or choose another."
            )
    for path in made:
        goal = target / path.relative_to(source)
        if path.is_dir():
            goal.mkdir(exist_ok=True)
        else:
            os.replace(path, goal)
