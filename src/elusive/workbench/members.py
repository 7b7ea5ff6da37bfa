"""What a scene holds several of, a form each: put in, changed, taken out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from nicegui import ui

from elusive.model import Model
from elusive.workbench.form import Form
from elusive.workbench.parts import errors_shown


class Members:
    """The members of one field.

    Parameters
    ----------
    now
        Gives the model that has the field, as it stands.
    name
        Of the field, in the plural: ``objects``.
    take
        Is given that model with other members.
    """

    def __init__(self, now: Callable[[], Model], name: str, take: Callable[[Any], Any]) -> None:
        self._now, self._name, self._take = now, name, take
        self.forms: list[Form] = []
        self._box = ui.column().classes("w-full gap-2")
        self._build()

    def _build(self) -> None:
        self._box.clear()
        one = self._name.removesuffix("s")
        with self._box:
            self.forms = [self._form(number, member, one) for number, member in enumerate(self._members)]
            ui.button(f"Add another {one}", on_click=self._add).props("outline no-caps")

    @property
    def _members(self) -> tuple[Model, ...]:
        members: tuple[Model, ...] = getattr(self._now(), self._name)
        return members

    def _form(self, number: int, member: Model, one: str) -> Form:
        with ui.element("div").classes("ew-row w-full"):
            ui.label(f"{one.capitalize()} {number + 1}").classes("ew-section grow")
            ui.button("Remove", on_click=partial(self._remove, number)).props(
                f'flat dense no-caps aria-label="Remove {one} {number + 1}"'
            )
        return Form(member, ((),), partial(self._change, number), grouped=False)

    def _change(self, number: int, member: Model) -> None:
        members = self._members
        self._set((*members[:number], member, *members[number + 1 :]))

    def _add(self) -> None:
        with errors_shown():
            members = self._members
            self._set((*members, members[-1] if members else getattr(type(self._now())(), self._name)[0]))
        self._build()

    def _remove(self, number: int) -> None:
        members = self._members
        self._set((*members[:number], *members[number + 1 :]))
        self._build()

    def _set(self, members: Sequence[Model]) -> None:
        self._take(self._now().replace(**{self._name: tuple(members)}))
