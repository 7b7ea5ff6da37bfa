"""What a tab of the browser holds: its own, found again after a reload or a lost connection."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from typing import Any, TypeVar

from nicegui import app, ui

State = TypeVar("State")
TABS_MOST = 24
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


async def state_of(name: str, make: Callable[[], State]) -> State:
    """Return this tab's state of a page, made on its first visit; the longest unused is dropped when there are many."""
    await ui.context.client.connected()
    key = (str(app.storage.tab.setdefault("tab", ui.context.client.id)), name)
    state: State = _STATES.pop(key) if key in _STATES else make()
    _STATES[key] = state
    while len(_STATES) > TABS_MOST:
        _STATES.popitem(last=False)
    return state
