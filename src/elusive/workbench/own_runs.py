"""Runs that the workbench keeps, as a page shows them: one with its report and files, all in a list, some compared."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import cache
from typing import Any

from nicegui import ui

from elusive.errors import DataError
from elusive.model import Model
from elusive.workbench.asking import Asking, asking
from elusive.workbench.exports import show_command, table_html
from elusive.workbench.files import FOLDER
from elusive.workbench.forms import FieldPath
from elusive.workbench.kept_runs import (
    REPORT,
    Kept,
    each_setting,
    flat,
    forget,
    kept_runs,
    results,
    shown_command,
)
from elusive.workbench.parts import Drawing, errors_shown
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import chosen_colours
from elusive.workbench.why_none import beside, tries, why_none

COMPARED_MOST = 6


@cache
def asking_of(noun: str) -> Asking:
    """Return what the command of a kind of recording asks for.

    Raises
    ------
    DataError
        If there is none of that kind.
    """
    for one in SETTINGS.recordings:
        if one.noun == noun:
            return asking(one)
    raise DataError(f"{noun!r:.40}: is no kind of recording that is tracked here; its files stay in the folder.")


def show_none(run: Kept, model: Model, again: Callable[[Model], Any], without: Sequence[FieldPath]) -> None:
    """Build why a run has no track, and what can be tried at a press; nothing where it has one.

    ``without``: fields of the model that something else sets.
    """
    why = why_none(run.folder, model)
    if why is None:
        return
    with ui.element("section").classes("ew-none").props('aria-label="Why none?"'):
        ui.label("Why none?").classes("ew-section")
        ui.label(why.sentence)
        if why.drawn is not None:
            Drawing(why.drawn)
        if run.doubted:
            ui.label(f"To be doubted, and said in the report: {', '.join(run.doubted)}.")
        with ui.element("div").classes("ew-row"):
            for one in tries(model, asking_of(run.noun).tries, without):
                ui.button(f"Try {one.words}", on_click=lambda one=one: again(one.model)).props("outline no-caps")


def show_run(run: Kept) -> None:
    """Build what came of a run: its settings, report, files, and the command that repeats it."""
    address = f"/{FOLDER}/{run.name}"
    ui.label(run.name).classes("ew-section ew-name")
    changed = ", ".join(f"{key} {value}" for key, value in flat(run.settings).items())
    ui.label(f"Settings: {changed or 'the usual ones'}").classes("ew-note")
    if REPORT in run.files:
        # a report is a file like others: what it asks of the workbench is refused
        ui.html(
            f'<iframe class="ew-report" src="{address}/{REPORT}#{chosen_colours()}" title="Report of {run.name}" '
            # a frame is white until its page is there, which flashes where all else is dark
            'style="visibility: hidden" onload="this.style.visibility = \'visible\'" '
            'sandbox="allow-scripts allow-downloads"></iframe>', sanitize=False,
        ).classes("w-full")  # fmt: skip
        ui.link("The report in a tab of its own", f"{address}/{REPORT}#{chosen_colours()}", new_tab=True)
    with ui.element("div").classes("ew-row"):
        for name in run.files:
            ui.button(name, on_click=lambda name=name: ui.download(f"{address}/{name}", name)).props(
                "outline no-caps dense"
            )
    asked = asking_of(run.noun)
    if not run.given and not asked.is_scene:
        return
    config = f"{run.folder.relative_to(SETTINGS.folder)}/{asked.file}" if run.settings or asked.is_scene else ""
    show_command("The same without a browser, in the workbench's folder:", shown_command(asked, run.given, config))


def all_runs(nouns: Collection[str]) -> list[Kept]:
    """List the runs of some kinds that are kept, and results of the command line in the folder."""
    askings = sorted(map(asking_of, nouns), key=lambda one: not one.is_scene)  # scenes have a file of their own
    kept = [run for run in kept_runs(SETTINGS.folder) if run.noun in nouns]
    return [*kept, *results(SETTINGS.folder, askings)]


def run_named(name: str, nouns: Collection[str]) -> Kept:
    """Return a run of some kinds.

    Raises
    ------
    DataError
        If there is none of that name.
    """
    for run in all_runs(nouns):
        if run.name == name:
            return run
    raise DataError(f"{name!r:.60}: is no run that is kept here; it may have been deleted.")


class RunList:
    """The list of all runs.

    Parameters
    ----------
    nouns
        Kinds whose runs are listed.
    open_run
        Opens one.
    deleted
        Done after one is deleted.
    """

    def __init__(
        self, nouns: Collection[str], open_run: Callable[[Kept], None], deleted: Callable[[], None]
    ) -> None:  # fmt: skip
        self._nouns, self._open, self._deleted = nouns, open_run, deleted
        self._box = ui.column().classes("w-full gap-2")

    def show(self) -> None:
        """Build it anew from what stands in the folder."""
        made, runs = kept_runs(SETTINGS.folder), all_runs(self._nouns)
        chosen: dict[str, bool] = {}
        self._box.clear()
        with self._box:
            ui.label("Runs that are kept").classes("ew-section")
            if not runs:
                ui.label("None yet.").classes("ew-note")
                return

            def compare(name: str, taken: bool) -> None:
                chosen[name] = taken
                compared.clear()
                some = [run for run in runs if chosen.get(run.name)][:COMPARED_MOST]
                if len(some) > 1:
                    with compared:
                        ui.html(compared_html(some), sanitize=False)
                        if (drawn := beside({run.name: run.folder for run in some})) is not None:
                            Drawing(drawn)

            for run in runs:
                with ui.element("div").classes("ew-row").props(f'data-run="{run.name}"'):
                    ui.checkbox(on_change=lambda event, name=run.name: compare(name, event.value)).props(
                        f'dense aria-label="Compare {run.name}"'
                    )
                    ui.label(run.name)
                    ui.label(_told(run)).classes("ew-note ew-grow")
                    ui.button("Open", on_click=lambda run=run: self._open(run)).props(
                        f'flat no-caps dense aria-label="Open {run.name}"'
                    )
                    if run in made:
                        self._deleting(run)
            compared = ui.element("div").classes("ew-scroll")  # below, or what is ticked next would move away

    def _deleting(self, run: Kept) -> None:
        """Build what deletes a run at its second press."""

        def ask() -> None:
            first.visible, second.visible = False, True

        first = ui.button("Delete", on_click=ask).props(f'flat no-caps dense aria-label="Delete {run.name}"')
        second = ui.button("Delete for good", on_click=lambda: self._forget(run)).props(
            "unelevated no-caps dense color=negative"
        )
        second.visible = False

    def _forget(self, run: Kept) -> None:
        with errors_shown():
            forget(run)
        self._deleted()


def _told(run: Kept) -> str:
    changed = ", ".join(f"{key} {value}" for key, value in flat(run.settings).items()) or "usual settings"
    doubts = f"; to be doubted: {', '.join(run.doubted)}" if run.doubted else ""
    return f"{run.noun}; {changed}{doubts}"


def compared_html(runs: list[Kept]) -> str:
    """Return a table of runs: what was set otherwise, and what they came to, a column each."""
    rows = [(key, *values) for key, values in each_setting(runs)]
    said = [dict(_rows(run.said)) for run in runs]
    names = dict.fromkeys(name for one in said for name in one)
    rows += [(name, *(one.get(name, "") for one in said)) for name in names]
    rows.append(("To be doubted", *(", ".join(run.doubted) or "nothing" for run in runs)))
    return table_html(["", *(run.name for run in runs)], rows)


def _rows(said: str) -> list[tuple[str, str]]:
    """Return names and values of the table of a run, as the command printed it."""
    rows: list[tuple[str, str]] = []
    for cells in (line.split("│") for line in said.splitlines()):
        name, value = (cells[1].strip(), cells[2].strip()) if len(cells) == 4 else ("", "")
        if name:
            rows.append((name, value))
        elif value and rows:  # a long value goes on in the next line
            rows[-1] = rows[-1][0], f"{rows[-1][1]} {value}"
    return rows
