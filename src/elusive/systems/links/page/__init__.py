"""Radio tomography: the six windows of Mendieta (2017), chapter 5, as steps of one page."""

from __future__ import annotations

from nicegui import ui

from elusive.systems.links.networks import BorderNodes
from elusive.systems.links.page.algorithm import AlgorithmWindow, apply
from elusive.systems.links.page.paths import PathsWindow
from elusive.systems.links.page.performance import PerformanceWindow, read_scene
from elusive.systems.links.page.radiation import RadiationWindow
from elusive.systems.links.page.sensors import SensorsWindow
from elusive.systems.links.page.state import LinksState
from elusive.systems.links.presets import first_simulation
from elusive.systems.links.scene import run_scene
from elusive.workbench.jobs import Job
from elusive.workbench.opener import open_scene
from elusive.workbench.parts import Changed, Drawing, errors_shown
from elusive.workbench.session import example_state, offer_aside, state_of
from elusive.workbench.shell import Page, Steps, head, main, waiting

TITLE = "People in a radio network"
LEAD = (
    "People who carry no device shadow the links between radios. Draw who walks, place the radios, image the area from "
    "the links, and follow everybody through it."
)
WATCHED = "5 Tracking"


def warm_up() -> None:
    """Run a small scene, so that what is compiled or loaded once is there when it is waited for."""
    first = first_simulation()
    walks = first.simulation.walks.replace(total_positions=30, latest_entrance=5)
    simulation = first.simulation.replace(walks=walks, network=BorderNodes(nodes=12))
    run_scene(first.replace(simulation=simulation))


async def build(example: bool, file: str = "") -> None:
    """Build the page; ``example``: run the thesis's first simulation at once; ``file``: a scene that is opened."""
    head("/links")
    state = await state_of("links", LinksState)
    if example:
        state, had = await example_state("links", LinksState)
        state.kept = had.run or had.kept
    with main(TITLE, LEAD):
        offer_aside("links")
        if example:
            with waiting("Drawing and tracking the first simulation ..."), errors_shown():
                await apply(state, Job())
            if state.tracking_spec is not None:
                state.tracking_spec["autoplay"] = True
        open_scene(file, lambda path: state.take(read_scene(path)), "press Apply under Algorithm")
        steps = Steps(
            state,
            {
                "1 Paths": lambda: PathsWindow(state),
                "2 Radiation": lambda: RadiationWindow(state),
                "3 Sensors": lambda: SensorsWindow(state),
                "4 Algorithm": lambda: AlgorithmWindow(state, lambda: steps.go(WATCHED)),
                WATCHED: lambda: _tracking_window(state),
                "6 Performance": lambda: PerformanceWindow(state),
            },
            WATCHED if example else None,
        )


def _tracking_window(state: LinksState) -> None:
    """Build window 5: the stages of tracking, played in step. Mendieta (2017), section 5.6."""
    with ui.element("section").classes("ew-box w-full"):
        if state.tracking_spec is None:
            ui.label("Nothing is tracked yet: press Apply under Algorithm.").classes("ew-note")
        else:
            Changed(lambda: state.run_scene, lambda: state.scene, lambda: state.take(state.run_scene or state.scene))
            Drawing(state.tracking_spec)


PAGE = Page(
    "links", "/links", "People", TITLE,
    "A radio network sees people by the links they shadow: paths, radiation, sensors, image, tracks, scores.",
    "three people among 41 radios on the border of 24 by 24 m, the first simulation of Mendieta (2017).",
    build,
    warm_up=warm_up,
)  # fmt: skip
