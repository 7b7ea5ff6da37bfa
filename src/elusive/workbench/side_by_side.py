"""One scene tracked in several ways side by side: what a tab holds, a window to run them, one to watch them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from nicegui import ui

from elusive.errors import DataError
from elusive.model import Model
from elusive.report.drawing import Drawing as Drawn
from elusive.workbench.form import Form, FormTools, are_right
from elusive.workbench.forms import FieldPath
from elusive.workbench.jobs import Job, away
from elusive.workbench.parts import Changed, Drawing, errors_shown
from elusive.workbench.run_bar import RunBar
from elusive.workbench.shell import window

Scene = TypeVar("Scene", bound=Model)
Run = TypeVar("Run")


class TrackedState(Generic[Scene, Run]):
    """What one tab holds of a system that is tracked so."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.run: Run | None = None
        self.drawn: Drawn | None = None  # of the run
        self.job: Job | None = None
        self.refused = ""
        self.step: str | None = None
        self.ran: Scene | None = None  # the scene that the run is of
        self.openings = 0  # of what a run can no longer be of

    def take(self, scene: Scene) -> Scene:
        """Take a changed scene; return it as it is kept. The run stays, with the scene that it is of."""
        self.scene = scene
        return scene

    def forget_run(self) -> None:
        """Drop the run, and that of work under way: what it is of is gone."""
        self.openings += 1
        self.run = self.drawn = self.ran = None


class Ways(NamedTuple):
    """The ways of one system."""

    heading: str
    names: Mapping[str, str]  # what each is said to be
    field: str  # of the scene: those that are chosen
    unit: str  # of what a job counts
    main: Sequence[FieldPath]
    outside: Sequence[FieldPath]  # never shown
    prepare: Callable[[Any], Callable[[Job], Any]]  # from the state to the work
    watch: Callable[[Any], Drawn]  # draws a run

    def chosen(self, scene: Model) -> tuple[str, ...]:
        """Return those that a scene has."""
        names: tuple[str, ...] = getattr(scene, self.field)
        return names


async def run(state: TrackedState[Any, Any], ways: Ways, bar: RunBar | None = None) -> bool:
    """Track a tab's scene; False if it was refused, called off, or what it is of is gone meanwhile."""
    openings, scene, done = state.openings, state.scene, None

    def prepare() -> Callable[[Job], tuple[Any, Drawn]]:
        if not ways.chosen(state.scene):
            raise DataError(f"{ways.field}: none is chosen; choose one or more.")
        work = ways.prepare(state)

        def all_of_it(job: Job) -> tuple[Any, Drawn]:
            found = work(job)
            job.advance(job.done)
            return found, ways.watch(found)

        return all_of_it

    if bar is None:
        with errors_shown():
            work = prepare()
            done = await away(lambda: work(Job()))
    else:
        done = await bar.run(Job(), prepare)
    if done is None or state.openings != openings:
        return False
    (state.run, state.drawn), state.ran = done, scene
    return True


class TrackWindow:
    """The window that runs them.

    Parameters
    ----------
    state
        What the tab holds.
    ways
        The system's.
    go_on
        Done after a run.
    """

    def __init__(self, state: TrackedState[Any, Any], ways: Ways, go_on: Callable[[], None]) -> None:
        self._state, self._ways, self._go_on = state, ways, go_on
        with window() as (side, stage):
            with side:
                ui.label(ways.heading).classes("ew-section")
                for name, words in ways.names.items():
                    ui.checkbox(
                        words, value=name in ways.chosen(state.scene),
                        on_change=lambda event, name=name: self._choose(name, event.value),
                    ).props(f'dense data-way="{name}"')  # fmt: skip
                self._bar = RunBar(state, self._start)
                changed(state, self._show)
            with stage, ui.element("div").classes("ew-wide w-full"):
                FormTools(lambda: (self._form, self._more))
                self._form = Form(state.scene, ways.main, self._take)
                with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                    without = (*self._form.paths, *ways.outside)
                    self._more = Form(state.scene, (("tracking",),), self._take, without=without)
        ui.timer(0.1, self._watch)

    def _take(self, scene: Model) -> Model:
        kept: Model = self._state.take(scene)
        self._form.model = self._more.model = kept
        return kept

    def _show(self) -> None:
        self._form.show(self._state.scene)
        self._more.show(self._state.scene)

    def _choose(self, name: str, chosen: bool) -> None:
        ways, scene = self._ways, self._state.scene
        now = ways.chosen(scene)
        names = tuple(one for one in ways.names if (chosen if one == name else one in now))
        self._take(scene.replace(**{ways.field: names}))

    async def _start(self) -> None:
        state, ways = self._state, self._ways
        if not are_right((self._form, self._more)):
            return
        if await run(state, ways, self._bar):
            self._go_on()

    def _watch(self) -> None:
        job, names = self._state.job, self._ways.chosen(self._state.scene)
        if job is None or not job.total or not names:
            return
        each = max(job.total // len(names), 1)
        number = min(job.done // each, len(names) - 1)
        within = f"{self._ways.unit} {job.done - number * each} of {each}" if each > 1 else "..."
        self._bar.tell(f"{names[number]}: {within}", job.done / job.total)


def watch_window(state: TrackedState[Any, Any]) -> None:
    """Build the window in which a run is played."""
    with ui.element("section").classes("ew-box w-full"):
        if state.drawn is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
        else:
            changed(state)
            Drawing(state.drawn)


def changed(state: TrackedState[Any, Any], then: Callable[[], Any] = lambda: None) -> None:
    """Say what is set otherwise than in the run; the way back, and what is done ``then``."""

    def back() -> None:
        if state.ran is not None:
            state.take(state.ran)
            then()

    Changed(lambda: state.ran, lambda: state.scene, back)
