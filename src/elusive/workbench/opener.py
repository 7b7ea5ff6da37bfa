"""Opens a file for a page: from the one folder, or sent by the browser: into memory and no more, or into the folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from nicegui import ui

from elusive.errors import DataError, ElusiveError
from elusive.workbench.files import PLAIN, UPLOAD_MOST_BYTES, inside, read_upload, scene_in
from elusive.workbench.jobs import away
from elusive.workbench.parts import errors_shown, refuse
from elusive.workbench.settings import SETTINGS

Read = TypeVar("Read")
MOST = f"{UPLOAD_MOST_BYTES >> 20} MiB"
# Quasar's own has a picture without a name, and a size of what is not yet sent
HEADER = """<q-btn flat no-caps type="a" icon="upload_file" class="full-width" align="left" label="{}"
  @click="props.pickFiles"><q-uploader-add-trigger /></q-btn>"""


def opener(
    what: str, kinds: Sequence[str], read: Callable[[Path], Read], take: Callable[[str, Read], Any]
) -> None:  # fmt: skip
    """Build what opens a file.

    Parameters
    ----------
    what
        What is opened, as one says it: ``frames``.
    kinds
        Endings that are read.
    read
        Reads it whole from a path; done off the event loop.
    take
        Is given its name and what was read.
    """

    async def named() -> None:
        with errors_shown():
            found = name.value or ""
            take(found, await away(lambda: read_named(SETTINGS.folder, found, kinds, read)))

    async def sent(event: Any) -> None:
        event.sender.reset()
        data = await event.file.read()
        with errors_shown():
            take(event.file.name, await away(lambda: read_upload(event.file.name, data, kinds, read)))

    words = ", ".join(kinds)
    ui.label(f"From the workbench's folder, or sent: {words}").classes("ew-note")
    with ui.element("div").classes("ew-row w-full"):
        name = ui.input(f"Name of {what}").props("dense outlined").classes("grow")
        name.on("keydown.enter", named)
        ui.button("Open", on_click=named).props(f'outline no-caps aria-label="Open {what}"')
    uploader(f"Or send {what} from this computer", sent, kinds)


def sender(label: str, take: Callable[[str], Any], *, several: bool = True) -> None:
    """Build what sends files to the workbench's folder; ``take`` is given the name of each that has come."""

    async def sent(event: Any) -> None:
        event.sender.reset()
        data = await event.file.read()
        name = Path(event.file.name.replace("\\", "/")).name
        with errors_shown():
            if not PLAIN.fullmatch(name):
                raise DataError(f"{name!r:.60}: is no plain file name; use letters, digits, '.', '-' and '_'.")
            if (SETTINGS.folder / name).exists():
                raise DataError(f"{name}: is in the workbench's folder already; rename yours, or choose that one.")
            await away(lambda: (SETTINGS.folder / name).write_bytes(data))
            take(name)

    uploader(label, sent, several=several)


def uploader(label: str, take: Callable[[Any], Any], kinds: Sequence[str] = (), *, several: bool = False) -> None:
    """Build a button that sends a file of some kinds, or of any; ``take`` is given the event of each."""
    what = f"send one of {', '.join(kinds)}, {MOST} at most" if kinds else f"{MOST} at most; copy it yourself"
    made = ui.upload(
        label=label, auto_upload=True, multiple=several, on_upload=take, max_file_size=UPLOAD_MOST_BYTES,
        on_rejected=lambda: refuse(f"The file is refused: {what}."), max_files=None if several else 1,
    ).props("flat bordered").classes("w-full")  # fmt: skip
    if kinds:
        made.props(f'accept="{",".join(kinds)}"')
    made.add_slot("header", HEADER.format(escape(label)))


def open_scene(file: str, take: Callable[[Path], Any], then: str = "press Run") -> None:
    """Let a page take a scene of the folder, if one shall be opened; ``then``: what a person does next."""
    if file:
        with errors_shown():
            take(scene_in(SETTINGS.folder, file))
            ui.notify(f"{file} is open: {then}.", type="positive")


def read_named(folder: Path, name: str, kinds: Sequence[str], read: Callable[[Path], Read]) -> Read:
    """Read a file of that name in the folder.

    Raises
    ------
    DataError
        If it is not there, leads out of the folder, is of another kind, or cannot be read.
    """
    path = inside(folder, name, kinds)
    if not path.exists():
        raise DataError(f"{name}: is not in the workbench's folder; put it there, or send it.")
    try:
        return read(path)
    except ElusiveError as error:
        raise DataError(str(error).replace(str(path), name)) from None
