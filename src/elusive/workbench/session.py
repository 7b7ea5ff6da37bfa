"""What a tab of the browser holds: its own, found again after a reload or a lost connection."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, TypeVar

from nicegui import app, ui

State = TypeVar("State")
TABS_MOST = 24
ASIDE = ", put aside"
_STATES: OrderedDict[tuple[str, str], Any] = OrderedDict()


async def is_asked_anew(name: str, token: str) -> bool:
    """Tell whether a page's example is asked for, and was not by the same token: a reload does not run it again."""
    if not token:
        return False
    await ui.context.client.connected()
    ran = app.storage.tab.setdefault("examples", {})
    is_new = ran.get(name) != token
    ran[name] = token
    return bool(is_new)


async def example_state(name: str, make: Callable[[], State]) -> tuple[State, State]:
    """Return a fresh state for a page's example, and the one that stood; where a scene was set there, it is put aside.

    :func:`offer_aside` gives it back.
    """
    had: Any = await state_of(name, make)
    fresh: Any = make()
    tab = str(app.storage.tab["tab"])
    if had.scene != fresh.scene:
        _STATES[tab, name + ASIDE] = had
    _STATES[tab, name] = fresh
    return fresh, had


def offer_aside(name: str) -> None:
    """Build the way back to what was put aside for an example; nothing where nothing was."""
    tab = str(app.storage.tab["tab"])

    def back() -> None:
        if (tab, name + ASIDE) in _STATES:
            _STATES[tab, name] = _STATES.pop((tab, name + ASIDE))
        ui.navigate.reload()

    if (tab, name + ASIDE) in _STATES:
        with ui.element("div").classes("ew-row ew-changed").props('role="status"'):
            ui.label("What you had set here was put aside for the example.")
            ui.button("Back to it", on_click=back).props("flat no-caps dense")


async def state_of(name: str, make: Callable[[], State]) -> State:
    """Return this tab's state of a page, made on its first visit; the longest unused is dropped when there are many."""
    await ui.context.client.connected()
    key = (str(app.storage.tab.setdefault("tab", ui.context.client.id)), name)
    state: State = _STATES.pop(key) if key in _STATES else make()
    _STATES[key] = state
    while len(_STATES) > TABS_MOST:
        _STATES.popitem(last=False)
    return state
