"""Run and Cancel, and between them how far the work is: the same on every page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from nicegui import ui

from elusive.errors import ElusiveError
from elusive.model import Model
from elusive.workbench.forms import in_plain_words
from elusive.workbench.jobs import CancelledError, Job, away

Done = TypeVar("Done")


class Working(Protocol):
    """State of a tab in which work can be under way."""

    job: Any  # a `Job` while there is
    refused: str  # why the last was; empty: it was not


class RunBar:
    """The bar of one page.

    Parameters
    ----------
    state
        What the tab holds.
    start
        Done at a press of the first button.
    label
        What stands on it.
    model
        Gives the settings that stand, where refusals name fields that these may lack.
    """

    def __init__(
        self,
        state: Working,
        start: Callable[[], Any],
        label: str = "Run",
        model: Callable[[], Model | None] | None = None,
    ) -> None:
        self._state, self._model, self._pressed = state, model or (lambda: None), False

        def press() -> Any:
            self._pressed = True
            return start()

        with ui.element("div").classes("ew-stays"):
            with ui.element("div").classes("ew-row") as self.row:
                self._start = ui.button(label, on_click=press).props("unelevated no-caps")
                self._cancel = ui.button(Job.ends_by, on_click=self._call_off).props("outline no-caps")
            self._bar = ui.linear_progress(0.0, show_value=False).props('aria-label="Progress"')
            self._told = ui.label().classes("ew-note").props('role="status"')
            self._refused = ui.label().classes("ew-doubt").props('role="alert"')
        self.show()

    async def run(
        self, job: Job, prepare: Callable[[], Callable[[Any], Done]], started: Callable[[], Any] = lambda: None
    ) -> Done | None:
        """Do the work that ``prepare`` gives, off the event loop; None if it was refused or called off."""
        found = None
        self._state.job, self._state.refused = job, ""
        try:
            self.show()
            started()
            work = prepare()
            found = await away(lambda: work(job), job)
        except ElusiveError as error:
            self.refuse(str(error))
        except CancelledError:
            self._state.refused = "Cancelled."  # found by a page that was loaded anew meanwhile
        finally:
            self._state.job = None
            self.tell("")
            self.show()
            self._focus()
        return found

    def _focus(self) -> None:
        """Lead who pressed the button back to it, which lost the focus while it could not be pressed."""
        focus = f"getHtmlElement({self._start.id})?.focus({{ preventScroll: true }})"
        if self._pressed:
            self._start.client.run_javascript(f"if (document.activeElement === document.body) {focus}")
        self._pressed = False

    def show(self) -> None:
        """Show whether there is work, and so what can be pressed."""
        busy = self._state.job is not None
        self._bar.visible = busy
        self._start.set_enabled(not busy)
        self._cancel.set_enabled(busy)
        self._cancel.text = self._state.job.ends_by if busy else Job.ends_by
        self._refused.text, self._refused.visible = self._state.refused, bool(self._state.refused)

    def refuse(self, sentence: str) -> None:
        """Say why nothing is done, until something is, where it is seen."""
        self._state.refused = in_plain_words(sentence, self._model())
        self.show()
        self._refused.run_method("scrollIntoView", {"block": "nearest"})

    def tell(self, words: str, share: float = 0.0) -> None:
        """Say what is done, and the share of all that it is."""
        self._told.text = words
        self._bar.set_value(share)

    def _call_off(self) -> None:
        job: Job | None = self._state.job
        if job is not None:
            job.cancel()
