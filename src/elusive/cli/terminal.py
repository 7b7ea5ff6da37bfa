"""What commands share: options, the console, Ctrl-C, progress, tables."""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from elusive.errors import ParameterError
from elusive.options import PROGRESS

if TYPE_CHECKING:
    from elusive.campaign import Progress as CampaignProgress
    from elusive.checks import Finding
    from elusive.io.truth import Truth, Unit

Out = Annotated[Path, typer.Option("--out", help="Folder for the results; made if need be.")]
Config = Annotated[Path | None, typer.Option("--config", help="YAML file with any of the parameters below.")]
OneBased = Annotated[bool, typer.Option(help="The truth counts frames and places from 1.")]
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 3, once all is written, if the numbers are not to be believed.")
]
Workers = Annotated[int | None, typer.Option("--workers", min=1, help="Processes to share the trials among.")]
Scheduler = Annotated[str | None, typer.Option("--scheduler", help="Address of a Dask scheduler, tcp://host:8786.")]

NOT_BELIEVED = 3  # exit code of --strict
WHOLE = ("numba", "llvmlite", "elusive.io.atomic")  # where nothing may be raised: compilers, and who renames files
AGAIN_S = 0.05

console = Console(stderr=True)


def say(sentence: str) -> None:
    """Say something on the terminal as it stands: brackets in a path are no mark-up, and no line is broken."""
    console.print(sentence, markup=False, emoji=False, highlight=False, soft_wrap=True)


def interrupt(signum: int, frame: FrameType | None) -> None:
    """End the command at a Ctrl-C; one amid what has to be whole comes again once that is over."""
    while frame is not None:
        if frame.f_globals.get("__name__", "").startswith(WHOLE):
            again = threading.Timer(AGAIN_S, _thread.interrupt_main)
            again.daemon = True
            again.start()
            return
        frame = frame.f_back
    raise KeyboardInterrupt


@contextmanager
def ended_softly(stop: Callable[[], None]) -> Iterator[threading.Event]:
    """Let a first Ctrl-C stop what runs, which ends by itself then; a second does not wait. Gives whether it was."""
    pressed = threading.Event()

    def press(signum: int, frame: FrameType | None) -> None:
        if pressed.is_set():
            interrupt(signum, frame)
        pressed.set()
        stop()

    previous = signal.signal(signal.SIGINT, press)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, previous)


@contextmanager
def bar(what: str, total: int | None) -> Iterator[Callable[[int], None]]:
    """Show how many are done; gives what is to be called with that number."""
    from elusive.cli.compiling import announced_compilation  # loads Numba, which not every command needs

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    shown = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with announced_compilation(_say_compiling), shown as progress:
        task = progress.add_task(what, total=total)

        def advance(done: int) -> None:
            progress.update(task, completed=done)
            if PROGRESS in os.environ:
                print(f"{PROGRESS} {done} {total or 0} {what}", file=sys.stderr, flush=True)

        yield advance


def _say_compiling() -> None:
    if console.is_terminal:
        say("Compiling: the first run of a filter takes up to a minute longer.")


@contextmanager
def campaign_bar() -> Iterator[Callable[[CampaignProgress], None]]:
    """Show how far a campaign is, and the time left."""
    columns = (TextColumn("trials"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=None)

        def report(state: CampaignProgress) -> None:
            left = "" if state.remaining_s is None else f"{state.remaining_s:.0f} s left"
            progress.update(task, completed=state.done, total=state.total, description=left)

        yield report


def known_truth(path: Path | None, unit: Unit, *, one_based: bool = False, cutoff: float | None = None) -> Truth | None:
    """Read where targets truly are, if that is told; what has a meaning for scores alone is refused without."""
    from elusive.io.truth import read_truth

    check_scores(path, truth_one_based=one_based, truth_cutoff=cutoff)
    return None if path is None else read_truth(path, unit, one_based=one_based)


def check_scores(truth: Path | None, **given: object) -> None:
    """Refuse options, by their names, that have a meaning for scores alone where no truth is told.

    Raises
    ------
    ParameterError
        If one is given.
    """
    for name, value in given.items():
        if truth is None and value is not None and value is not False:
            flag = name.replace("_", "-")
            raise ParameterError(f"--{flag}: has no meaning without --truth; give that, or leave it out.")


def tell_written(out: Path, files: Sequence[str], scored: object) -> None:
    """Say what stands in a folder; with the scores, where there are any."""
    from elusive.results.scores import FILES  # loads SciPy, which not every command needs

    names = ", ".join([*files, *(() if scored is None else FILES)])
    say(f"Written to {out}: {names}")


def show_run(title: str, rows: Sequence[tuple[str, str]], findings: Iterable[Finding]) -> None:
    """Print a run's table, above all what is not to be believed of it."""
    from elusive.checks import doubted  # loads SciPy, which not every command needs

    show(title, ("", ""), doubted(rows, findings))


def tell_findings(findings: Iterable[Finding], *, strict: bool) -> None:
    """Say what does not hold, as a command's last lines; with ``strict``, end with 3 if that is grave."""
    from elusive.checks import broken, grave  # loads SciPy, which not every command needs

    failing = broken(findings)
    for one in failing:
        colour = "bold red" if one.grave else "yellow"
        said = f"[{colour}]{escape(one.name)}:[/] {escape(f'{one.sentence} {one.remedy}'.rstrip())}"
        console.print(said, highlight=False, soft_wrap=True)
    if strict and grave(failing):
        raise typer.Exit(NOT_BELIEVED)


def show(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table to standard output."""
    table = Table(title=title, title_justify="left", show_header=any(header), title_style="bold")
    for number, name in enumerate(header):
        table.add_column(name, justify="left" if number == 0 else "right")
    for row in rows:
        table.add_row(*row)
    Console().print(table)
