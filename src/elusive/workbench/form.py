"""A model's fields as controls on a page: judged as they are typed, marked where changed, found, taken back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

from nicegui import ui

from elusive.errors import ParameterError
from elusive.model import Model
from elusive.workbench.forms import Control, FieldPath, controls, faults, laid_over, text_of, usual_text

CHANGES = count()  # in the order in which they were made, over all forms


class Form:
    """Controls of a model's fields, judged by the model as they are typed.

    Parameters
    ----------
    model
        What stands now.
    only
        Fields, or models whose fields are all shown.
    on_change
        Called with the new model whenever what stands in the form is right; it may give another in its place.
    grouped
        Whether fields stand under what holds them.
    without
        Fields, or models, that are left out.
    under
        What stands above the form already, and is not said again.
    """

    def __init__(
        self,
        model: Model,
        only: Sequence[FieldPath],
        on_change: Callable[[Any], Any],
        *,
        grouped: bool = True,
        without: Sequence[FieldPath] = (),
        under: str = "",
    ) -> None:
        self.model: Any = model
        self._only, self._on_change, self._grouped = only, on_change, grouped
        self._without, self._named = without, (type(model).__name__, under)
        self.past: list[tuple[int, FieldPath, str | bool]] = []
        """What stood in fields before each change: the change's number, the field, its text."""
        self._typed: dict[FieldPath, str | bool] = {}
        self._resets: dict[FieldPath, Any] = {}
        self._made: dict[FieldPath, Any] = {}
        self._shown: list[Control] = []
        self._unfolded: list[ui.expansion] = []  # by what was looked for
        self._box = ui.column().classes("w-full gap-1")
        self._build()

    @property
    def is_right(self) -> bool:
        """Whether nothing is marked."""
        return not self._typed

    @property
    def paths(self) -> list[FieldPath]:
        """Paths of the fields that are shown."""
        return [one.path for one in self._shown]

    def fits(self, model: Model) -> bool:
        """Whether the fields that are shown are those of another model, too: one of other kinds has others."""
        return self._fields(model) == self._shown

    def show(self, model: Model) -> None:
        """Take another model's values."""
        self.model = model
        self._typed.clear()
        self._build()

    def _build(self) -> None:
        self._box.clear()
        self._made.clear()
        self._resets.clear()
        self._sections: list[tuple[Any, list[Control]]] = []
        self._shown = self._fields(self.model)
        groups: dict[str, list[Control]] = {}
        for one in self._shown:
            groups.setdefault(one.group if self._grouped else "", []).append(one)
        with self._box:
            for group in sorted(groups, key=lambda group: group not in self._named):  # or they stood under another
                members = groups[group]
                if group and group not in self._named:
                    self._sections.append((ui.label(group).classes("ew-section"), members))
                with ui.element("div").classes("ew-fields"):
                    for one in members:
                        self._made[one.path] = self._control(one)
            self._general = ui.label().classes("ew-fault").props('role="alert"')
            self._general.visible = False
        self._mark_changes()

    def _fields(self, model: Model) -> list[Control]:
        return [
            one
            for one in controls(model, self._only)
            if not any(one.path[: len(path)] == path for path in self._without)
        ]

    def put(self, path: FieldPath, text: str | bool) -> None:
        """Set a field, as a change of its own."""
        if path in self._made:
            self.past.append((next(CHANGES), path, text_of(self.model, path)))
            self._made[path].value = text

    def undo(self) -> None:
        """Take the latest change back."""
        *kept, (_, path, text) = self.past
        self.put(path, text)
        self.past = kept

    def find(self, words: str) -> bool:
        """Show the fields of which label, name or help hold what is looked for, all for nothing; tell if any."""
        wanted = words.lower().split()
        shown = {
            one.path: all(word in f"{one.label} {one.key} {one.help} {one.group}".lower() for word in wanted)
            for one in self._shown
        }
        for path, made in self._made.items():
            made.parent_slot.parent.visible = shown[path]
        for label, members in self._sections:
            label.visible = any(shown[one.path] for one in members)
        around = self._box.parent_slot
        while wanted and any(shown.values()) and around is not None:  # what is folded up is opened
            if isinstance(around.parent, ui.expansion) and not around.parent.value:
                around.parent.set_value(True)
                self._unfolded.append(around.parent)
            around = around.parent.parent_slot
        while not wanted and self._unfolded:
            self._unfolded.pop().set_value(False)
        return any(shown.values())

    def explain(self, on: bool) -> None:
        """Show the help of every field, or of the one that is typed in."""
        self._box.classes(add="ew-explained") if on else self._box.classes(remove="ew-explained")
        for made in self._made.values():
            made.props(remove="hide-hint") if on else made.props("hide-hint")

    def _control(self, one: Control) -> Any:
        with ui.element("div").classes("ew-field"):
            made = self._input(one)
            usual = usual_text(self.model, one.path)
            if usual is not None:
                said = usual if isinstance(usual, str) else "on" if usual else "off"
                words = f"{one.label}: back to the usual, {said or 'none'}"
                self._resets[one.path] = (
                    ui.button(icon="undo", on_click=lambda: self.put(one.path, usual))
                    .props(f'flat dense round size=sm aria-label="{words}"')
                    .props(f'title="{words}"')
                )
        return made

    def _mark_changes(self) -> None:
        for path, reset in self._resets.items():
            changed = text_of(self.model, path) != usual_text(self.model, path)
            reset.visible = changed
            self._made[path].parent_slot.parent.classes(
                add="ew-set" if changed else "", remove="" if changed else "ew-set"
            )

    def _input(self, one: Control) -> Any:
        label = f"{one.label} [{one.unit}]" if one.unit else one.label
        value = text_of(self.model, one.path)

        def typed(event: Any) -> None:
            self._take(one, event.value)

        made: Any
        if one.switch:
            made = ui.switch(label, value=bool(value), on_change=typed)
        elif one.choices:
            named = {choice: choice for choice in one.choices}
            named = {"": "the usual one"} | named if one.optional else named
            made = ui.select(named, label=label, value=value, on_change=typed)
        else:
            made = ui.input(label, value=str(value), on_change=typed)
        if not one.switch:
            made.without_auto_validation()  # the model is the judge
            made.props("dense outlined hide-hint").classes("w-full")
            made.props["hint"] = one.help
        made.props["data-field"] = one.key
        with made:
            ui.tooltip(one.help).props("delay=600 max-width=320px")
        return made

    def _take(self, one: Control, value: Any) -> None:
        self._typed[one.path] = value if isinstance(value, bool) else "" if value is None else str(value)
        before = text_of(self.model, one.path)
        try:
            model = laid_over(self.model, self._typed)
            self.model = self._on_change(model) or model
        except ParameterError as error:  # of the model, or of what it is a part of
            self._mark(error)
            return
        self._typed.clear()
        if not self.past or self.past[-1][1] != one.path:  # a number is one change, however many digits it has
            self.past.append((next(CHANGES), one.path, before))
        if self._box.is_deleted:  # the page has built itself anew, with this form's successor
            return
        if one.path[-1] == "kind":
            self._build()
        else:
            self._mark(None)
            self._mark_changes()

    def _mark(self, error: ParameterError | None) -> None:
        marked, general = ({}, "") if error is None else faults(error, self._shown)
        for path, made in self._made.items():
            if hasattr(made, "error"):
                made.error = marked.get(path)
        self._general.text, self._general.visible = general, bool(general)


