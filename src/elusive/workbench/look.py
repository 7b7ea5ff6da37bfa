"""What a recording is that is chosen, told and shown below its name before anything runs."""

from __future__ import annotations

from collections.abc import Mapping

from nicegui import ui

from elusive.checks import Looked, broken
from elusive.errors import ElusiveError
from elusive.report import drawing as draw
from elusive.workbench.asking import FOLLOW, Asking, refused
from elusive.workbench.jobs import away
from elusive.workbench.parts import Drawing
from elusive.workbench.settings import SETTINGS


class Look:
    """A look at the recording that a command is given; at nothing live.

    Parameters
    ----------
    asked
        The command, which looks.
    given
        What is given to it, by name.
    """

    def __init__(self, asked: Asking, given: Mapping[str, str | bool]) -> None:
        self._recording = asked._replace(asked=asked.asked[:1])
        self._given = given
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
                ui.label(looked).classes("ew-doubt")
                return
            ui.label(looked.said)
            for one in broken(looked.findings):
                ui.label(f"{one.sentence} {one.remedy}").classes("ew-doubt")
            if looked.picture is not None:
                rows, columns = looked.picture.shape
                edges = (-0.5, columns - 0.5, -0.5, rows - 0.5)
                seen = draw.image(draw.scaled(looked.picture), edges, down=True)
                panel = draw.plane("One of them", edges, [seen], unit="px", down=True, bare=True, span=12)
                Drawing(draw.drawing(looked.said, [0.0], [panel]))

    def _looked(self, name: str) -> Looked | str:
        """Return what it is, or why it cannot be read."""
        path = SETTINGS.folder / name
        assert self._recording.look is not None
        try:
            return self._recording.look(path)
        except ElusiveError as error:
            return str(error).replace(str(path), name)
