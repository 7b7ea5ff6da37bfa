"""What every system's folder of a tracked recording holds beside its table, which the log writes, and its report."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from elusive.checks import Finding, write_checks
from elusive.results.log import TrackLog
from elusive.results.netcdf import Variable, write_result
from elusive.results.scores import Scored


def write_recording(
    folder: Path,
    log: TrackLog,
    findings: Iterable[Finding],
    scores: Scored | None,
    *,
    title: str,
    config: str,
    more: Mapping[str, Variable] | None = None,
    timed: bool = True,
) -> None:
    """Write ``result.nc``, ``checks.json``, ``config.yaml``, which repeats the run, and scores where there are any.

    Arguments as of :func:`~elusive.results.netcdf.write_result`.

    Raises
    ------
    DataError
        If a file cannot be written.
    """
    write_result(folder / "result.nc", log, title=title, config=config, more=more, timed=timed)
    write_checks(folder, findings)
    (folder / "config.yaml").write_text(config, encoding="utf-8")
    if scores is not None:
        scores.write(folder)
