"""One scene tracked in several ways side by side: what a tab holds, a window to run them, one to watch them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from nicegui import ui

from elusive.errors import DataError
from elusive.model import Model
from elusive.workbench.blocks import HELD
from elusive.workbench.forms import FieldPath
from elusive.workbench.jobs import CancelledError, Job, away
from elusive.workbench.parts import Drawing, Form, are_right, told
from elusive.workbench.run_bar import RunBar
from elusive.workbench.shell import window

Scene = TypeVar("Scene", bound=Model)
Run = TypeVar("Run")


class TrackedState(Generic[Scene, Run]):
    """What one tab holds of a system that is tracked so."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.run: Run | None = None
        self.spec: dict[str, Any] | None = None  # of the player
        self.job: Job | None = None
        self.step: str | None = None
        self.changes = 0  # by which a run no longer follows from the scene

    def take(self, scene: Scene) -> Scene:
        """Take a changed scene; return it as it is kept."""
        if scene != self.scene:
            self.forget_run()
        self.scene = scene
        return scene

    def forget_run(self) -> None:
        """Drop the run and its frames, and that of work under way."""
        self.changes += 1
        self.run = None
        self.forget_frames()

    def forget_frames(self) -> None:
        """Drop the frames."""
        if self.spec is not None:
            for name in ("url", "marks"):
                HELD.drop(self.spec[name].rpartition("/")[2])
        self.spec = None


class Watch(Protocol):
    """What draws a run."""

    def __call__(self, run: Any, /, *, close: bool = False) -> dict[str, Any]:
        """Return the player's specification of a run, as a whole or from near."""


class Ways(NamedTuple):
    """The ways of one system."""

    heading: str
    names: Mapping[str, str]  # what each is said to be
    field: str  # of the scene: those that are chosen
    unit: str  # of what a job counts
    main: Sequence[FieldPath]
    outside: Sequence[FieldPath]  # never shown
    prepare: Callable[[Any], Callable[[Job], Any]]  # from the state to the work
    watch: Watch
    views: tuple[str, str]  # what the player shows: the whole, or from near

    def chosen(self, scene: Model) -> tuple[str, ...]:
        """Return those that a scene has."""
        names: tuple[str, ...] = getattr(scene, self.field)
        return names


async def run(state: TrackedState[Any, Any], ways: Ways, job: Job) -> bool:
    """Track a tab's scene; False if it was called off or the scene changed meanwhile.

    Raises
    ------
    DataError
        If it cannot be tracked.
    """
    work, changes = ways.prepare(state), state.changes

    def all_of_it() -> tuple[Any, dict[str, Any]]:
        found = work(job)
        job.advance(job.done)
        return found, ways.watch(found)

    try:
        found, spec = await away(all_of_it)
    except CancelledError:
        return False
    if state.changes != changes:
        return False
    state.forget_run()
    state.run, state.spec = found, spec
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
            with stage, ui.element("div").classes("ew-wide w-full"):
                self._form = Form(state.scene, ways.main, self._take)
                with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                    without = (*self._form.paths, *ways.outside)
                    self._more = Form(state.scene, (("tracking",),), self._take, without=without)
        ui.timer(0.1, self._watch)

    def _take(self, scene: Model) -> Model:
        kept: Model = self._state.take(scene)
        self._form.model = self._more.model = kept
        return kept

    def _choose(self, name: str, chosen: bool) -> None:
        ways, scene = self._ways, self._state.scene
        now = ways.chosen(scene)
        names = tuple(one for one in ways.names if (chosen if one == name else one in now))
        self._take(scene.replace(**{ways.field: names}))

    async def _start(self) -> None:
        state, ways = self._state, self._ways
        if not are_right((self._form, self._more)):
            return
        done, state.job = False, Job()
        self._bar.show()
        try:
            with told():
                if not ways.chosen(state.scene):
                    raise DataError(f"{ways.field}: none is chosen; choose one or more.")
                done = await run(state, ways, state.job)
                self._bar.tell("" if done else "Cancelled.")
        finally:
            state.job = None
            self._bar.show()
        if done:
            self._go_on()

    def _watch(self) -> None:
        job, names = self._state.job, self._ways.chosen(self._state.scene)
        if job is None or not job.total or not names:
            return
        each = max(job.total // len(names), 1)
        number = min(job.done // each, len(names) - 1)
        within = f"{self._ways.unit} {job.done - number * each} of {each}" if each > 1 else "..."
        self._bar.tell(f"{names[number]}: {within}", job.done / job.total)


def watch_window(state: TrackedState[Any, Any], ways: Ways) -> None:
    """Build the window in which a run is played, as a whole or from near."""
    with ui.element("section").classes("ew-box w-full"):
        if state.run is None or state.spec is None:
            ui.label("Nothing is tracked yet: press Run under Track.").classes("ew-note")
            return
        found = state.run

        async def look(event: Any) -> None:
            spec = await away(lambda: ways.watch(found, close=event.value == ways.views[1]))
            if state.run is found:
                state.forget_frames()
                state.spec = spec
                player.show(spec)

        ui.toggle(list(ways.views), value=ways.views[0], on_change=look).props("no-caps unelevated dense").classes(
            "ew-modes mb-2"
        )
        player = Drawing("player", state.spec)
