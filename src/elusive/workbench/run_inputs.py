"""What is asked for before a run: the files and options of a command, and the settings of a recording or a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from nicegui import ui

from elusive.model import Model
from elusive.workbench.asking import FOLLOW, Asked, Asking, listed
from elusive.workbench.files import SCENES, in_folder
from elusive.workbench.form import Form, FormTools
from elusive.workbench.forms import FieldPath
from elusive.workbench.look import Look
from elusive.workbench.members import Members
from elusive.workbench.opener import opener, sender
from elusive.workbench.own_runs import asking_of
from elusive.workbench.run_state import RunState
from elusive.workbench.settings import SETTINGS

LOOK_S = 2.0  # between looks at what lies in the folder


class Shown(NamedTuple):
    """How a page shows the parameters of a kind."""

    without: Callable[[Any], Sequence[FieldPath]]  # fields left out of a model as it stands: something else sets them
    settle: Callable[[Any], Any] = lambda model: model  # takes anew what follows from other fields


ALL = Shown(lambda _: ())


class RunInputs:
    """The inputs of what is chosen.

    Parameters
    ----------
    state
        What the tab holds.
    shown
        How the parameters of a kind are shown, where not all are.
    """

    def __init__(self, state: RunState, shown: Mapping[str, Shown]) -> None:
        self._state, self._kinds = state, shown
        self._whole: list[Form] = []  # forms over all parameters
        self._members: list[Members] = []
        self._opened: dict[str, bool] = {}  # parts
        self._look: Look | None = None
        self._names: list[str] = []  # of the folder, as the lists of files have them
        self._lists: list[Any] = []
        self._box = ui.column().classes("w-full gap-2 ew-wide")
        ui.timer(LOOK_S, self._refresh)

    @property
    def forms(self) -> list[Form]:
        """All forms as they stand."""
        return [*self._whole, *(form for one in self._members for form in one.forms)]

    def without(self, noun: str, model: Model) -> Sequence[FieldPath]:
        """Return the fields of a kind's parameters that something else sets."""
        return self._kinds.get(noun, ALL).without(model)

    def show(self) -> None:
        """Build them anew."""
        self._box.clear()
        self._whole, self._members, self._look, self._lists = [], [], None, []
        self._names = in_folder(SETTINGS.folder)
        if not self._state.noun:
            return
        asked = asking_of(self._state.noun)
        with self._box:
            if asked.is_scene:
                with ui.expansion("Open a scene").props("dense").classes("w-full"):
                    opener("a scene", SCENES, asked.parameters.from_yaml, self._scene)
            else:
                self._files(asked)
            FormTools(lambda: self.forms)
            self._settings(asked)
            ui.button("The usual settings", on_click=self._reset).props("flat no-caps dense")

    def _files(self, asked: Asking) -> None:
        state = self._state
        needed = [one for one in asked.asked if one.needed or one.is_file]
        if asked.follows:
            live = ui.switch("It comes live", value=bool(state.given[state.noun].get(FOLLOW)), on_change=self._follow)
            live.props("dense").props["data-field"] = FOLLOW
        for one in needed:
            self._ask(one)
            if not one.flag:
                self._look = Look(asked, state)
        sender("Send files from this computer to the workbench's folder", self._sent)
        rest = [one for one in asked.asked if one not in needed]
        with ui.expansion("How it is read").props("dense").classes("w-full"):
            for one in rest:
                self._ask(one)

    def _settings(self, asked: Asking) -> None:
        """Build the forms: what matters first, and all else, of a scene part by part."""
        model = self._state.models[self._state.noun]
        without = [*asked.main, *self.without(asked.noun, model)]
        self._whole = [Form(model, asked.main, self._take, grouped=False)]
        self._members = [Members(self._now, name, self._take) for name in asked.members]
        for title, paths in asked.parts.items():
            with ui.expansion(title, value=self._opened.get(title, False)).props("dense").classes("w-full") as part:
                form = Form(model, paths, self._take, without=without, under=title)
            part.on_value_change(lambda event, title=title: self._opened.update({title: event.value}))
            if form.paths:
                self._whole.append(form)
            else:
                part.delete()

    def _now(self) -> Model:
        return self._state.models[self._state.noun]

    def _follow(self, event: Any) -> None:
        self._state.given[self._state.noun][FOLLOW] = event.value
        self.show()

    def _ask(self, one: Asked) -> None:
        state = self._state
        given, value = state.given[state.noun], state.given[state.noun].get(one.name, "")
        typed = not one.flag and bool(given.get(FOLLOW))  # an address, too
        made: Any
        if one.switch:
            made = ui.switch(
                one.label, value=bool(value), on_change=lambda event: given.update({one.name: event.value})
            )
        elif one.is_file:
            names = list(self._names)
            if typed and value and value not in names:
                names.append(str(value))
            chosen = [str(value)] if typed and value else [name for name in listed(str(value)) if name in names]
            several = one.values != 1

            def take(event: Any) -> None:
                parts = event.value if isinstance(event.value, list) else [event.value] if event.value else []
                given[one.name] = ", ".join(parts)
                self._look_again()

            made = ui.select(
                names, value=chosen if several else (chosen[0] if chosen else None), on_change=take, multiple=several,
                label=f"{one.label}: a file that grows, or an address" if typed else _asked_as(one),
                clearable=not one.needed, with_input=True, new_value_mode="add-unique" if typed else None,
            ).props("dense outlined options-dense").classes("w-full")  # fmt: skip
            self._lists.append(made)
        else:
            made = ui.input(one.label, value=str(value), on_change=lambda event: given.update({one.name: event.value}))
            made.props("dense outlined").classes("w-full").on("blur", self._look_again)
        made.props["data-field"] = one.name
        with made:
            ui.tooltip(one.help.replace("\\[", "[")).props("delay=600 max-width=320px")

    def _look_again(self) -> None:
        if self._look is not None:
            self._look.again()

    def _refresh(self) -> None:
        """Put into the lists what has come into the folder meanwhile, and take out what has gone."""
        names = in_folder(SETTINGS.folder)
        if names == self._names:
            return
        before, self._names = set(self._names), names
        for one in self._lists:
            one.set_options([*names, *(typed for typed in one.options if typed not in before and typed not in names)])

    def _sent(self, name: str) -> None:
        self.show()
        ui.notify(f"{name} is in the workbench's folder now; choose it above.")

    def _scene(self, _: str, scene: Model) -> None:
        self._state.models[self._state.noun] = scene
        self.show()

    def _take(self, model: Model) -> Model:
        before, noun = self._now(), self._state.noun
        kept: Model = self._kinds.get(noun, ALL).settle(model)
        self._state.models[self._state.noun] = kept
        for form in self._whole:
            if form.is_right and (kept != model or not form.fits(kept)):  # it is not the one that is typed in
                form.show(kept)
            form.model = kept
        if self.without(noun, before) != self.without(noun, kept):
            self.show()
        return kept

    def _reset(self) -> None:
        self._state.models[self._state.noun] = asking_of(self._state.noun).parameters()
        self.show()


def _asked_as(one: Asked) -> str:
    """Return what stands on a field: its label, and of a file whether it may be left out."""
    return f"{one.label} (optional)" if one.is_file and not one.needed else one.label
