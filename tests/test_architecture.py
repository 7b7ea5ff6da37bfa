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
import pytest

from tests.reached import Sources

ROOT = Path(__file__).parents[1]
NAME = re.compile(r"[A-Za-z0-9._-]+")


def test_imports_run_one_way() -> None:
    command = shutil.which("lint-imports", path=str(Path(sys.executable).parent))
    assert command, "lint-imports is not installed beside the interpreter; run make test."
    found = subprocess.run([command, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("elusive", exclude_type_checking_imports=True, cache_dir=None)


def test_imports_form_no_circle(graph: grimp.ImportGraph) -> None:
    imported = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    TopologicalSorter(imported).prepare()  # a CycleError names the circle


def test_each_hop_of_a_measurement_goes_down_the_house(graph: grimp.ImportGraph) -> None:
    """As docs/house.md tells it: what calls a module imports it, and is imported by nothing that is below."""
    text = (ROOT / "docs" / "house.md").read_text(encoding="utf-8")
    for walk in re.split(r"^## ", text, flags=re.MULTILINE)[1:-1]:
        hops = re.findall(r"^\| `([\w.]+)` \|.*\| `([\w.]+)` \|$", walk, flags=re.MULTILINE)
        assert len(hops) > 8
        for imported, importer in ((f"elusive.{module}", f"elusive.{by}") for module, by in hops):
            assert {imported, importer} <= graph.modules, (imported, importer)
            # the group of commands loads the one that is asked for by its name
            assert importer == "elusive.cli" or graph.find_shortest_chain(importer, imported), (importer, imported)
            assert not graph.find_shortest_chain(imported, importer), (imported, importer)


def test_what_no_command_or_page_reaches_is_named_as_a_part_of_the_library() -> None:
    """Or it is dead; and what is named so would be without."""
    text = (ROOT / "docs" / "api.md").read_text(encoding="utf-8").partition("## Parts for your own programs")[2]
    named = {(module, name) for module, name in re.findall(r"`~(elusive[\w.]+)\.(\w+)`", text)}
    sources = Sources(ROOT / "src")
    whole = {(module, name) for module, defined in sources.defined.items() for name in defined}
    by_heads = sources.reached_from(sources.heads())
    assert named, "docs/api.md names no part"
    assert named & by_heads == set()
    assert whole - by_heads - sources.reached_from(named) == set()


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
