"""The start page: a picture a system, the latest runs, and whatever lies in the folder, opened as what it is."""

from __future__ import annotations

import shutil
from importlib import import_module
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError
from elusive.io import open_frames
from elusive.systems.registry import SYSTEMS
from elusive.workbench.guessing import kind_of, system_of
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, choose, choose_in, field, report, told

PICTURES = Path(__file__).parents[2] / "src" / "elusive" / "workbench" / "static"


def test_every_page_has_its_picture() -> None:
    paths = [import_module(system.page).PAGE.path for system in SYSTEMS]
    assert all((PICTURES / f"{path[1:]}.svg").is_file() for path in (*paths, "/own"))


def test_a_card_says_what_its_example_does() -> None:
    from elusive.systems.signals.page import PAGE
    from elusive.systems.signals.scene import SignalScene, draw_signal

    truth = draw_signal(SignalScene()).truth[:, 0, 0]
    there = np.flatnonzero(np.isfinite(truth))
    assert f"from frame {there[0]} to {there[-1]} (counted from 0) of {len(truth)}, 600 samples each" in PAGE.example


@pytest.mark.parametrize(
    ("name", "head", "noun"),
    [
        ("a.csv", "time_s,sensor,azimuth_deg\n", "bearings"),
        ("b.csv", "time_s,tx,rx,channel,rss_dbm\n", "links"),
        ("c.csv", "time_s,range_m,bearing_deg\n", "radar"),
        ("d.mp4", "", "images"),
        ("e.wav", "", "signal"),
        ("f.pcap", "", "video"),
        ("f.pcap.gz", "", "video"),
        ("f.nc", "no array", ""),
        ("f.npz", "cut off", ""),
        ("f.npy", "", ""),
        ("c2.csv", "time_s,0-1-11,1-0-11\n", "links"),
        ("g.csv", "colour,size\n", ""),
        ("h.npy", "no array", ""),
    ],
)
def test_a_file_tells_what_it_is(tmp_path: Path, name: str, head: str, noun: str) -> None:
    (tmp_path / name).write_text(head)
    assert kind_of(tmp_path / name) == noun


def test_arrays_and_folders_tell_what_they_are(tmp_path: Path) -> None:
    np.save(tmp_path / "signal.npy", np.zeros((4, 9)))
    np.save(tmp_path / "frames.npy", np.zeros((4, 9, 9)))
    np.savez(tmp_path / "frames.npz", frames=np.zeros((4, 9, 9)))
    np.savez(tmp_path / "spokes.npz", amplitude=np.zeros((4, 9)), azimuth_deg=np.zeros(4))
    for name, arrays in (("f.nc", {"frames": np.zeros((4, 9, 9))}), ("s.nc", {"azimuth_deg": np.zeros(4)})):
        with h5py.File(tmp_path / name, "w") as file:
            file.update(arrays)
    names = ("signal.npy", "frames.npy", ".", "frames.npz", "f.nc", "spokes.npz", "s.nc")
    assert [kind_of(tmp_path / name) for name in names] == ["signal", *["images"] * 4, "video", "video"]
    with pytest.raises(DataError, match="as radar video does; track that with `elusive track video`"):
        open_frames(tmp_path / "spokes.npz")


@pytest.mark.parametrize(
    ("name", "text", "system"),
    [
        ("a.yaml", "frames: 30\nsystem: images\n", "images"),
        ("b.yml", "system: 'video'", "video"),
        ("c.yaml", "inner:\n  system: images\n", ""),
        ("d.csv", "system: images\n", ""),
        ("results/scene.yaml", "system: radar\n", "radar"),
    ],
)
def test_a_scene_tells_its_system(tmp_path: Path, name: str, text: str, system: str) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    assert system_of(path.parent if path.parent != tmp_path else path) == system


def test_a_press_counts_before_the_pictures_are_there_and_before_the_server_hears_the_page(
    served: Served, open_tab: OpenTab
) -> None:
    page = open_tab().page
    held: list[Any] = []
    page.route("**/*.svg", lambda route: held.append(route))
    page.route_web_socket("**/*", lambda socket: socket.close())
    page.route("**/_nicegui_ws/**", lambda route: None)  # nor is it heard in any other way
    page.evaluate("(address) => { window.location = address }", f"{served.address}/")
    example = page.get_by_role("link", name="Run the example: Noise objects along a signal")
    example.wait_for()
    before = example.bounding_box()
    for route in held:
        route.continue_()
    page.wait_for_function("[...document.querySelectorAll('.ew-picture')].every((one) => one.naturalWidth > 0)")
    assert example.bounding_box() == before  # what is pressed does not move away
    assert not page.evaluate("window.did_handshake")
    example.click()
    page.wait_for_url("**/signals?example=*")