class FormTools:
    """What stands above forms: search, help for all fields, and the way back from the latest changes.

    Parameters
    ----------
    forms
        Gives the forms as they stand.
    """

    def __init__(self, forms: Callable[[], Sequence[Form]]) -> None:
        self._forms = forms

        def look(event: Any) -> None:
            found = [form.find(str(event.value or "")) for form in forms()]
            self._none.visible = not any(found)

        def explain(event: Any) -> None:
            for form in forms():
                form.explain(event.value)

        with ui.element("div").classes("ew-row ew-tools"):
            sought = ui.input("Find a setting", on_change=look).props("dense outlined clearable").classes("grow")
            sought.props["data-field"] = "find"
            self._undo = ui.button("Undo", on_click=self._take_back).props("flat no-caps dense")
            ui.switch("Explain", on_change=explain).props("dense")
        self._none = ui.label("No setting's name or help has these words.").classes("ew-note").props('role="status"')
        self._none.visible = False

    def _take_back(self) -> None:
        changed = [form for form in self._forms() if form.past]
        if changed:
            max(changed, key=lambda form: form.past[-1][0]).undo()
        else:
            ui.notify("Nothing has been changed since this page was built.")


def are_right(forms: Sequence[Form]) -> bool:
    """Tell whether nothing is marked in any of the forms; say so if something is."""
    right = all(form.is_right for form in forms)
    if not right:
        ui.notify("Correct the marked fields first.", type="warning")
    return right
