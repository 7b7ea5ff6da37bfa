"""What a recording is that is chosen, told and shown below its name before anything runs."""

from __future__ import annotations

import os

from nicegui import ui

from elusive.checks import Looked, broken
from elusive.errors import ElusiveError
from elusive.report import drawing as draw
from elusive.workbench.asking import FOLLOW, Asking, refused
from elusive.workbench.forms import in_plain_words
from elusive.workbench.guessing import kind_of
from elusive.workbench.jobs import away
from elusive.workbench.parts import Drawing
from elusive.workbench.run_state import RunState
from elusive.workbench.settings import SETTINGS
from elusive.workbench.tables import look_at_table


class Look:
    """A look at the recording that a command is given; at nothing live.

    Parameters
    ----------
    asked
        The command, which looks.
    state
        What the tab holds: what is given to it, by name; and why the last run was refused, which is not said twice.
    """

    def __init__(self, asked: Asking, state: RunState) -> None:
        self._asked, self._recording = asked, asked._replace(asked=asked.asked[:1])
        self._state, self._given = state, state.given[asked.noun]
        self._box = ui.column().classes("w-full gap-1 ew-look").props('role="status"')
        self.again()

    def again(self) -> None:
        """Look once more, as something else is chosen."""
        self._box.clear()
        with self._box:
            ui.timer(0.0, self._tell, once=True)

    async def _tell(self) -> None:
        name = str(self._given.get(self._recording.asked[0].name, ""))
        if not name or self._given.get(FOLLOW) or refused(self._recording, self._given, SETTINGS.folder):
            return
        looked = await away(lambda: self._looked(name))
        if self._box.is_deleted or name != self._given.get(self._recording.asked[0].name):  # another is chosen by now
            return
        with self._box:
            if isinstance(looked, str):
                why = in_plain_words(looked)
                ui.label(why).classes("ew-doubt").bind_visibility_from(
                    self._state, "refused", backward=lambda refused: refused != why
                )
                return
            if looked is None:
                return
            if looked.said:
                ui.label(looked.said)
            for one in broken(looked.findings):
                ui.label(in_plain_words(f"{one.sentence} {one.remedy}")).classes("ew-doubt")
            if looked.picture is not None:
                rows, columns = looked.picture.shape
                edges = (-0.5, columns - 0.5, -0.5, rows - 0.5)
                seen = draw.image(draw.scaled(looked.picture), edges, down=True)
                panel = draw.plane("One of them", edges, [seen], unit="px", down=True, bare=True, span=12)
                Drawing(draw.drawing(looked.said, [0.0], [panel]))

    def _known(self) -> dict[str, str | bool]:
        """Return what is given to the command, without files that are none of the folder's."""
        every = {one.name: one for one in self._asked.asked}
        return {
            name: value
            for name, value in self._given.items()
            if (one := every.get(name)) is None
            or not (one.is_file and refused(self._asked._replace(asked=(one,)), self._given, SETTINGS.folder))
        }

    def _looked(self, name: str) -> Looked | str | None:
        """Return what it is, as far as that can be told, or why it cannot be read here."""
        path, here = SETTINGS.folder / name, self._recording.noun
        other = kind_of(path)
        for one in SETTINGS.recordings:
            if one.noun == other != here:
                return f"{name}: looks like {one.name}, which is another kind of recording; choose that to open it."
        if path.is_file() and not path.stat().st_size:
            return f"{name}: is empty; choose another, or write it again."
        try:
            return look_at_table(path) if self._recording.look is None else self._recording.look(path, self._known())
        except ElusiveError as error:
            return str(error).replace(f"{SETTINGS.folder}{os.sep}", "")