def test_what_is_chosen_before_the_server_hears_the_page_is_kept_for_it(served: Served, open_tab: OpenTab) -> None:
    (served.folder / "late.csv").write_text("time_s,sensor,azimuth_deg\n0,a,1\n")
    page = open_tab().page
    sockets: list[Any] = []
    # the browser waits for the server's first word
    page.route_web_socket("**/*", lambda socket: sockets.append(socket))
    page.evaluate("(address) => { window.location = address }", f"{served.address}/")
    choose(page, "anything", "late.csv")
    assert not page.evaluate("window.did_handshake")
    assert page.url == f"{served.address}/"
    for socket in sockets:
        socket.connect_to_server()
    page.wait_for_url("**/own?file=late.csv*")
    (served.folder / "late.csv").unlink()


@pytest.mark.thorough
def test_a_scene_of_any_system_is_opened_on_its_page(served: Served, open_tab: OpenTab) -> None:
    """That of radar video stands in the test of its page."""
    changed: dict[str, dict[str, Any]] = {
        "links": {"simulation": {"seed": 77}}, "images": {"snr_db": 9.5}, "signals": {"frames": 77},
        "radar": {"methods": ["none", "grid"]}, "bearings": {"simulation": {"seed": 77}},
    }  # fmt: skip
    shown = {"images": ("snr_db", "9.5"), "signals": ("frames", "77"), "bearings": ("simulation.seed", "77")}
    for name, values in changed.items():
        scene = import_module(f"elusive.cli.scenes.{name}").SCENE(**values)
        (served.folder / f"{name}.yaml").write_text(scene.to_yaml())
    (served.folder / "wrong.yaml").write_text("system: signals\nframes: -3\n")
    page = open_tab().page
    for name in changed:
        page.goto(served.address)
        choose(page, "anything", f"{name}.yaml")
        told(page, f"{name}.yaml is open: press")
        if name in shown:
            key, value = shown[name]
            expect(field(page, key)).to_have_value(value)
    page.goto(served.address)
    choose(page, "anything", "wrong.yaml")
    told(page, "Frames: ")


def test_anything_in_the_folder_is_opened_as_what_it_is(served: Served, open_tab: OpenTab, tmp_path: Path) -> None:
    for words in (
        ["simulate", "bearings", "--out", str(tmp_path)],
        ["track", "bearings", str(tmp_path / "bearings.csv"), "--sensors", str(tmp_path / "sensors.csv"),
         "--sigma-deg", "2", "--out", str(served.folder / "old result")],
    ):  # fmt: skip
        with pytest.raises(SystemExit) as ended:
            main(words)
        assert ended.value.code in (0, None)
    shutil.copy(tmp_path / "bearings.csv", served.folder / "heard.csv")
    page = open_tab(width=800, scheme="dark").page
    page.goto(served.address)
    page.wait_for_function(
        "[...document.querySelectorAll('.ew-picture')].length === 7 && "
        "[...document.querySelectorAll('.ew-picture')].every((one) => one.naturalWidth > 0)"
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 800

    choose(page, "anything", "heard.csv")
    told(page, "Bearings from a few places")
    page.wait_for_function("document.querySelector('input[data-field=bearings]')?.value === 'heard.csv'")
    page.goto(served.address)
    choose(page, "anything", "old result")
    report(page, "old result")
    expect(field(page, "sigma_deg")).to_have_value("2")
    report(page, "old result").locator("body.body--dark").wait_for()
    choose_in(page, page.get_by_label("Colours"), "light")  # those chosen by hand are the report's, too, and stay so
    report(page, "old result").locator("body.body--light").wait_for()
    page.reload()
    report(page, "old result").locator("body.body--light").wait_for()
    page.goto(f"{served.address}/own?run=009-gone.csv")
    told(page, "'009-gone.csv': is no run that is kept here; it may have been deleted.")
