"""Forms follow the models: every field is there, with unit, bounds and help, and refusals find their field."""

from __future__ import annotations

import pytest
from pydantic import Field

from elusive.charts.charted_area import ChartedAreaParameters
from elusive.errors import ParameterError
from elusive.model import Model, Positive
from elusive.options import options_of
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.links.by_image import ImageMethod
from elusive.systems.links.presets import FIRST_SIMULATION, presets, thesis_method
from elusive.systems.links.scene import LinkScene
from elusive.systems.links.simulate import LinkSimulation
from elusive.workbench.forms import controls, faults, label_of, laid_over, text_of, usual_text
from tests.workbench.conftest import Served, expect
from tests.workbench.test_links_page import OpenTab, button, choose, field

TRACKER = ("tracking", "method", "tracker")


class Inner(Model):
    """A part."""

    width_m: Positive = Field(2.0, le=9.0, description="How wide it is [m]")
    names: tuple[float, ...] = Field((1.0, 2.5), description="Some numbers [s]")


class Outer(Model):
    """A whole."""

    part: Inner = Field(Inner(), description="The part")
    several: int | None = Field(None, ge=1, description="How many; none: as usual")
    on: bool = Field(True, description="Whether")


def test_a_field_brings_its_control_with_it() -> None:
    shown = {one.key: one for one in controls(Outer())}
    width = shown["part.width_m"]
    assert (width.label, width.unit, width.help, width.group) == (
        "Width", "m", "How wide it is. Above 0 to 9.", "The part",
    )  # fmt: skip
    assert shown["on"].switch
    assert shown["several"].optional
    assert [text_of(Outer(), one.path) for one in shown.values()] == ["2", "1, 2.5", "", True]


@pytest.mark.parametrize("model", [LinkSimulation(), ImageMethod(), thesis_method()])
def test_no_option_of_the_command_line_lacks_its_control(model: Model) -> None:
    def stands(path: tuple[str, ...]) -> bool:
        """Whether the kinds that are chosen have the field."""
        here: object = model
        for name in path:
            if not hasattr(here, name):
                return False
            here = getattr(here, name)
        return True

    wanted = {option.path for option in options_of(type(model)) if stands(option.path)}
    assert {one.path for one in controls(model)} == wanted


def test_what_is_typed_is_laid_over_the_model() -> None:
    typed = {("part", "width_m"): " 3.5 ", ("part", "names"): "4; 5", ("several",): "7", ("on",): False}
    assert laid_over(Outer(), typed) == Outer(part=Inner(width_m=3.5, names=(4.0, 5.0)), several=7, on=False)
    assert laid_over(Outer(several=3), {("several",): " "}) == Outer()


def test_another_kind_brings_its_own_fields() -> None:
    scene = presets()[FIRST_SIMULATION]
    changed = laid_over(scene, {(*TRACKER, "kind"): "hungarian"})
    assert isinstance(changed, LinkScene)
    assert changed.tracking.method.tracker.kind == "hungarian"
    keys = {one.key for one in controls(changed, (TRACKER,))}
    assert "tracking.method.tracker.gate_m" in keys
    assert "tracking.method.tracker.radius_m" not in keys


@pytest.mark.parametrize(
    ("key", "text", "sentence"),
    [
        ("simulation.walks.users", "0", "Must be greater than or equal to 1 (got '0')."),
        ("simulation.walks.users", "many", "Must be a valid integer"),
        ("simulation.radiation.width_x_m", "", "Must be a valid number"),
        ("simulation.walks.latest_entrance", "900", "Step 900 is after the last"),
        (
            "tracking.method.tracker.life.confirm_window",
            "2",
            "Must be at least confirm_frames",
        ),
    ],
)
def test_a_refusal_is_led_to_its_field_in_the_librarys_words(key: str, text: str, sentence: str) -> None:
    scene, path = presets()[FIRST_SIMULATION], tuple(key.split("."))
    with pytest.raises(ParameterError) as refused:
        laid_over(scene, {path: text})
    marked, rest = faults(refused.value, controls(scene))
    assert list(marked) == [path]
    assert marked[path].startswith(sentence)
    assert rest == ""


