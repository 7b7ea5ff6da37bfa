"""Campaigns: equal bytes from any executor and after any kill, and refusals in sentences."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elusive.campaign import (
    CampaignConfig,
    Progress,
    Scenario,
    TrialError,
    make_executor,
    open_campaign,
    resolve,
    run_campaign,
)
from elusive.errors import ParameterError, StoreError
from tests import campaign_trials as trials
from tests.longer import longer
from tests.processes import HUNG_S, wait_until

ROOT = Path(__file__).parents[1]
HELD = "tests.campaign_trials:held"


def configuration(**changes: Any) -> CampaignConfig:
    given = {"scenario": HELD, "grid": {"birth.snr_db": [1.0, 2.5], "bias": [0, 1, 2]}, "trials": 10, "chunk": 4}
    return CampaignConfig(**(given | changes))


def files(store: Path) -> dict[str, bytes]:
    return {str(path.relative_to(store)): path.read_bytes() for path in store.rglob("*") if path.is_file()}


def no_process_left(session: int) -> bool:
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, owner = entry.read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(owner) == session and state != "Z":
            return False
    return True


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    store = tmp_path_factory.mktemp("serial") / "store"
    run_campaign(trials.noisy, configuration(), store)
    return store


def test_the_dataset_is_labelled_and_drawn_from_spawned_seeds(serial: Path) -> None:
    dataset = open_campaign(serial)
    assert dataset.error.dims == ("birth.snr_db", "bias", "trial", "error_0")
    assert list(dataset.data_vars) == ["error", "hits", "rms"]
    assert dataset["birth.snr_db"].values.tolist() == [1.0, 2.5]
    assert bool(dataset.done.all())
    rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(7,)))
    expected = rng.standard_normal(3)
    for snr_db in (1.0, 2.5):
        here = dataset.sel({"birth.snr_db": snr_db, "bias": 2, "trial": 7})
        np.testing.assert_array_equal(here.error, expected + snr_db)
        np.testing.assert_array_equal(here.hits, expected > 0)
    assert CampaignConfig(**json.loads(dataset.attrs["configuration"])) == configuration()
    assert not dataset.error.variable._in_memory  # lazily


def test_processes_and_threads_write_the_same_bytes(serial: Path, tmp_path: Path) -> None:
    with make_executor(2) as pool:
        run_campaign(trials.noisy, configuration(), tmp_path / "pool", executor=pool, in_flight=3)
    with ThreadPoolExecutor(2) as threads:
        run_campaign(trials.noisy, configuration(), tmp_path / "threads", executor=threads)
    assert files(tmp_path / "pool") == files(serial) == files(tmp_path / "threads")


def test_dask_writes_the_same_bytes(serial: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="needs elusive[cluster]")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None, host="127.0.0.1", protocol="tcp"
        ) as cluster,
        make_executor(scheduler=cluster.scheduler_address) as executor,
    ):
        run_campaign(trials.noisy, configuration(), tmp_path / "dask", executor=executor)
    assert files(tmp_path / "dask") == files(serial)


def test_a_silent_scheduler_is_named() -> None:
    pytest.importorskip("distributed", reason="needs elusive[cluster]")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with (
            pytest.raises(ParameterError, match="no Dask scheduler answers"),
            make_executor(scheduler=address, timeout_s=0.5),
        ):
            pass


def test_a_missing_dask_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ParameterError, match=r"elusive\[cluster\]"), make_executor(scheduler="tcp://127.0.0.1:1"):
        pass


@pytest.mark.parametrize(("workers", "scheduler"), [(0, None), (2, "tcp://127.0.0.1:1")])
def test_executors_that_make_no_sense_are_refused(workers: int, scheduler: str | None) -> None:
    with pytest.raises(ParameterError, match="workers"), make_executor(workers, scheduler):
        pass


def start(store: Path, workers: int) -> subprocess.Popen[str]:
    """Start a campaign that stays where half of it is done."""
    program = (
        "import signal, sys\n"
        "from pathlib import Path\n"
        "from tests.campaign_trials import held\n"
        "from tests.test_campaign import configuration\n"
        "from elusive.campaign import make_executor, run_campaign\n"
        "if __name__ == '__main__':\n"
        "    signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background ignores it
        f"    with make_executor({workers}) as executor:\n"
        "        run_campaign(held, configuration(), Path(sys.argv[1]), executor=executor)\n"
    )
    script = store.parent / "campaign_script.py"
    script.write_text(program)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path]), trials.HOLD: "1"}
    command = [sys.executable, str(script), str(store)]
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals and sessions")
@pytest.mark.parametrize(
    ("workers", "blow"),
    longer(
        [(1, signal.SIGKILL), (2, signal.SIGKILL), (2, signal.SIGINT)],
        *((2, blow) for blow in (signal.SIGKILL, signal.SIGINT)),
    ),
)
def test_a_campaign_killed_goes_on_to_the_same_bytes(serial: Path, tmp_path: Path, workers: int, blow: int) -> None:
    store = tmp_path / "store"
    with start(store, workers) as process:
        # nine blocks, and the metadata of the array of flags; a flag that is being written is none yet
        flags = (store / "done").rglob
        wait_until(lambda: sum(path.is_file() and path.suffix != ".partial" for path in flags("*")) == 9 + 1, process)
        os.kill(process.pid, blow)
        _, stderr = process.communicate(timeout=HUNG_S)
    assert process.returncode == -blow
    if blow == signal.SIGINT:
        assert stderr.count("Traceback") == 1, stderr  # the workers end quietly
    until = time.monotonic() + HUNG_S
    while Path("/proc").exists() and not no_process_left(process.pid):
        assert time.monotonic() < until
        time.sleep(0.02)
    done = int(open_campaign(store).done.sum())
    assert done == 30  # of 60
    (store / "error" / "c" / "0" / "0" / "0.0123.partial").write_bytes(b"half")
    reports: list[Progress] = []
    run_campaign(trials.noisy, configuration(), store, on_progress=reports.append)
    assert reports[0].done == done
    assert files(store) == files(serial)


def test_a_flag_half_written_is_a_block_not_done(serial: Path, tmp_path: Path) -> None:
    store = tmp_path / "store"
    run_campaign(trials.noisy, configuration(), store)
    (store / "done" / "c" / "1" / "2" / "0").write_bytes(b"")
    (store / "error" / "c" / "1" / "2" / "0" / "0").write_bytes(b"half")
    reports: list[Progress] = []
    run_campaign(trials.noisy, configuration(), store, on_progress=reports.append)
    assert [report.done for report in reports] == [56, 60]
    assert files(store) == files(serial)


def test_progress_counts_what_was_found_and_rates_only_what_is_new(tmp_path: Path) -> None:
    reports: list[Progress] = []
    run_campaign(trials.held, configuration(grid={}), tmp_path / "a", on_progress=reports.append)
    assert [report.done for report in reports] == [0, 4, 8, 10]
    assert {report.total for report in reports} == {10}
    assert reports[0].remaining_s is None
    assert reports[1].remaining_s == pytest.approx(reports[1].elapsed_s / 4 * 6)
    assert reports[-1].remaining_s == 0.0
    assert all(a.elapsed_s <= b.elapsed_s for a, b in pairwise(reports))
    run_campaign(trials.held, configuration(grid={}), tmp_path / "a", on_progress=reports.append)
    assert reports[-1][:2] == (10, 10)
    assert reports[-1].remaining_s == 0.0


def test_an_interrupt_keeps_what_is_done(serial: Path, tmp_path: Path) -> None:
    def interrupt(progress: Progress) -> None:
        if progress.done >= 12:
            raise KeyboardInterrupt

    store = tmp_path / "store"
    with pytest.raises(KeyboardInterrupt), make_executor(2) as executor:
        run_campaign(trials.noisy, configuration(), store, executor=executor, on_progress=interrupt)
    assert 12 <= int(open_campaign(store).done.sum()) < 60
    run_campaign(trials.noisy, configuration(), store)
    assert files(store) == files(serial)


@pytest.mark.parametrize("workers", longer([1, 2], 2))
def test_a_failing_trial_is_named_and_the_rest_kept(tmp_path: Path, workers: int) -> None:
    store = tmp_path / "store"
    sentence = r"Trial 5 at birth.snr_db=1.0, bias=1 failed: ZeroDivisionError: no particle is left"
    with pytest.raises(TrialError, match=sentence), make_executor(workers) as executor:
        run_campaign(trials.fails_at_five, configuration(), store, executor=executor, in_flight=2)
    assert 10 <= int(open_campaign(store).done.sum()) < 60


def test_a_dead_worker_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(TrialError, match="was lost with its worker"), make_executor(2) as executor:
        run_campaign(trials.dies, configuration(), tmp_path / "store", executor=executor)
    assert not (tmp_path / "store").exists()


@pytest.mark.parametrize("chunk", [4, 5])  # the odd trial within a block, and first of the next
def test_outputs_that_change_shape_are_refused(tmp_path: Path, chunk: int) -> None:
    with pytest.raises(TrialError, match=r"Trial 5 gave error float64 \(4,\), but other trials error float64 \(3,\)"):
        run_campaign(trials.grows, configuration(grid={}, chunk=chunk), tmp_path / "store")


@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        ("text", "gave error as str"),
        ("nothing", "must return a mapping"),
        ("name", "names an output 'my error'"),
        ("axis", "what is named twice"),
    ],
)
def test_outputs_that_cannot_be_stored_are_refused(tmp_path: Path, what: str, sentence: str) -> None:
    with pytest.raises(TrialError, match=sentence):
        run_campaign(trials.says, configuration(grid={"what": [what]}), tmp_path / "store")
    assert not (tmp_path / "store").exists()


def test_a_mapping_is_given_fresh_to_each_trial_and_a_dotted_path_makes_its_way(tmp_path: Path) -> None:
    chosen = configuration(parameters={"other": [1, {"a": None}]}, grid={"level.value": [1, 2.5]})
    dataset = run_campaign(trials.mapped, chosen, tmp_path / "store")
    assert dataset.seen.dtype == np.float64
    assert dataset["count"].dtype == np.int32
    np.testing.assert_array_equal(dataset.seen, np.repeat([[1.0], [2.5]], 10, axis=1))


def test_axes_of_text_kinds_and_truth_values_are_labelled(tmp_path: Path) -> None:
    chosen = configuration(grid={"level": [{"value": 1.0}, {"value": 2.0}], "name": ["a", "é"], "on": [True, False]})
    dataset = run_campaign(trials.mapped, chosen, tmp_path / "store")
    assert dataset.sel(name="é", level='{"value": 2.0}', on=True, trial=0).seen.item() == 2.0
    assert open_campaign(tmp_path / "store").name.values.tolist() == ["a", "é"]


def test_a_dotted_path_keeps_the_rest_of_a_default_and_of_another_kind(tmp_path: Path) -> None:
    seen = []

    def look(parameters: trials.Noisy, rng: np.random.Generator) -> dict[str, float]:
        seen.append(parameters.birth)
        return {"x": 0.0}

    scenario = Scenario(look, trials.Noisy)
    run_campaign(scenario, configuration(grid={"birth.snr_db": [9]}, trials=1), tmp_path / "a")
    ring = configuration(parameters={"birth": {"kind": "ring", "radius": 2}}, grid={"birth.snr_db": [9]}, trials=1)
    run_campaign(scenario, ring, tmp_path / "b")
    assert seen == [trials.Birth(snr_db=9, rate=0.7), trials.Ring(snr_db=9, radius=2)]


def test_a_scenario_names_its_own_dimensions(tmp_path: Path) -> None:
    plain = configuration(grid={})
    dataset = run_campaign(trials.scenario, configuration(), tmp_path / "store")
    assert dataset.hits.dims[-2:] == ("trial", "time")
    with pytest.raises(TrialError, match="dimension time is 1 long in late and 3 in another"):
        run_campaign(Scenario(trials.uneven, dims=dict.fromkeys(("error", "late"), ("time",))), plain, tmp_path / "b")
    with pytest.raises(TrialError, match="names its dimensions"):
        run_campaign(trials.scenario._replace(dims={"rms": ("time",)}), configuration(), tmp_path / "other")


@pytest.mark.parametrize(
    ("grid", "sentence"),
    [
        ({"bais": [1]}, r"did you mean 'bias'.*At bais=1"),
        ({"birth.snr": [1]}, "did you mean 'snr_db'"),
        ({"birht.snr_db": [1]}, "did you mean 'birth'"),
        ({"birth.snr_db": [1, 60]}, r"less than or equal to 50.*At birth.snr_db=60"),
        ({"bias.x": [1]}, "no such field|valid number"),
    ],
)
def test_a_misspelt_or_bad_parameter_is_refused_before_anything_starts(
    tmp_path: Path, grid: dict[str, list[Any]], sentence: str
) -> None:
    with pytest.raises(ParameterError, match=sentence):
        run_campaign(trials.dies, configuration(grid=grid), tmp_path / "store")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"grid": {"trial": [1]}}, "names no parameter"),
        ({"grid": {"a..b": [1]}}, "names no parameter"),
        ({"grid": {"a": []}}, "holds no value"),
        ({"grid": {"a": [1, 1.0]}}, "same value twice"),
        ({"grid": {"a.b": [1], "a": [{}]}}, "lies inside a"),
        ({"grid": [1]}, "dictionary"),
        ({"parameters": {"a": {"b": [float("nan")]}}}, r"parameters.a.b.0: must be a finite number"),
        ({"parameters": {"a": {1: 2}}}, "quote it"),
        ({"trails": 3}, "did you mean 'trials'"),
    ],
)
def test_a_configuration_that_cannot_be_run_is_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        configuration(**changes)


def test_equal_parameters_make_equal_configurations() -> None:
    one = configuration(parameters={"b": np.float64(0.5), "a": (1, 2), "birth": trials.Birth()})
    other = configuration(parameters={"birth": trials.Birth().model_dump(), "a": [1, 2], "b": 0.5})
    assert one.canonical() == other.canonical()
    assert configuration().canonical() != configuration(grid=dict(reversed(configuration().grid.items()))).canonical()


def test_a_parameter_without_fields_cannot_be_gone_through(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="bias is 2 and has no fields"):
        run_campaign(trials.noisy, configuration(parameters={"bias": 2}, grid={"bias.x": [1]}), tmp_path / "store")


def test_a_store_of_another_configuration_is_refused_by_what_differs(serial: Path) -> None:
    before = files(serial)
    with pytest.raises(StoreError, match=r"differs in parameters.size \(.*nothing.*, 3 here\); trials \(10 there, 11"):
        run_campaign(trials.noisy, configuration(trials=11, parameters={"size": 3}), serial)
    with pytest.raises(StoreError, match="differs in grid"):
        run_campaign(trials.noisy, configuration(grid={"bias": [1]}), serial)
    assert files(serial) == before


def test_what_is_no_store_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    for path in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(StoreError, match="no campaign's store"):
            run_campaign(trials.noisy, configuration(), path)
        with pytest.raises(StoreError, match="no campaign's store"):
            open_campaign(path)
    with pytest.raises(StoreError, match="no such store"):
        open_campaign(tmp_path / "absent")
    assert files(tmp_path) == {"notes.txt": b"mine"}


def test_a_store_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot be written"):
        run_campaign(trials.noisy, configuration(), tmp_path / "file" / "store")


def test_a_store_left_half_made_is_made_anew(serial: Path, tmp_path: Path) -> None:
    (tmp_path / ".store.partial" / "error").mkdir(parents=True)
    run_campaign(trials.noisy, configuration(), tmp_path / "store")
    assert files(tmp_path / "store") == files(serial)
    assert [path.name for path in tmp_path.iterdir()] == ["store"]


def test_blocks_in_flight_must_be_some(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="in_flight"):
        run_campaign(trials.noisy, configuration(), tmp_path / "store", in_flight=0)


def test_a_partial_is_given_the_mapping_and_unreadable_annotations_are_named(tmp_path: Path) -> None:
    chosen = configuration(grid={"level.value": [1]}, trials=2)
    assert float(run_campaign(partial(trials.mapped), chosen, tmp_path / "store").seen[0, 1]) == 1.0

    def odd(parameters: Unknown, rng: object) -> dict[str, float]:  # type: ignore[name-defined]  # noqa: F821
        return {"x": 0.0}

    with pytest.raises(ParameterError, match="'Unknown' is not defined"):
        run_campaign(odd, chosen, tmp_path / "other")


def test_an_empty_directory_is_taken(serial: Path, tmp_path: Path) -> None:
    run_campaign(trials.noisy, configuration(), tmp_path)
    assert files(tmp_path) == files(serial)


def test_a_trial_that_cannot_be_sent_is_refused(tmp_path: Path) -> None:
    with ThreadPoolExecutor(1) as threads, pytest.raises(ParameterError, match="top of a module"):
        run_campaign(lambda parameters, rng: {}, configuration(), tmp_path / "store", executor=threads)


def test_scenarios_are_found_by_name_and_by_import_string() -> None:
    known = {"noise": trials.scenario}
    assert resolve("noise", known) is trials.scenario
    assert resolve("tests.campaign_trials:scenario") is trials.scenario
    assert resolve("tests.campaign_trials:noisy")[:2] == (trials.noisy, trials.Noisy)
    assert resolve("tests.campaign_trials:mapped").model is None


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("nose", "did you mean 'noise'"),
        ("tests.campaign_trials:nosy", "cannot be imported"),
        ("no_such_package:noisy", "cannot be imported"),
        ("tests.campaign_trials:number", "is a int"),
    ],
)
def test_scenarios_not_found_are_named(name: str, sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        resolve(name, {"noise": trials.scenario})
