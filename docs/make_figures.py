"""Make what the pages show but is too long to make at each build: the README's picture, the papers' tables, figures."""

from __future__ import annotations

import csv
import math
import shutil
import sys
from concurrent.futures import Executor
from pathlib import Path
from tempfile import TemporaryDirectory

from figures import believe_bearings, believe_images, believe_signals, choose, several
from PIL import Image

from elusive.campaign import make_executor
from elusive.experiments.amrouche2018.reproduce import reproduce
from elusive.experiments.amrouche2018.trial import FILTERS
from elusive.experiments.bootsveld2012.phases import Phase
from elusive.experiments.bootsveld2012.reproduce import Settings
from elusive.experiments.bootsveld2012.reproduce import reproduce as reproduce_bootsveld2012
from elusive.experiments.bootsveld2012.runtimes import RunTime
from elusive.experiments.davies2024.reproduce import Row
from elusive.experiments.davies2024.reproduce import reproduce as reproduce_davies2024
from elusive.experiments.demo import run_demo
from elusive.experiments.jiang2024.figures import FIGURES as FLIGHTS
from elusive.experiments.jiang2024.reproduce import reproduce as reproduce_jiang2024
from elusive.experiments.jiang2024.scenario import MOTIONS, SIGMAS_DEG
from elusive.experiments.jiang2024.table import Cell as FlightCell
from elusive.experiments.jiang2024.trial import ESTIMATORS
from elusive.experiments.mazurek2013.figures import FIGURES
from elusive.experiments.mazurek2013.reproduce import reproduce as reproduce_mazurek2013
from elusive.experiments.mazurek2013.table import Cell
from elusive.experiments.mendieta2017.figures import draw as draw_people
from elusive.experiments.mendieta2017.reproduce import reproduce as reproduce_mendieta2017
from elusive.experiments.mendieta2017.scenario import METHODS, MethodName
from elusive.experiments.mendieta2017.table import EXPERIMENTS
from elusive.experiments.mendieta2017.table import Cell as PeopleCell

