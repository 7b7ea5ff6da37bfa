"""Where trials run: in this process, in a pool of its own processes, or on a Dask cluster."""

from __future__ import annotations

import _thread
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from elusive.campaign.trials import stopping
from elusive.errors import ParameterError

ANSWER_WITHIN_S = 10.0


class InProcess(Executor):
    """Runs each call at once where it is submitted; an interrupt passes straight through."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call and return the finished future."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def make_executor(
    workers: int | None = None, scheduler: str | None = None, *, timeout_s: float = ANSWER_WITHIN_S
) -> Iterator[Executor | None]:
    """Open what :func:`run_campaign` runs on, and close it afterwards.

    Parameters
    ----------
    workers
        Processes on this machine; None or 1 runs the trials one after another in this process. They are spawned,
        not forked, since compiled kernels' threads do not survive a fork; they end with this process, however it
        ends. An error or an interrupt that leaves the block under ``with`` waits only for the trials being run.
    scheduler
        Address of a Dask scheduler, ``tcp://host:8786``, instead of own processes.
    timeout_s
        How long the scheduler may take to answer.

    Yields
    ------
    concurrent.futures.Executor or None
        None stands for this process.

    Raises
    ------
    ParameterError
        If both are given, ``workers`` is below 1, Dask is not installed, or no scheduler answers.
    """
    if workers is not None and workers < 1:
        raise ParameterError(f"workers: must be at least 1 (got {workers}).")
    if scheduler is not None:
        if workers is not None:
            raise ParameterError("workers, scheduler: give one of them; a cluster has its own workers.")
        with _connect(scheduler, timeout_s) as client:
            yield client.get_executor(pure=False)
    elif workers is None or workers == 1:
        yield None
    else:
        with _pool(workers) as pool:
            yield pool


@contextmanager
def _pool(workers: int) -> Iterator[Executor]:
    spawn = multiprocessing.get_context("spawn")
    # Only this process holds the writing end: closed by hand or by death, it tells every worker to stop.
    lifeline, held = spawn.Pipe(duplex=False)
    with lifeline, held, ProcessPoolExecutor(workers, spawn, _follow, (lifeline,)) as pool:
        try:
            yield pool
        except BaseException:
            held.close()
            pool.shutdown(cancel_futures=True)
            raise


def _follow(lifeline: Connection) -> None:
    """Prepare a worker: interrupts are the parent's, who lets go of the lifeline to stop it, or has died.

    Then what heeds SIGINT here gets one.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def end() -> None:
        with suppress(OSError, EOFError):
            lifeline.poll(None)
        stopping.set()
        _thread.interrupt_main()
        parent = multiprocessing.parent_process()
        if parent is not None:
            parent.join()
            os._exit(1)  # a pool's idle worker would wait for its next call for ever

    threading.Thread(target=end, daemon=True).start()


def _connect(scheduler: str, timeout_s: float) -> Any:
    try:
        distributed = import_module("distributed")
    except ImportError:
        raise ParameterError(
            "scheduler: Dask's distributed is not installed; run pip install 'elusive[cluster]'."
        ) from None
    try:
        return distributed.Client(scheduler, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ParameterError(
            f"scheduler: no Dask scheduler answers at {scheduler!r} within {timeout_s:g} s ({error}); "
            "check the address, or start one with 'dask scheduler'."
        ) from None
