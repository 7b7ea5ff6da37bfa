"""Parts of every page: drawings, what was changed since a run, sentences of refusals."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from nicegui import ui

from elusive.errors import ElusiveError
from elusive.model import Model
from elusive.report import drawing as draw
from elusive.workbench.blocks import told_of
from elusive.workbench.forms import changed_since, in_plain_words


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
