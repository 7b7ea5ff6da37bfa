"""Settings of the server, made when it starts."""

from __future__ import annotations

from pathlib import Path

from elusive.workbench.asking import Recording


class Settings:
    """Set once, before the first page."""

    folder = Path()
    recordings: tuple[Recording, ...] = ()  # that can be tracked
    pages: tuple[str, ...] = ()  # modules, each with a PAGE, in the order of the cards


SETTINGS = Settings()
