"""Run the campaigns behind the figures, time the methods, and write them; a killed run goes on where it was."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from elusive.campaign import CampaignConfig, Progress, run_campaign
from elusive.errors import ParameterError
from elusive.experiments.bootsveld2012 import clouds, curves, influence, maps, partitions, ways
from elusive.experiments.bootsveld2012.case import Way, scenery
from elusive.experiments.bootsveld2012.curves import Point, Summary
from elusive.experiments.bootsveld2012.phases import CHECK, RANGE_M, Phase, phases
from elusive.experiments.bootsveld2012.runtimes import RunTime, draw_run_times, run_times
from elusive.experiments.bootsveld2012.trial import ESTIMATES, SCENARIO, Estimate, ShipTrial
from elusive.experiments.imprecise_chart import Row, imprecise_chart
from elusive.io import atomic_folder, existing_folder
from elusive.io.csv_files import write_results

if TYPE_CHECKING:
    import xarray as xr

DEFAULT_TRIALS = 100  # as in the thesis
CHUNK = 2  # runs between two looks at the progress, and at an interrupt
COAST, PHASES, RUNTIMES, IMPRECISE = "coast", "phases", "runtimes", "imprecise"
_THESIS = (*curves.FIGURES, *clouds.FIGURES, *influence.FIGURES, *maps.FIGURES, *partitions.FIGURES, *ways.FIGURES)
# in the thesis's order: a1 ... a19, b1 ... b24, fig5_1 ... fig7_3
TARGETS = (
    *sorted(_THESIS, key=lambda name: (name[0], *(int(part) for part in re.findall(r"\d+", name)))),
    COAST,
    PHASES,
    RUNTIMES,
    IMPRECISE,
)


class Reproduced(NamedTuple):
    """What was written: the curves by the figure's name, a row for each filter and way, check values, run times."""

    curves: dict[str, list[Point]]
    summaries: list[Summary]
    phases: list[Phase]
    run_times: list[RunTime]
    imprecise: list[Row]
    written: list[str]  # names of files


class Settings(NamedTuple):
    """What holds for every figure."""

    trials: int = DEFAULT_TRIALS
    seed: int = 2012
    estimate: Estimate = "marginal"
    sigma_m: float | None = None  # none: 7 m in the canal, 5 m at the port
    range_m: float | None = None  # none: 10 km, 5 km
    particles: int = 6000
    shoreline: Path | None = None  # none: the synthetic delta
    fine: Path | None = None  # the two real charts of the target ``imprecise``
    coarse: Path | None = None

    def case(self, way: Way) -> ShipTrial:
        """Return a way and the filters that look at it."""
        port = not way.startswith("canal")
        return ShipTrial(
            way=way,
            methods=curves.methods_of(way),
            estimates=(self.estimate,),
            sigma_m=self.sigma_m,
            range_m=self.range_m,
            particles=self.particles,
            shoreline=self.shoreline if port else None,
        )


