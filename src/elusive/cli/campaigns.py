"""`elusive campaign`: a scenario over a grid of parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from elusive.campaign import CampaignConfig, make_executor, resolve, run_campaign
from elusive.cli.terminal import Scheduler, Workers, campaign_bar, say
from elusive.experiments.amrouche2018.trial import SCENARIO as AMROUCHE2018
from elusive.experiments.jiang2024.trial import SCENARIO as JIANG2024
from elusive.experiments.mazurek2013.trial import SCENARIO as MAZUREK2013
from elusive.experiments.mendieta2017.trial import SCENARIO as MENDIETA2017
from elusive.experiments.ships_in_video.trial import SCENARIO as SHIPS
from elusive.experiments.targets_in_frames import SCENARIO as TARGETS

SCENARIOS = {
    "amrouche2018": AMROUCHE2018,
    "jiang2024": JIANG2024,
    "mazurek2013": MAZUREK2013,
    "mendieta2017": MENDIETA2017,
    "ships_in_video": SHIPS,
    "targets": TARGETS,
}


def campaign_command(
    config: Annotated[Path, typer.Argument(help="YAML file: scenario, parameters, grid, trials, seed.")],
    out: Annotated[Path, typer.Option("--out", help="Zarr store for the results; a killed campaign goes on in it.")],
    workers: Workers = None,
    scheduler: Scheduler = None,
) -> None:
    """Run a scenario over a grid of parameters and many trials; killed and started again, it goes on."""
    configuration = CampaignConfig.from_yaml(config)
    scenario = resolve(configuration.scenario, SCENARIOS)
    with make_executor(workers, scheduler) as executor, campaign_bar() as report:
        run_campaign(scenario, configuration, out, executor=executor, on_progress=report)
    say(f"Written to {out}")
