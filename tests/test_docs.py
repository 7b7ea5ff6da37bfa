"""What is written runs: README, CONTRIBUTING, the commands on each page, and the site with every code cell."""

from __future__ import annotations

import inspect
import json
import pkgutil
import re
import shlex
import shutil
import subprocess
import sys
import zlib
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

import elusive
from elusive.cli import main
from elusive.experiments.demo import run_demo
from elusive.geometry.areas import Area
from elusive.systems.images.simulate import ImageSimulation, simulate_images
from elusive.systems.links.networks import BorderNodes
from elusive.systems.links.recording import simulate_links
from elusive.systems.links.simulate import LinkSimulation
from elusive.systems.links.walks import Walks
from elusive.systems.registry import SYSTEMS
from elusive.systems.video.simulate import VideoSimulation, simulate_video
from tests.bearing_flight import write_flight
from tests.experiments.field_scene import write_scene
from tests.longer import longer

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FEWER = {  # the whole thing takes minutes
    "amrouche2018": ["fig2", "--trials", "2"],
    "bootsveld2012": ["fig5_3", "--trials", "2"],
    "davies2024": ["--particles", "100"],
    "jiang2024": ["fig2", "--trials", "2"],
    "mazurek2013": ["fig3", "--trials", "2"],
    "mendieta2017": ["table4_5", "--trials", "2"],
}


class Block(NamedTuple):
    page: str
    number: int
    language: str
    text: str

    @property
    def label(self) -> str:
        return f"{self.page}-{self.number}"


def blocks(*pages: str) -> list[Block]:
    found = []
    for page in pages:
        for number, (language, text) in enumerate(BLOCK.findall((ROOT / page).read_text(encoding="utf-8"))):
            found.append(Block(page, number, language, text))
    return found


PAGES = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "docs").glob("*.md"))
EXAMPLES = [block for block in blocks("README.md", "CONTRIBUTING.md") if block.language == "python"]
COMMANDS = {
    line: block
    for block in blocks(*PAGES, "README.md")
    if block.language == "sh"
    for line in block.text.replace("\\\n", "").splitlines()
    if line.startswith("elusive ")
} | {system.command: Block("README.md", 0, "sh", system.command) for system in SYSTEMS}


@pytest.mark.parametrize("block", EXAMPLES, ids=lambda block: block.label)
def test_example_runs(block: Block) -> None:
    exec(compile(block.text, block.label, "exec", dont_inherit=True), {"__name__": "example"})


OF_PAGES = [line for line, block in COMMANDS.items() if block.page != "README.md"]