def reproduce(
    out: Path,
    targets: Sequence[str] = (),
    settings: Settings | None = None,
    *,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Reproduced:
    """Write the figures named, each as PNG and those of curves as CSV, and ``summary.csv``; all by default.

    ``targets`` are some of :data:`TARGETS`. The runs stay in ``campaign-*.zarr`` in ``out``; run i has the same plots
    for every filter, and its filters the same random numbers.

    Raises
    ------
    ParameterError
        If a target is unknown, or charts are wanted and not given both.
    DataError
        If ``out`` is a file or cannot be made, or the shoreline cannot be read or sailed along.
    """
    settings = settings or Settings()
    unknown = [target for target in targets if target not in TARGETS]
    if unknown:
        raise ParameterError(f"{unknown[0]!r}: bootsveld2012 has no such figure; known are {', '.join(TARGETS)}.")
    if settings.estimate not in ESTIMATES:
        raise ParameterError(f"estimate: {settings.estimate!r} is none of {', '.join(ESTIMATES)}.")
    charts = (settings.fine, settings.coarse) if settings.fine and settings.coarse else None
    if charts is None and (IMPRECISE in targets or settings.fine or settings.coarse):
        raise ParameterError("imprecise: needs two charts; give a fine and a coarse one.")
    wanted = targets or [name for name in TARGETS if charts or name != IMPRECISE]
    chosen = [name for name in TARGETS if name in wanted]
    shown = {name: curves.FIGURES[name] for name in chosen if name in curves.FIGURES}
    sailed = {figure.way for name, figure in curves.FIGURES.items() if name in chosen}
    sailed |= {figure.way for name, figure in clouds.FIGURES.items() if name in chosen}
    sailed |= {way for name, shown_ways in ways.FIGURES.items() if name in chosen for way in shown_ways}
    for way in sorted(sailed):
        scenery(settings.case(way))  # a fault of the shoreline is said before anything is run
    existing_folder(out)
    points: dict[str, list[Point]] = {}
    summaries: list[Summary] = []
    for way in curves.TITLES:
        of_way = {name: figure for name, figure in shown.items() if figure.way == way}
        if of_way:
            # the error of the first run alone needs no other
            alone = all(figure.measure == "error" for figure in of_way.values())
            runs = 1 if alone else settings.trials
            results = _runs(out, settings, settings.case(way), runs, executor, on_progress)
            points |= {name: curves.points(results, figure) for name, figure in of_way.items()}
            if not alone:
                summaries += curves.summarise(way, results, settings.estimate)
    checks: list[Phase] = []
    if PHASES in chosen:
        near = settings._replace(range_m=RANGE_M).case("canal-imprecise").replace(methods=tuple(CHECK))
        checks = phases(near, _runs(out, settings, near, settings.trials, executor, on_progress))
    times = run_times(settings.case("port-imprecise"), settings.seed) if RUNTIMES in chosen else []
    rows_of_charts: list[Row] = []
    if IMPRECISE in chosen and charts:
        rows_of_charts = imprecise_chart(
            out, *charts, runs=settings.trials, seed=settings.seed, executor=executor, on_progress=on_progress
        )
    with atomic_folder(out) as folder:
        for name, rows in points.items():
            figure = shown[name]
            note = f"{settings.trials} runs, {_ESTIMATE_NAMES[settings.estimate]}"
            write_results(folder / f"{name}.csv", Point._fields, rows)
            curves.draw(folder / f"{name}.png", rows, figure, "" if figure.measure == "error" else note)
        for name in chosen:
            if name in clouds.FIGURES:
                cloud = clouds.FIGURES[name]
                clouds.draw_clouds(folder / f"{name}.png", settings.case(cloud.way), [cloud], settings.seed)
            elif name == COAST:
                case = settings.case(clouds.COAST[0].way)
                clouds.draw_clouds(folder / "coast.png", case, clouds.COAST, settings.seed)
            elif name in influence.FIGURES:
                influence.draw_influence(folder, name)
            elif name in maps.FIGURES:
                maps.draw_map(folder, name, settings.case("port-imprecise"))
            elif name in partitions.FIGURES:
                partitions.draw_partition(folder, name, settings.case("port-imprecise"))
            elif name in ways.FIGURES:
                ways.draw_ways(folder, name, [settings.case(way) for way in ways.FIGURES[name]])
        if summaries:
            write_results(folder / "summary.csv", Summary._fields, summaries)
        if checks:
            write_results(folder / "phases.csv", Phase._fields, checks)
        if times:
            write_results(folder / "runtimes.csv", RunTime._fields, times)
            draw_run_times(folder / "runtimes.png", times)
        written = sorted(path.name for path in folder.iterdir())
    written += ["imprecise.csv", "imprecise.png"] if rows_of_charts else []
    return Reproduced(points, summaries, checks, times, rows_of_charts, written)


_ESTIMATE_NAMES: dict[Estimate, str] = {"mean": "mean", "map": "particle MAP", "marginal": "marginal MAP"}


def _runs(
    out: Path,
    settings: Settings,
    case: ShipTrial,
    trials: int,
    executor: Executor | None,
    on_progress: Callable[[Progress], None] | None,
) -> xr.Dataset:
    parameters = {name: getattr(case, name) for name in ShipTrial.model_fields if name in case.model_fields_set}
    parameters["shoreline"] = None if case.shoreline is None else str(case.shoreline)
    configuration = CampaignConfig(
        scenario="bootsveld2012", parameters=parameters, trials=trials, seed=settings.seed, chunk=CHUNK
    )
    where = f"-{case.shoreline.stem}" if case.shoreline else ""
    away = f"-{case.range_m:g}m" if case.range_m else ""
    name = f"campaign-{case.way}{where}{away}-sigma{case.sigma:g}-{settings.estimate}-{trials}-seed{settings.seed}.zarr"
    return run_campaign(SCENARIO, configuration, out / name, executor=executor, on_progress=on_progress).load()
