"""What every page stands in: the head with all systems, dark and light, and the steps of a page."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple, Protocol
from weakref import WeakKeyDictionary

from nicegui import Client, ui

from elusive.workbench.settings import SETTINGS

OWN = ("/own", "Your recording")  # path and title of the page on which any recording is tracked
DARK = {"auto": None, "light": False, "dark": True}
COOKIE = "elusive_colours"  # found on the next page
COLOURS: WeakKeyDictionary[Client, str] = WeakKeyDictionary()  # those chosen on each page that is open


def chosen_colours() -> str:
    """Return the colours that are chosen on this page: a report is asked for in them."""
    return COLOURS.get(ui.context.client, "auto")


class Page(NamedTuple):
    """One system: what its card says, and what opens it."""

    system: str  # as its scenes name it
    path: str
    short: str  # in the head of every page
    title: str
    summary: str
    example: str  # what the ready example does
    build: Callable[[bool, str], Awaitable[None]]  # True: run the ready example; a file of the folder: open it
    keeps_runs: bool = False  # of its scenes; else they are seen on the page and exported
    warm_up: Callable[[], None] | None = None  # loads and compiles once what is waited for


def pages() -> list[Page]:
    """Return the systems' pages."""
    return [import_module(name).PAGE for name in SETTINGS.pages]


def head(here: str) -> None:
    """Build the head of a page."""
    ui.colors(
        primary="#1d5fd1", positive="#0f766e", negative="#b42318", warning="#9a4a07", dark="#161d29",
        dark_page="#0d131c",
    )  # fmt: skip
    request = ui.context.client.request
    kept = "auto" if request is None else request.cookies.get(COOKIE, "auto")
    chosen = COLOURS[ui.context.client] = kept if kept in DARK else "auto"
    dark = ui.dark_mode(DARK[chosen])
    with (
        ui.element("header").classes("ew-head w-full px-4 py-2"),
        ui.row().classes("items-center gap-x-3 gap-y-2 w-full"),
    ):
        for path, title in (("/", "elusive workbench"), OWN, *((page.path, page.short) for page in pages())):
            link = ui.link(title, path)
            if path == here:
                link.classes("ew-here").props('aria-current="page"')
        ui.space()

        def choose(event: Any) -> None:
            dark.set_value(DARK[event.value])
            COLOURS[ui.context.client] = event.value
            ui.run_javascript(
                f"document.cookie = '{COOKIE}={event.value}; path=/; SameSite=Strict; max-age=31536000';"
                "for (const one of document.querySelectorAll('iframe'))"
                f"  one.src = one.src.split('#')[0] + '#{event.value}';"  # reports, which cannot see where they stand
            )

        ui.select(
            {"auto": "as the system", "light": "light", "dark": "dark"},
            value=chosen, label="Colours", on_change=choose,
        ).props("dense outlined options-dense").classes("w-36")  # fmt: skip


@contextmanager
def main(title: str, lead: str) -> Iterator[None]:
    """Open the body of a page under a title."""
    with ui.element("main").classes("ew-main"), ui.column().classes("w-full gap-3"):
        ui.html(f'<h1 class="ew-title">{title}</h1>', sanitize=False)
        ui.label(lead).classes("ew-lead")
        yield


@contextmanager
def waiting(words: str) -> Iterator[None]:
    """Say what is being done, until it is."""
    with ui.element("div").classes("ew-row") as row:
        ui.spinner()
        ui.label(words)
    yield
    row.delete()


@contextmanager
def window() -> Iterator[tuple[Any, Any]]:
    """Open a window: what is set on the left, what is seen on the right."""
    with ui.element("div").classes("ew-window"):
        side = ui.element("section").classes("ew-side ew-box")
        stage = ui.element("section").classes("ew-stage ew-box")
    yield side, stage


class Stepping(Protocol):
    """State of a tab that notes which step is open."""

    step: str | None


class Steps:
    """The steps of a page as tabs; a step is built anew, from the tab's state, whenever it is opened.

    Parameters
    ----------
    state
        What the tab holds.
    steps
        Title of each, and what builds it.
    first
        Opened if this tab has none open yet; else the first of all.
    """

    def __init__(
        self, state: Stepping, steps: Mapping[str, Callable[[], Any]], first: str | None = None
    ) -> None:  # fmt: skip
        self._state, self._builders = state, steps
        with ui.tabs().props('align="left" dense no-caps outside-arrows mobile-arrows').classes("w-full") as self._tabs:
            for title in steps:
                ui.tab(title)
        self._box = ui.element("div").classes("w-full").props('role="tabpanel"')
        self._tabs.on_value_change(lambda event: self._build(event.value))
        self._tabs.set_value(state.step or first or next(iter(steps)))

    def go(self, title: str) -> None:
        """Open a step."""
        if self._tabs.value == title:
            self._build(title)
        self._tabs.set_value(title)

    def _build(self, title: str) -> None:
        self._state.step = title
        self._box.clear()
        self._box.props(f'aria-label="{title}"')
        with self._box:
            self._builders[title]()
