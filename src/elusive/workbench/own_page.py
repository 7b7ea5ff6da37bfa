"""A person's own recording, of any kind: opened, tracked by the command itself, seen in its report, kept, compared."""

from __future__ import annotations

from elusive.workbench.files import in_folder
from elusive.workbench.own_runs import run_named
from elusive.workbench.parts import errors_shown
from elusive.workbench.run_state import RunState
from elusive.workbench.run_window import RunWindow
from elusive.workbench.session import state_of
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import OWN, head, main

PATH, TITLE = OWN
LEAD = (
    "Say what you have, choose its files, press Run: it is tracked as the command line does it, and what came of it is "
    "kept in the workbench's folder, with its report, until you delete it."
)


async def own_page(run: str = "", file: str = "") -> None:
    """Build the page; with the run that is opened, or with a file of the folder."""
    head(PATH)
    kinds = {one.noun: one.name[:1].upper() + one.name[1:] for one in SETTINGS.recordings if not one.is_scene}
    state = await state_of("own", lambda: RunState(tuple(kinds)))
    with errors_shown():
        if run:
            state.again(run_named(run, kinds))
        elif file in in_folder(SETTINGS.folder):
            state.take(file)
    with main(TITLE, LEAD):
        RunWindow(state, kinds, elsewhere=True)
