"""The campaign's loop: blocks of trials out to the executor, finished blocks into the store."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from elusive.campaign.config import CampaignConfig
from elusive.campaign.executors import InProcess
from elusive.campaign.scenario import GridPoint, Scenario, Trial, as_scenario, grid_points
from elusive.campaign.store import Block, CampaignStore, open_campaign
from elusive.campaign.trials import TrialError, run_block, trial_name
from elusive.errors import ElusiveError, ParameterError

if TYPE_CHECKING:
    import xarray as xr


class Progress(NamedTuple):
    """How far a campaign is, in trials over the whole grid."""

    done: int  # those found in the store included
    total: int
    elapsed_s: float  # since this run began
    remaining_s: float | None  # at this run's own rate; None before its first block


def run_campaign(
    trial: Trial | Scenario,
    configuration: CampaignConfig,
    store: str | Path,
    *,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], None] | None = None,
    in_flight: int = 64,
) -> xr.Dataset:
    """Run what of a campaign is not in the store yet, and open the store.

    Trial ``i`` draws from ``SeedSequence(seed, spawn_key=(i,))`` at every point of the grid: points are compared on
    common random numbers, so that their differences carry less noise than either, and trials at two points are not
    independent. The files in the store are the same byte for byte from any executor and after any interruption: this
    process does all the writing, and a block of trials counts only once it is recorded as done.

    Parameters
    ----------
    trial
        ``trial(parameters, rng)`` returns a mapping of names to numbers or arrays, the same names, shapes and types
        each time (a Python number counts as float64); or a :class:`Scenario` round it. ``parameters`` is the
        scenario's model (for a bare trial, the model that annotates the first parameter), else a mapping.
    configuration
        What to run. Its ``scenario`` is only recorded; :func:`resolve` finds the trial it names.
    store
        Directory of the zarr store: absent, empty, or begun by the same configuration.
    executor
        Where to run, see :func:`make_executor`; None runs one trial after another here.
    on_progress
        Called at the start and after each block.
    in_flight
        Blocks handed to the executor at a time: at least its number of workers. It bounds the memory.

    Returns
    -------
    xarray.Dataset
        As :func:`open_campaign` gives it.

    Raises
    ------
    ParameterError
        If a parameter of any point of the grid is misspelt or out of bounds, or the trial cannot reach other
        processes; nothing has been started then.
    StoreError
        If the path holds something else, another campaign, or cannot be written.
    TrialError
        If a trial fails; the sentence says which. What was done stays, and the next run goes on from it.
    """
    if in_flight < 1:
        raise ParameterError(f"in_flight: must be at least 1 (got {in_flight}).")
    scenario = as_scenario(trial)
    points = grid_points(configuration, scenario.model)
    if executor is None:
        executor, in_flight = InProcess(), 1
    else:
        _require_picklable(scenario.trial, points[0])
    target = CampaignStore(Path(store), configuration, scenario.dims)
    missing = target.missing(points)
    total = configuration.trials * len(points)
    tell = _reporter(total, sum(len(block.numbers) for block in missing), on_progress)
    queue = iter(missing)
    pending: dict[Future[Any], Block] = {}

    def submit(count: int) -> None:
        for block in islice(queue, count):
            with _explained(block):
                future = executor.submit(run_block, scenario.trial, block.point, configuration.seed, block.numbers)
            pending[future] = block

    try:
        submit(in_flight)
        while pending:
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            # what succeeded is kept before a failure is raised
            for future in sorted(finished, key=lambda one: one.cancelled() or one.exception() is not None):
                block = pending.pop(future)
                with _explained(block):
                    outputs = future.result()
                target.write(block, outputs)
                tell(len(block.numbers))
            submit(len(finished))
    except BaseException as error:
        # A pool that broke settles its calls itself, and stumbles over one cancelled meanwhile (CPython 3.11).
        if not isinstance(error.__cause__, BrokenExecutor):
            for future in pending:
                future.cancel()
        raise
    return open_campaign(store)


def _reporter(total: int, missing: int, on_progress: Callable[[Progress], None] | None) -> Callable[[int], None]:
    """Tell where the campaign begins, and return what is to be called with each number of trials done since."""
    began, new = time.monotonic(), 0

    def tell(trials: int) -> None:
        nonlocal new
        new += trials
        left = missing - new
        elapsed = time.monotonic() - began
        if on_progress is not None:
            remaining = elapsed / new * left if new else (None if left else 0.0)
            on_progress(Progress(total - left, total, elapsed, remaining))

    tell(0)
    return tell


def _require_picklable(trial: Trial, point: GridPoint) -> None:
    try:
        pickle.dumps((trial, point))
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ParameterError(
            f"trial: cannot be sent to other processes ({error}); define it and its model at the top of a module."
        ) from None


@contextmanager
def _explained(block: Block) -> Iterator[None]:
    """Turn an executor's own failure (a worker killed, a cluster gone) into a sentence."""
    try:
        yield
    except ElusiveError:
        raise
    except Exception as error:
        raise TrialError(
            f"{trial_name(block.numbers[0], block.point)} was lost with its worker ({type(error).__name__}: {error}); "
            "it was killed, ran out of memory, or could not start (a script that starts processes guards its own code "
            "by 'if __name__ == \"__main__\":'). What was done is kept: run it again to go on."
        ) from error