def test_two_refusals_find_two_fields_and_what_is_of_none_is_said() -> None:
    scene = presets()[FIRST_SIMULATION]
    users, width = ("simulation", "walks", "users"), ("simulation", "walks", "turn_deg")
    with pytest.raises(ParameterError) as refused:
        laid_over(scene, {users: "0", width: "999"})
    marked, _ = faults(refused.value, controls(scene))
    assert set(marked) == {users, width}
    assert "turn_deg" not in marked[users]
    assert faults(ParameterError("paths: are wrong."), controls(scene)) == ({}, "paths: are wrong.")


def test_the_presets_are_the_tables_of_the_thesis() -> None:
    found = presets()
    tracker = found["Table 4.6: radius of 3 m"].tracking.method.tracker
    assert tracker.kind == "radius"
    assert tracker.radius_m == 3.0
    assert found["Table 4.4: fade level 5 dB"].simulation.radiation.amplitude_db == 5.0
    assert len(found["Table 4.7: 9 sensors"].simulation.bind().nodes.names) == 9
    assert all(scene.tracking.area == scene.area for scene in found.values())


def test_a_unit_is_told_by_the_description_or_else_by_the_name() -> None:
    told = {one.key: (one.label, one.unit) for one in controls(ChartedAreaParameters())}
    assert told["draught_m"] == ("Draught", "m")
    assert told["imprecision.coast_sigma_m"] == ("Coast sigma", "m")
    assert told["islet_mm"] == ("Islet", "mm")


def test_what_usually_stands_in_a_field_is_that_of_the_kind_chosen() -> None:
    tracking = BearingTracking(sigma_deg=2.0)
    assert usual_text(tracking, ("sigma_deg",)) == text_of(BearingTracking(), ("sigma_deg",))
    for one in controls(tracking):
        usual = usual_text(tracking, one.path)
        assert usual is None or (usual != text_of(tracking, one.path)) == (one.key == "sigma_deg"), one.key


DRAWN_OVER = """() => [...document.querySelectorAll(".ew-field .q-field__bottom")]
    .filter((one) => one.offsetParent !== null)
    .filter((one) => one.getBoundingClientRect().bottom > one.closest(".ew-field").getBoundingClientRect().bottom + 1)
    .map((one) => one.innerText)"""  # help that lies over the next field


@pytest.mark.thorough
def test_settings_are_found_marked_set_back_and_undone(served: Served, open_tab: OpenTab) -> None:
    page = open_tab(width=800, scheme="dark").page
    page.goto(f"{served.address}/own")
    choose(page, "kind", "Bearings from a few places")
    vertical = page.get_by_text("Power of the white vertical acceleration").first
    sigma = field(page, "sigma_deg")
    sigma.fill("0.5")
    marked = page.locator(".ew-set")
    marked.first.wait_for()
    assert marked.count() == 1
    field(page, "find").fill("vertical")
    page.get_by_text("Process noise q vertical").wait_for()  # of what was folded up
    sigma.wait_for(state="hidden")
    assert not vertical.is_visible()
    page.get_by_text("Explain").click()
    vertical.wait_for()
    field(page, "find").fill("nothing of this name")
    page.get_by_text("No setting's name or help has these words.").wait_for()
    field(page, "find").fill("")
    sigma.wait_for()
    page.get_by_text("No setting's name or help has these words.").wait_for(state="hidden")
    page.get_by_text("Process noise q vertical").wait_for(state="hidden")  # folded up again
    assert page.evaluate(DRAWN_OVER) == []
    page.get_by_role("button", name="Sigma: back to the usual").click()
    marked.first.wait_for(state="detached")
    button(page, "Undo").click()
    marked.first.wait_for()
    expect(sigma).to_have_value("0.5")
    button(page, "Undo").click()
    marked.first.wait_for(state="detached")
    button(page, "Undo").click()
    page.get_by_text("Nothing has been changed since this page was built.").wait_for()
    page.mouse.wheel(0, 600)
    expect(button(page, "Run")).to_be_visible()


def test_an_option_is_called_as_people_call_it_with_its_unit() -> None:
    names = ("radar_lat_deg", "truth_mmsi", "rate_hz", "ais", "own_ship")
    said = ["Radar latitude [deg]", "Truth MMSI", "Rate [Hz]", "AIS", "Own ship"]
    assert [label_of(name) for name in names] == said
