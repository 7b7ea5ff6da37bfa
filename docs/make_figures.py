"""Make what the pages show but is too long to make at each build: the README's picture, the papers' tables, figures."""

from __future__ import annotations

import csv
import shutil
import sys
from concurrent.futures import Executor
from pathlib import Path
from tempfile import TemporaryDirectory

from figures import choose
from PIL import Image

from elusive.campaign import make_executor
from elusive.experiments.amrouche2018.reproduce import reproduce
from elusive.experiments.amrouche2018.trial import FILTERS
from elusive.experiments.bootsveld2012.phases import Phase
from elusive.experiments.bootsveld2012.reproduce import Settings
from elusive.experiments.bootsveld2012.reproduce import reproduce as reproduce_bootsveld2012
from elusive.experiments.bootsveld2012.runtimes import RunTime
from elusive.experiments.demo import run_demo
from elusive.experiments.mazurek2013.figures import FIGURES
from elusive.experiments.mazurek2013.reproduce import reproduce as reproduce_mazurek2013
from elusive.experiments.mazurek2013.table import Cell

STATIC = Path(__file__).parent / "_static"
TRIALS = 400
SNRS_DB = (3.18, 6.71, 12.0)
# (motion, filter): existence in frames 10-24, in 26-27, RMSE in 10-24 at each SNR, by an independent NumPy prototype
# (1000 runs, constant velocity; its coordinated turn was run for one filter at two SNRs)
PROTOTYPE: dict[tuple[str, str], tuple[tuple[str, str, str], ...]] = {
    ("cv", "paper"): ((".43", ".30", "3.10"), (".53", ".14", "2.67"), (".65", ".01", "2.44")),
    ("cv", "paper-bright"): ((".44", ".30", "3.26"), (".76", ".16", "1.65"), (".93", ".02", ".63")),
    ("cv", "paper-measurement"): ((".56", ".34", "2.48"), (".86", ".18", "1.08"), (".99", ".02", ".33")),
    ("cv", "bernoulli-uniform"): ((".59", ".38", "2.34"), (".78", ".18", "1.42"), (".91", ".02", ".78")),
    ("cv", "bernoulli-measurement"): ((".67", ".39", "1.91"), (".92", ".18", ".78"), (".995", ".02", ".23")),
    ("cv", "near-optimal"): ((".76", ".39", "1.53"), (".94", ".17", ".54"), (".997", ".02", ".20")),
    ("ct", "bernoulli-measurement"): ((".67", "", "2.42"), (".92", "", ".81"), ("", "", "")),
}


def main() -> None:
    """Make all.

    The first argument, if any, is a folder that what is unfinished is kept in and goes on from; the second a shoreline
    round Port Fourchon, for docs/bootsveld2012.md.
    """
    with TemporaryDirectory() as scratch, make_executor(workers=2) as executor:
        run_demo(Path(scratch) / "demo")
        shutil.copy(Path(scratch) / "demo" / "report.png", STATIC / "demo.png")
        kept = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(scratch)
        choose.main(STATIC / "choose.png")
        noise_objects(kept / "mazurek2013", executor)
        imprecise_charts(kept / "bootsveld2012", Path(sys.argv[2]) if len(sys.argv) > 2 else None, executor)
        results = kept / "amrouche2018"
        reproduce(results, trials=TRIALS, executor=executor)
        shutil.copy(results / "summary.csv", STATIC / "amrouche2018.csv")
        shutil.copy(results / "fig2.png", STATIC / "amrouche2018-fig2.png")
    with (STATIC / "amrouche2018.csv").open(encoding="utf-8", newline="") as file:
        cells = list(csv.DictReader(file))
    for motion in ("cv", "ct"):
        (STATIC / f"amrouche2018-{motion}.md").write_text(table(cells, motion), encoding="utf-8")


def noise_objects(results: Path, executor: Executor | None) -> None:
    """Make the figures and the table of docs/mazurek2013.md."""
    done = reproduce_mazurek2013(results, executor=executor)
    for name in FIGURES:
        with Image.open(results / f"{name}.png") as picture:  # 256 colours do, in a third of the bytes
            picture.convert("RGB").quantize(256).save(STATIC / f"mazurek2013-{name}.png", optimize=True)
    (STATIC / "mazurek2013-table.md").write_text(check_table(done.cells), encoding="utf-8")


