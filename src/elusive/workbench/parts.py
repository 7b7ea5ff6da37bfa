"""Parts of every page: drawings, a form of a model's fields, sentences of refusals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from nicegui import ui

from elusive.errors import ElusiveError, ParameterError
from elusive.model import Model
from elusive.report import drawing as draw
from elusive.workbench.blocks import told_of
from elusive.workbench.forms import (
    Control,
    FieldPath,
    changed_since,
    controls,
    faults,
    in_plain_words,
    laid_over,
    text_of,
)


class Drawing(ui.element, component="drawing.js"):
    """What is drawn, as in a report; zoom, layers and the track that is chosen stay where the same is drawn anew.

    Emits ``viewed`` with what is in view, and of a map on which is placed ``placed``, ``moved``, ``chosen``,
    ``removed``, ``drawn`` and ``outlined``.
    """

    def __init__(self, drawn: draw.Drawing) -> None:
        super().__init__()
        self.props["spec"] = told_of(drawn)

    def show(self, drawn: draw.Drawing) -> None:
        """Draw something else."""
        self.props["spec"] = told_of(drawn)
        self.update()


class LiveDrawing(ui.element, component="drawing.js"):
    """What is drawn while it comes, from an address that tells it."""

    def __init__(self, address: str) -> None:
        super().__init__()
        self.props["live"] = address


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
    """

    def __init__(
        self,
        model: Model,
        only: Sequence[FieldPath],
        on_change: Callable[[Any], Any],
        *,
        grouped: bool = True,
        without: Sequence[FieldPath] = (),
    ) -> None:
        self.model: Any = model
        self._only, self._on_change, self._grouped = only, on_change, grouped
        self._without = without
        self._typed: dict[FieldPath, str | bool] = {}
        self._made: dict[FieldPath, Any] = {}
        self._shown: list[Control] = []
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

    def show(self, model: Model) -> None:
        """Take another model's values."""
        self.model = model
        self._typed.clear()
        self._build()

    def _build(self) -> None:
        self._box.clear()
        self._made.clear()
        self._shown = [
            one
            for one in controls(self.model, self._only)
            if not any(one.path[: len(path)] == path for path in self._without)
        ]
        groups: dict[str, list[Control]] = {}
        for one in self._shown:
            groups.setdefault(one.group if self._grouped else "", []).append(one)
        with self._box:
            for group, members in groups.items():
                if group and group != type(self.model).__name__:
                    ui.label(group).classes("ew-section")
                with ui.element("div").classes("ew-fields"):
                    for one in members:
                        self._made[one.path] = self._control(one)
            self._general = ui.label().classes("ew-fault").props('role="alert"')
            self._general.visible = False

    def _control(self, one: Control) -> Any:
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
        try:
            model = laid_over(self.model, self._typed)
            self.model = self._on_change(model) or model
        except ParameterError as error:  # of the model, or of what it is a part of
            self._mark(error)
            return
        self._typed.clear()
        if self._box.is_deleted:  # the page has built itself anew, with this form's successor
            return
        if one.path[-1] == "kind":
            self._build()
        else:
            self._mark(None)

    def _mark(self, error: ParameterError | None) -> None:
        marked, general = ({}, "") if error is None else faults(error, self._shown)
        for path, made in self._made.items():
            if hasattr(made, "error"):
                made.error = marked.get(path)
        self._general.text, self._general.visible = general, bool(general)


class Changed:
    """What is set otherwise than when the run that is shown was made, and the way back; hidden while nothing is.

    Parameters
    ----------
    run
        The settings of the run that is shown; None where there is none.
    now
        Those that stand.
    back
        Takes the run's settings again, where the page can.
    """

    def __init__(
        self, run: Callable[[], Model | None], now: Callable[[], Model], back: Callable[[], Any] | None = None
    ) -> None:
        self._run, self._now = run, now
        with ui.element("div").classes("ew-row ew-changed").props('role="status"') as self._row:
            self._words = ui.label()
            if back is not None:
                ui.button("Back to this run's settings", on_click=back).props("flat no-caps dense")
        self._row.visible = False
        ui.timer(0.3, self.show)

    def show(self) -> None:
        """Say it as it stands."""
        run = self._run()
        changes = "" if run is None else changed_since(run, self._now())
        words = changes and f"Changed since this run: {changes}."
        if self._words.text != words:
            self._words.text, self._row.visible = words, bool(words)


def are_right(forms: Sequence[Form]) -> bool:
    """Tell whether nothing is marked in any of the forms; say so if something is."""
    right = all(form.is_right for form in forms)
    if not right:
        ui.notify("Correct the marked fields first.", type="warning")
    return right


@contextmanager
def errors_shown() -> Iterator[None]:
    """Show a refusal as the library's own sentence."""
    try:
        yield
    except ElusiveError as error:
        refuse(str(error))


def refuse(sentence: str) -> None:
    """Show what is wrong until it is read."""
    ui.notify(
        in_plain_words(sentence), type="negative", position="top", timeout=10_000, close_button="Close", multi_line=True
    )
