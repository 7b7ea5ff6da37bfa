"""The house stands: imports run one way, and the pins are names and versions alone."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from graphlib import TopologicalSorter
from importlib.metadata import requires
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
NAME = re.compile(r"[A-Za-z0-9._-]+")


def test_imports_run_one_way() -> None:
    command = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert command, "lint-imports is not installed beside the interpreter; run make test."
    found = subprocess.run([command, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


def test_imports_form_no_circle() -> None:
    graph = grimp.build_graph("elusive", exclude_type_checking_imports=True, cache_dir=None)
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    TopologicalSorter(imported).prepare()  # a CycleError names the circle


def test_every_dependency_is_pinned() -> None:
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    pin = re.compile(r"([A-Za-z0-9._-]+)==[0-9A-Za-z.+!]+")
    assert [line for line in lines if not pin.fullmatch(line)] == []
    pinned = {canonical(line.partition("==")[0]) for line in lines}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = [*project["build-system"]["requires"], *requires("elusive")]
    direct = {canonical(NAME.match(requirement)[0]) for requirement in wanted}
    assert direct - pinned == set()


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, elusive; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"numba", "scipy", "matplotlib", "xarray", "zarr"}.isdisjoint(loaded)


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
