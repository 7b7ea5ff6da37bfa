"""Detect and track what is too faint, too noise-like, too fast or too poorly charted for detect-then-track."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from elusive.errors import DataError, ElusiveError, ParameterError, StoreError

if TYPE_CHECKING:
    from elusive.runner import collect, run

__version__ = "0.1.0"
__all__ = ["DataError", "ElusiveError", "ParameterError", "StoreError", "__version__", "collect", "run"]

_LAZY = {"collect": "elusive.runner", "run": "elusive.runner"}


def __getattr__(name: str) -> Any:
    """Load a public name where it is first used: importing the package alone stays quick."""
    if name in _LAZY:
        return getattr(import_module(_LAZY[name]), name)
    raise AttributeError(f"module 'elusive' has no attribute {name!r}")
