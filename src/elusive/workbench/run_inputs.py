"""What is asked for before a run: the files and options of a command, and the settings of a recording or a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui import ui

from elusive.model import Model
from elusive.workbench.asking import FOLLOW, Asked, Asking, listed
from elusive.workbench.files import SCENES, in_folder
from elusive.workbench.form import Form, FormTools
from elusive.workbench.forms import FieldPath
from elusive.workbench.look import Look
from elusive.workbench.opener import opener, sender
from elusive.workbench.own_runs import asking_of
from elusive.workbench.run_state import RunState
from elusive.workbench.settings import SETTINGS

LOOK_S = 2.0  # between looks at what lies in the folder


class RunInputs:
    """The inputs of what is chosen.

    Parameters
    ----------
    state
        What the tab holds.
    without
        Fields that are not shown, of a kind, as something else sets them.
    """

    def __init__(self, state: RunState, without: Mapping[str, Sequence[FieldPath]]) -> None:
        self._state, self._without = state, without
        self.forms: list[Form] = []
        self._look: Look | None = None
        self._names: list[str] = []  # of the folder, as the lists of files have them
        self._lists: list[Any] = []
        self._box = ui.column().classes("w-full gap-2 ew-wide")
        ui.timer(LOOK_S, self._refresh)

    def show(self) -> None:
        """Build them anew."""
        self._box.clear()
        self.forms, self._look, self._lists = [], None, []
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
            ui.switch("It comes live", value=bool(state.given[state.noun].get(FOLLOW)), on_change=self._follow).props[
                "data-field"
            ] = FOLLOW
        for one in needed:
            self._ask(one)
            if not one.flag:
                self._look = Look(asked, state.given[state.noun])
        sender("Send files from this computer to the workbench's folder", self._sent)
        rest = [one for one in asked.asked if one not in needed]
        with ui.expansion("How it is read").props("dense").classes("w-full"):
            for one in rest:
                self._ask(one)

    def _settings(self, asked: Asking) -> None:
        """Build the forms: what matters first, and all else, of a scene part by part."""
        model, without = self._state.models[self._state.noun], self._without.get(self._state.noun, ())
        self.forms = [Form(model, asked.main, self._take, grouped=False)]
        parts = asked.parts or {"Everything else that can be set": ()}
        for title, path in parts.items():
            with ui.expansion(title).props("dense").classes("w-full"):
                self.forms.append(Form(model, (path,), self._take, without=[*asked.main, *without], under=title))

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
                if not one.flag and self._look is not None:
                    self._look.again()

            made = ui.select(
                names, value=chosen if several else (chosen[0] if chosen else None), on_change=take, multiple=several,
                label=f"{one.label}: a file that grows, or an address" if typed else one.label,
                clearable=not one.needed, with_input=True, new_value_mode="add-unique" if typed else None,
            ).props("dense outlined options-dense").classes("w-full")  # fmt: skip
            self._lists.append(made)
        else:
            made = ui.input(one.label, value=str(value), on_change=lambda event: given.update({one.name: event.value}))
            made.props("dense outlined").classes("w-full")
        made.props["data-field"] = one.name
        with made:
            ui.tooltip(one.help.replace("\\[", "[")).props("delay=600 max-width=320px")

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
        self._state.models[self._state.noun] = model
        for form in self.forms:
            form.model = model
        return model

    def _reset(self) -> None:
        self._state.models[self._state.noun] = asking_of(self._state.noun).parameters()
        self.show()
