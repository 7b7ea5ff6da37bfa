"""What commands share that track a recording: options of the truth and of frames, and how its run is told."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from elusive.cli.live import send_recording, tell
from elusive.cli.terminal import say, show, show_run, tell_findings, tell_written
from elusive.io.sinks import Sinks

if TYPE_CHECKING:
    from elusive.checks import Finding

RateHz = Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")]
Start = Annotated[int, typer.Option(help="First frame to use, from 0.")]
Stop = Annotated[int | None, typer.Option(help="Frame before which to stop.")]
Charts = Annotated[
    list[Path] | None,
    typer.Option(
        "--chart", help="S-57 base cells (.000) or a folder of them, GeoJSON or shapefiles of land, one or several."
    ),
]
SHIPS = ".csv of time_s, track, x_m, y_m or lon_deg, lat_deg; AIS log"


class Outcome(Protocol):
    """What a tracked recording came to."""

    @property
    def scored(self) -> object:
        """Its scores; None without a truth."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was checked."""


def truth_of(whom: str, columns: str) -> Any:
    """Return the option that names the truth."""
    return typer.Option("--truth", help=f"Where {whom} truly are: {columns}. Scores.")


def cutoff_in(unit: str, usual: str) -> Any:
    """Return the option of the scores' cut-off."""
    help_ = f"Scores: further off is missed; c of GOSPA; by default {usual}."
    return typer.Option(f"--truth-cutoff-{unit}", help=help_)


def tell_run(
    outcome: Outcome,
    table: tuple[str, Sequence[tuple[str, str]]],
    out: Path,
    files: Sequence[str],
    sinks: Sinks,
    *,
    strict: bool,
    verdict: str = "",
    remarks: Iterable[str] = (),
    tracks: tuple[Sequence[str], Sequence[Sequence[str]]] = ((), ()),
) -> None:
    """Say what a recording came to, send it to the sinks, and end with what does not hold.

    Parameters
    ----------
    outcome
        Its scores and findings.
    table
        Of the run: a title, and rows.
    out, files
        Folder of the results, and what stands in it besides the scores.
    sinks
        Where the tracks go too.
    strict
        End with 3 where a finding is grave.
    verdict, remarks
        In words.
    tracks
        Header of their table, and lines.
    """
    for remark in remarks:
        tell(remark)
    if verdict:
        say(verdict)
    header, lines = tracks
    if lines:
        show("Tracks", header, lines)
    show_run(*table, outcome.findings)
    tell_written(out, files, outcome.scored)
    send_recording(sinks, out)
    tell_findings(outcome.findings, strict=strict)
