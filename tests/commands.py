"""Commands run in this process, as their tests do."""

from __future__ import annotations

from typing import Any

from elusive.cli import main


def ran(capture: Any, *arguments: object) -> tuple[int, str]:
    """Run a command: its exit code, and all it said on one line."""
    code: Any = 0
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as end:
        code = end.code or 0
    said = capture.readouterr()
    return code, " ".join((said.out + said.err).split())
