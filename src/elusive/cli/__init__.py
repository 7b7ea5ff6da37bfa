"""The command line: `elusive track`, `locate`, `fit`, `chart`, `simulate`, `reproduce` and others; pipelines do it."""

from __future__ import annotations

import atexit
import errno
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

import elusive
from elusive.cli.extras import extra_of
from elusive.cli.lazy import lazy
from elusive.cli.terminal import console, interrupt, say
from elusive.errors import ElusiveError

BAD_INPUT, INTERRUPTED = 2, 130
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
CHARTS = (".000", ".geojson", ".json", ".shp")
COMMANDS = {
    "demo": "elusive.cli.demo:demo_command",
    "track": "elusive.cli.track:app",
    "plots": "elusive.cli.video:plots_command",
    "locate": "elusive.cli.locate:locate_command",
    "serve": "elusive.cli.serve:serve_command",
    "replay": "elusive.cli.replay:replay_command",
    "fit": "elusive.cli.fit:app",
    "chart": "elusive.cli.charts:chart_command",
    "simulate": "elusive.cli.simulate:app",
    "workbench": "elusive.cli.workbench:workbench_command",
    "scene": "elusive.cli.scene:scene_command",
    "reproduce": "elusive.cli.reproduce:app",
    "campaign": "elusive.cli.campaigns:campaign_command",
}

app = typer.Typer(
    cls=lazy(COMMANDS), no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, help=elusive.__doc__
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command; a fault of the input is one sentence and exit code 2, Ctrl-C is 130."""
    previous = signal.signal(signal.SIGINT, interrupt)
    try:
        app(args=_spread(sys.argv[1:] if arguments is None else arguments), standalone_mode=True)
    except (ElusiveError, ModuleNotFoundError, OSError) as error:
        told = _told(error)
        if told is None:
            raise
        console.print(f"[bold red]Error:[/] {escape(told)}", highlight=False, soft_wrap=True)
        sys.exit(BAD_INPUT)
    except (KeyboardInterrupt, SystemExit) as ended:  # the former while a command is loaded, the latter while it runs
        code = getattr(ended, "code", INTERRUPTED)
        if code == INTERRUPTED and previous is not interrupt:  # else this command is a part of another's
            say("Interrupted.")
        sys.exit(code)
    finally:
        signal.signal(signal.SIGINT, previous)


def _told(error: Exception) -> str | None:
    """Return what is said of an error that a person can mend; None: a fault of the program."""
    if isinstance(error, ModuleNotFoundError):
        extra = extra_of(error.name)
        return extra and f"{error.name} is not installed; run pip install 'elusive[{extra}]'."
    if isinstance(error, OSError):
        # what writes results says itself what could not be written; compiled code, say, is kept elsewhere
        return f"{error}; make room on that disk." if error.errno in NO_ROOM else None
    return str(error)


def entry() -> None:
    """Run as a program, which ends without taking the interpreter apart: that takes as long as loading NumPy."""
    code = 1

    def end() -> None:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(code)

    atexit.register(end)  # what is registered first is called last
    try:
        main()
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        raise
    code = 0


def _spread(arguments: Sequence[str]) -> list[str]:
    """Write ``--chart A B`` as ``--chart A --chart B``, as an option takes one value; charts have known endings."""
    spread: list[str] = []
    among_charts = False
    for argument in arguments:
        is_chart = Path(argument).suffix.lower() in CHARTS
        if among_charts and is_chart and spread[-1] != "--chart":
            spread.append("--chart")
        among_charts = argument == "--chart" or (among_charts and (is_chart or spread[-1] == "--chart"))
        spread.append(argument)
    return spread


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"elusive {elusive.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Detect and track what is too faint, too noise-like, too fast or too poorly charted for detect-then-track."""