def imprecise_charts(results: Path, shoreline: Path | None, executor: Executor | None) -> None:
    """Make the figures and tables of docs/bootsveld2012.md; run times on the synthetic delta, which has more edges."""
    names = ("coast", "a12", "a13", "b15", "b17", "fig5_4", "fig6_9")
    done = reproduce_bootsveld2012(results, [*names, "phases"], Settings(shoreline=shoreline), executor=executor)
    for name in names:
        with Image.open(results / f"{name}.png") as picture:
            picture.convert("RGB").quantize(256).save(STATIC / f"bootsveld2012-{name}.png", optimize=True)
    (STATIC / "bootsveld2012-phases.md").write_text(phase_table(done.phases), encoding="utf-8")
    timed = reproduce_bootsveld2012(results, ["runtimes"], Settings()).run_times
    (STATIC / "bootsveld2012-runtimes.md").write_text(run_time_table(timed), encoding="utf-8")


def phase_table(rows: list[Phase]) -> str:
    """Write the phases as a Markdown table, the prototype's values in brackets."""
    half = len(rows) // 2
    lines = ["| t [s] | inland [m] | PF2: hard | PF3: eq. 4.8 |", "| --: | --: | --: | --: |"]
    for pair in zip(rows[:half], rows[half:], strict=True):
        found = [f"{row.bias_m:.2f} ± {row.standard_error_m:.2f} ({row.check_m:g})" for row in pair]
        lines.append(f"| {pair[0].time_s} | {pair[0].inland_m:.1f} | {' | '.join(found)} |")
    return "\n".join(lines) + "\n"


def run_time_table(rows: list[RunTime]) -> str:
    """Write the run times as a Markdown table."""
    lines = [
        "| Method | prepare [s] | a run [s] | of it the chart [s] | memory [MB] | the thesis |",
        "| :-- | --: | --: | --: | --: | :-- |",
    ]
    for row in rows:
        times = [f"{value:.2g}" if value else "" for value in (row.prepare_s, row.run_s, row.chart_s)]
        size = f"{row.megabytes:.3g}" if row.megabytes else ""
        lines.append(f"| {row.method} | {' | '.join(times)} | {size} | {row.thesis} |")
    return "\n".join(lines) + "\n"


def check_table(cells: list[Cell]) -> str:
    """Write the cells as a Markdown table, a row for each search: mean error, and check value in brackets."""
    sigmas = sorted({cell.background_sigma for cell in cells})
    lines = [
        f"| Object | Search | {' | '.join(f'{sigma:g}' for sigma in sigmas)} |",
        f"| --: | :-- |{' --: |' * len(sigmas)}",
    ]
    for number in range(0, len(cells), len(sigmas)):
        row = cells[number : number + len(sigmas)]
        digits = [1 if 0.05 <= cell.mean_error < 9.95 else 0 for cell in row]
        shown = [f"{cell.mean_error:.{n}f} ({cell.check})" for cell, n in zip(row, digits, strict=True)]
        size, name, window, smoothing = row[0][:4]
        search = f"{name}, {window}" + ("" if smoothing == 0.98 else f", α {smoothing:g}")
        lines.append(f"| {size} | {search} | {' | '.join(shown)} |")
    return "\n".join(lines) + "\n"


def table(cells: list[dict[str, str]], motion: str) -> str:
    """Write the cells of one motion as a Markdown table, measured values beside the prototype's."""
    lines = [
        "| Filter | SNR [dB] | P, 10-24 | P, 26-27 | RMSE, 10-24 | prototype |",
        "| :-- | --: | --: | --: | --: | --: |",
    ]
    for cell in (cell for cell in cells if cell["motion"] == motion):
        known = PROTOTYPE.get((motion, cell["filter"]))
        values = known[SNRS_DB.index(float(cell["snr_db"]))] if known else ()
        name = FILTERS[cell["filter"]].label if float(cell["snr_db"]) == SNRS_DB[0] else ""
        measured = [
            f"{shown(cell[key])} ± {shown(cell[f'{key}_se'])}"
            for key in ("existence_10_24", "existence_26_27", "rmse_10_24")
        ]
        row = [name[:1].upper() + name[1:], cell["snr_db"], *measured, " / ".join(filter(None, values))]
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


def shown(number: str) -> str:
    """Write a number with three decimals below one, two above, four where three would show nothing."""
    value = float(number)
    return f"{value:.{2 if value >= 1 else 3 if value >= 0.0005 else 4}f}"


if __name__ == "__main__":
    main()