STATIC = Path(__file__).parent / "_static"
TRIALS = 400
PEOPLE_RUNS: tuple[tuple[int, tuple[MethodName, ...]], ...] = ((100, ("thesis", "binary")), (20, ("image", "links")))
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
    round Port Fourchon, for docs/bootsveld2012.md; the third that of the published scenes, for docs/davies2024.md.
    """
    with TemporaryDirectory() as scratch, make_executor(workers=2) as executor:
        run_demo(Path(scratch) / "demo")
        shutil.copy(Path(scratch) / "demo" / "report.png", STATIC / "demo.png")
        kept = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(scratch)
        believe_images.main(STATIC / "believe-images.png")
        believe_bearings.main(STATIC / "believe-bearings.png")
        believe_signals.main(STATIC / "believe-signals.png")
        choose.main(STATIC / "choose.png")
        several.main(STATIC / "several-targets.png")
        noise_objects(kept / "mazurek2013", executor)
        imprecise_charts(kept / "bootsveld2012", Path(sys.argv[2]) if len(sys.argv) > 2 else None, executor)
        people(kept / "mendieta2017", executor)
        fast_emitters(kept / "jiang2024", executor)
        if len(sys.argv) > 3:
            targets_that_add_up(kept / "davies2024", Path(sys.argv[3]))
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
    """Make the figures and tables of docs/bootsveld2012.md; cells and times on the synthetic delta: more edges."""
    names = ("coast", "a12", "a13", "b15", "b17", "fig5_4", "fig6_9", "b2")
    done = reproduce_bootsveld2012(results, [*names, "phases"], Settings(shoreline=shoreline), executor=executor)
    cells = ("fig7_2", "fig7_3")
    timed = reproduce_bootsveld2012(results, [*cells, "runtimes"], Settings()).run_times
    for name in (*names, *cells):
        with Image.open(results / f"{name}.png") as picture:
            picture.convert("RGB").quantize(256).save(STATIC / f"bootsveld2012-{name}.png", optimize=True)
    (STATIC / "bootsveld2012-phases.md").write_text(phase_table(done.phases), encoding="utf-8")
    (STATIC / "bootsveld2012-runtimes.md").write_text(run_time_table(timed), encoding="utf-8")


def people(results: Path, executor: Executor | None) -> None:
    """Make the figures and tables of docs/mendieta2017.md."""
    cells: list[PeopleCell] = []
    for trials, methods in PEOPLE_RUNS:
        cells += reproduce_mendieta2017(results, methods=methods, trials=trials, executor=executor).cells
    for name in dict.fromkeys(cell.experiment for cell in cells):
        here = [cell for cell in cells if cell.experiment == name]
        (STATIC / f"mendieta2017-{name}.md").write_text(people_table(here), encoding="utf-8")
        for noise in sorted({cell.awgn_db for cell in here}):
            path = results / f"docs-{name}-{noise:g}.png"
            draw_people(path, name, here, noise)
            shown = f"mendieta2017-{name}.png" if noise == 0.25 else f"mendieta2017-{name}-awgn{noise:g}.png"
            with Image.open(path) as picture:
                picture.convert("RGB").quantize(256).save(STATIC / shown, optimize=True)


def people_table(cells: list[PeopleCell]) -> str:
    """Write the cells of an experiment as a Markdown table, a row for each point and tracker."""
    label = EXPERIMENTS[cells[0].experiment].label
    head = (
        label[:1].upper() + label[1:],
        "tracker",
        "runs",
        "MOTA",
        "misses",
        "false",
        "mismatches",
        "mean dev. [m]",
        "max dev. [m]",
    )
    lines = [f"| {' | '.join(head)} |", f"| :-- | :-- |{' --: |' * (len(head) - 2)}"]
    points: dict[tuple[str, float], dict[str, dict[str, PeopleCell]]] = {}
    for cell in cells:
        points.setdefault((cell.value, cell.awgn_db), {}).setdefault(cell.method, {})[cell.score] = cell
    for (value, noise), methods in points.items():
        name = value if noise == 0.25 else f"{value}, AWGN {noise:g}"
        counts = ("misses", "false_positives", "mismatches")
        for number, (method, of) in enumerate((method, methods[method]) for method in METHODS if method in methods):
            mota, deviation, worst = of["mota"], of["mean_deviation_m_head"], of["max_deviation_m_least"]
            row = [
                name if number == 0 else "", METHODS[method], f"{mota.runs}",
                f"{mota.mean:.3f} ± {mota.standard_error:.3f}",
                *(f"{of[count].mean:.1f} ({of[count].p10:.0f} to {of[count].p90:.0f})" for count in counts),
                f"{deviation.mean:.2f}", f"{worst.mean:.2f} ({worst.p10:.2f} to {worst.p90:.2f})",
            ]  # fmt: skip
            lines.append(f"| {' | '.join(row)} |")
        printed = [of[count].thesis for count in (*counts, "max_deviation_m_least")]
        if any(printed):
            lines.append(f"| | *the thesis, single runs* | | | {' | '.join(printed[:3])} | | {printed[3]} |")
    return "\n".join(lines) + "\n"


def fast_emitters(results: Path, executor: Executor | None) -> None:
    """Make the figures and tables of docs/jiang2024.md and docs/bearings.md."""
    cells = reproduce_jiang2024(results, executor=executor).cells
    (STATIC / "jiang2024-table.md").write_text(flight_table(cells), encoding="utf-8")
    (STATIC / "jiang2024-samples.md").write_text(sample_table(cells), encoding="utf-8")
    for name in FLIGHTS:
        with Image.open(results / f"{name}.png") as picture:
            picture.convert("RGB").quantize(256).save(STATIC / f"jiang2024-{name}.png", optimize=True)


def targets_that_add_up(results: Path, data: Path) -> None:
    """Make the figure and the table of docs/davies2024.md."""
    rows = reproduce_davies2024(results, data, anew=50)
    (STATIC / "davies2024-table.md").write_text(field_table(rows), encoding="utf-8")
    with Image.open(results / "gospa.png") as picture:
        picture.convert("RGB").quantize(256).save(STATIC / "davies2024-gospa.png", optimize=True)


def field_table(rows: list[Row]) -> str:
    """Write a row a scene and filter."""
    head = ("Scene", "filter", "runs", "RMS GOSPA", "localisation", "missed", "false")
    lines = [f"| {' | '.join(head)} |", f"| --: | :-- |{' --: |' * (len(head) - 2)}"]
    for row in rows:
        parts = ("" if math.isnan(part) else f"{part:.3g}" for part in (row.localisation, row.missed, row.false))
        lines.append(f"| {row.scene} | {row.filter} | {row.runs} | {row.rms_gospa:.2f} | {' | '.join(parts)} |")
    return "\n".join(lines) + "\n"


def flight_table(cells: list[FlightCell]) -> str:
    """Write RMSE, the paper's in brackets, the bound, and NEES; standard errors are 1 to 3 % and stand in the CSV."""
    head = ("Flight", "estimator", *(f"{sigma:g}°" for sigma in SIGMAS_DEG), "NEES at 1°, 15°")
    lines = [f"| {' | '.join(head)} |", f"| :-- | :-- |{' --: |' * (len(head) - 2)}"]
    for motion in MOTIONS:
        for number, name in enumerate(ESTIMATORS):
            row = [cell for cell in cells if (cell.motion, cell.filter) == (motion, name)]
            found = [f"{cell.rmse_m:.{2 if cell.rmse_m < 9.995 else 1}f}{printed(cell.paper_m)}" for cell in row]
            first = f"{row[0].nees:.2f}, {row[2].nees:.{1 if row[2].nees < 99.5 else 0}f}"
            lines.append(f"| {motion.upper() if number == 0 else ''} | {name} | {' | '.join(found)} | {first} |")
        bounds = [f"{cell.bound_m:.2f}" for cell in row]
        lines.append(f"| | *bound* | {' | '.join(bounds)} | 2 |")
    return "\n".join(lines) + "\n"


def sample_table(cells: list[FlightCell]) -> str:
    """Write the number of samples at which the bound is the paper's value, two significant digits."""
    head = ("Flight", "row", *(f"{sigma:g}°" for sigma in SIGMAS_DEG))
    lines = [f"| {' | '.join(head)} |", f"| :-- | :-- |{' --: |' * len(SIGMAS_DEG)}"]
    for motion in MOTIONS:
        for name in ("fg-ekf", "fg-eks"):
            row = [cell for cell in cells if (cell.motion, cell.filter) == (motion, name)]
            needed = [f"{float(f'{cell.samples_for_paper:.2g}'):g}" for cell in row]
            lines.append(f"| {motion.upper()} | {name[3:].upper()} | {' | '.join(needed)} |")
    return "\n".join(lines) + "\n"


def printed(value: float) -> str:
    """Write a value of the paper in brackets, nothing where it has none."""
    return "" if value != value else f" ({value:g})"


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