@pytest.mark.parametrize("line", longer(COMMANDS, *OF_PAGES, marks=pytest.mark.validate))
def test_command_runs(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "frames"
    folder.mkdir()
    rng = np.random.default_rng(1)
    scene = ndimage.gaussian_filter(rng.normal(0, 200, (64, 80)), 4)
    if "--sensor white" in line:  # clouds declared white are tracks everywhere
        scene[:] = 0
    for number in range(8):
        frame = np.clip(100 + scene + rng.normal(0, 3, scene.shape), 0, 255).astype(np.uint8)
        Image.fromarray(frame).save(folder / f"frame{number}.png")
    np.save(tmp_path / "signal.npy", rng.standard_normal((40, 300)))
    land = {"type": "Polygon", "coordinates": [[[0, 0], [0.02, 0], [0.02, 0.01], [0, 0.01], [0, 0]]]}
    land["bbox"] = [-0.02, -0.02, 0.04, 0.02]
    (tmp_path / "route.csv").write_text("lon_deg,lat_deg\n0.002,-0.0002\n0.008,-0.0002\n", encoding="utf-8")
    looks = (f"{k},{3340 + k},{k / 60},1" for k in range(30))
    (tmp_path / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg,doppler_mps", *looks]), encoding="utf-8")
    (tmp_path / "coast.geojson").write_text(json.dumps(land), encoding="utf-8")
    if " links " in line:
        walks = Walks(users=1, total_positions=30, area=Area.rectangle(0, 6, 0, 4), latest_entrance=3)
        room = LinkSimulation(
            walks=walks, network=BorderNodes(nodes=8), radiation={"amplitude_db": 1.0}, calibration_steps=30
        )
        simulate_links(room, tmp_path / "room")
        shutil.copytree(tmp_path / "room", tmp_path, dirs_exist_ok=True)
    if " davies2024 " in line:
        for number in (1, 2):
            write_scene(tmp_path / "superposed", number)
    if "sea/" in line or "video.npz" in line:
        radar = {"spokes": 128, "samples": 64, "step_m": 20.0, "pulse_m": 40.0, "beam_deg": 10.0}
        simulate_video(VideoSimulation(turns=8, ships=1, coast_north_m=1000, radar=radar), tmp_path / "sea")
        shutil.copy(tmp_path / "sea" / "video.npz", tmp_path)
    if "made/" in line:
        simulate_images(ImageSimulation(rows=48, columns=48, frames=8, appears=1, leaves=6), tmp_path / "made")
    if "bearings.csv" in line or "arrivals.csv" in line:
        write_flight(tmp_path)
    for other in blocks(COMMANDS[line].page):
        name = re.match(r"# (\S+\.yaml)\n", other.text)
        if other.language == "yaml" and name:
            text = re.sub(r"trials: \d+", "trials: 2", other.text)
            text = text.replace("frames: 60, appears: 2, leaves: 57", "frames: 12, appears: 1, leaves: 11")
            (tmp_path / name[1]).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line)
    if "--config fitted.yaml" in line:
        fit = next(other for other in COMMANDS if other.startswith(f"elusive fit {words[2]} "))
        with pytest.raises(SystemExit):
            main(shlex.split(fit)[1:])
    with pytest.raises(SystemExit) as ended:
        main([*words[1:], *FEWER.get(words[2], [])])
    assert not ended.value.code, capfd.readouterr()
    written = {"--out", "--figure", "--water-probability"} & set(words)
    for option in written:
        out = tmp_path / words[words.index(option) + 1]
        assert out.is_file() or any(out.iterdir())
    assert written


@pytest.mark.validate
def test_readme_tells_what_the_demonstration_finds(tmp_path: Path) -> None:
    told = [
        int(share)
        for share in re.findall(r"(\d+) %", (ROOT / "README.md").read_text(encoding="utf-8").split("\n## ")[0])
    ]
    measured = [int(share.removesuffix(" %")) for share in run_demo(tmp_path).rows[-1][1:]]
    assert told == pytest.approx(measured, abs=2)  # a processor may round one sum otherwise


FEWER_TRIALS = {"TRIALS = 40": "TRIALS = 2", "trials=30": "trials=2"}
CELL = re.compile(r"^```\{code-cell\} python\n(?::.*\n)*(.*?)^```$", re.MULTILINE | re.DOTALL)
CELLS = {page: found for page in PAGES if (found := CELL.findall((ROOT / page).read_text(encoding="utf-8")))}


@pytest.mark.validate
@pytest.mark.parametrize("page", CELLS)
def test_every_cell_of_a_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One after another, as when the site is built, which runs each page in a process of its own."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "page"}
    with plt.rc_context({"backend": "agg"}):
        for number, cell in enumerate(CELLS[page]):
            for many, few in FEWER_TRIALS.items():
                cell = cell.replace(many, few)
            exec(compile(cell, f"{page}, cell {number}", "exec", dont_inherit=True), names)
    plt.close("all")


@pytest.fixture
def fields(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """What fills pages in from the code."""
    monkeypatch.syspath_prepend(ROOT / "docs" / "_ext")
    return import_module("fields")


def test_the_readme_begins_with_every_system(fields: ModuleType) -> None:
    screen = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[:24]
    assert "\n".join(screen).count(fields.systems_table().strip()) == 1


def test_every_public_name_is_documented(fields: ModuleType) -> None:
    pages = "\n".join((ROOT / page).read_text(encoding="utf-8") for page in PAGES)
    shown = set(re.findall(r"automodule:: (\S+)", fields.ROOM.sub(fields.open_room, pages)))
    missing = [
        name for name, other in public_names() if not {name.rpartition(".")[0], other.rpartition(".")[0]} & shown
    ]
    assert missing == []


@pytest.mark.validate
def test_site_builds(tmp_path: Path) -> None:
    """A warning is an error, nothing is fetched by a page, and the inventory holds every public name."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", str(tmp_path / "trees")]
    site = tmp_path / "html"
    found = subprocess.run([*command, str(ROOT / "docs"), str(site)], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr

    fetched = re.compile(r"""<(?:script|link|img|iframe)[^>]*?(?:src|href)=["'](https?:)?//""")
    assert [page.name for page in site.glob("*.html") if fetched.search(page.read_text(encoding="utf-8"))] == []

    inventory = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    documented = {line.split(" ", 1)[0] for line in zlib.decompress(inventory).decode().splitlines()}
    missing = sorted(name for name, other in public_names() if name not in documented and other not in documented)
    assert missing == []


def public_names() -> list[tuple[str, str]]:
    """Each public class and function under the module that shows it, and under the one that defines it."""
    names = []
    for found in pkgutil.walk_packages(elusive.__path__, "elusive."):
        if any(part.startswith("_") for part in found.name.split(".")):
            continue
        module = import_module(found.name)
        for name in getattr(module, "__all__", vars(module)):
            thing = getattr(module, name)
            if name.startswith("_") or not (inspect.isclass(thing) or inspect.isfunction(thing)):
                continue
            if hasattr(module, "__all__") or thing.__module__ == found.name:
                exported = next((p for p in parents(found.name) if getattr(import_module(p), name, None) is thing), "")
                names.append((f"{found.name}.{name}", f"{exported}.{name}"))
    return names


def parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:end]) for end in range(len(parts) - 1, 0, -1)]
