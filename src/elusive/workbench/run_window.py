"""The window in which a command is run on a recording or a scene, its report seen, and its runs kept and compared."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from nicegui import ui

from elusive.model import Model
from elusive.workbench.asking import FOLLOW, refused
from elusive.workbench.form import are_right
from elusive.workbench.jobs import Errand, Job
from elusive.workbench.kept_runs import Kept, track
from elusive.workbench.live import Live, serves, watch
from elusive.workbench.own_runs import RunList, asking_of, show_none, show_run
from elusive.workbench.parts import Changed, LiveDrawing, errors_shown
from elusive.workbench.run_bar import RunBar
from elusive.workbench.run_inputs import RunInputs, Shown
from elusive.workbench.run_state import RunState
from elusive.workbench.session import state_of
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import head, main, window

FEW = 3  # kinds that stand side by side
BEGINS = "Nothing is tracked yet: say what shall be and press Run, or open a run below."
GOES_ON = "It is being tracked; what comes of it will stand here."


class RunWindow:
    """The window of one page.

    Parameters
    ----------
    state
        What the tab holds.
    kinds
        What can be run, by the nouns of the kinds, and what each is called.
    shown
        How the parameters of a kind are shown, where not all are.
    elsewhere
        Whether what runs elsewhere can be watched here.
    """

    def __init__(
        self, state: RunState, kinds: Mapping[str, str], shown: Mapping[str, Shown] | None = None, *,
        elsewhere: bool = False,
    ) -> None:  # fmt: skip
        self._state = state
        self._busy = state.job is not None
        with window() as (side, stage):
            with side:
                self._kind = self._choice(dict(kinds))
                self._bar = RunBar(state, self.run, model=lambda: state.models.get(state.noun))
                self._inputs = RunInputs(state, shown or {})
                if elsewhere:
                    with ui.expansion("Watch what runs elsewhere").props("dense").classes("w-full"):
                        self._served()
            with stage:
                self._result = ui.column().classes("w-full gap-3 ew-result").props("tabindex=-1")
        with self._bar.row:
            self._down = ui.button("See the result", on_click=self._lead_down)
            self._down.props("outline no-caps").classes("ew-down")
        with ui.element("section").classes("ew-box w-full"):
            self._runs = RunList(kinds, self._open, self._show)
        ui.timer(0.2, self._watch)
        self._inputs.show()
        self._show()

    def _choice(self, kinds: dict[str, str]) -> Any:
        value = self._state.noun or None
        if len(kinds) <= FEW:
            return ui.radio(kinds, value=value, on_change=self._chosen).props('inline dense aria-label="What is run"')
        made = ui.select(kinds, value=value, label="What do you have?", on_change=self._chosen)
        return made.props('dense outlined data-field="kind"').classes("w-full")

    def _chosen(self, event: Any) -> None:
        if event.value != self._state.noun:
            self._state.choose(event.value)
            self._inputs.show()
            self._bar.show()

    async def run(self) -> None:
        """Run what is chosen, as it is set."""
        state = self._state
        if not state.noun:
            self._bar.refuse("What do you have? Choose the kind of recording first.")
            return
        asked, given, model = asking_of(state.noun), dict(state.given[state.noun]), state.models[state.noun]
        if (sentence := refused(asked, given, SETTINGS.folder)) != "":
            self._bar.refuse(sentence)
            return
        if not are_right(self._inputs.forms):
            return
        job = Live(f"{state.noun}, live") if given.get(FOLLOW) else Errand()
        await self._work(job, lambda job: track(SETTINGS.folder, asked, given, model, job), model)

    async def example(self, noun: str) -> None:
        """Run a kind of scene as it stands ready; what a person has set of it stays set."""
        asked = asking_of(noun)
        model = asked.parameters()
        await self._work(Errand(), lambda job: track(SETTINGS.folder, asked, {}, model, job), model)

    def _served(self) -> None:
        """Build what joins a run of `elusive serve`: of a folder in the workbench's, or by its address."""
        ui.label("elusive serve prints its address; its token is in the file of that name.").classes("ew-note")
        address = ui.input("Address of a serve: http://127.0.0.1:8765/?token=...").props("dense outlined")
        address.classes("w-full").props["data-field"] = "served"
        ui.button("Watch", on_click=lambda: self._watch_served("served", str(address.value))).props("outline no-caps")
        for name, known in serves(SETTINGS.folder).items():
            ui.button(f"Watch {name}", on_click=lambda name=name, known=known: self._watch_served(name, known)).props(
                "outline no-caps"
            )

    async def _watch_served(self, name: str, address: str) -> None:
        def watched(job: Live) -> None:
            watch(address, job)

        await self._work(Live(name), watched, None)

    async def _work(self, job: Job, work: Callable[[Any], Kept | None], ran: Model | None) -> None:
        state = self._state
        if state.job is not None:
            self._bar.refuse("Something runs on this page already: stop that first, or go on in another tab.")
            return
        state.seen, state.live = None, job if isinstance(job, Live) else None
        state.seen = await self._bar.run(job, lambda: work, self._show)
        state.ran = None if state.seen is None else ran
        if state.refused and not job.done:  # nothing came
            state.live = None
        self._busy = False
        self._show()

    def _watch(self) -> None:
        job = self._state.job
        if job is not None:
            of = f" of {job.total}" if job.total else ""
            what = " steps" if isinstance(job, Live) else " done"
            words = f"{job.done}{of}{what}" if job.done else "reading ..."
            self._bar.tell(words, job.done / job.total if job.total else 0.0)
        elif self._busy:  # started before this page was loaded anew
            self._bar.tell("")
            self._bar.show()
            self._show()
        self._busy = job is not None

    def _show(self) -> None:
        run = self._state.seen
        if run is not None and not run.folder.is_dir():  # deleted elsewhere
            run = self._state.seen = None
        self._down.set_visibility(run is not None or self._state.live is not None)
        self._result.clear()
        with self._result:
            if self._state.live is not None:
                LiveDrawing(f"/live/{self._state.live.key}").classes("ew-goes-on")
            elif run is None:
                ui.label(BEGINS if self._state.job is None else GOES_ON).classes("ew-note")
            if run is not None:
                Changed(lambda: self._state.ran, self._now, self._back)
                if self._state.ran is not None:
                    show_none(run, self._state.ran, self._try, self._inputs.without(run.noun, self._state.ran))
                show_run(run)
        self._runs.show()

    def _lead_down(self) -> None:
        """Show the result from its top, where it stands below the form, and go on by keyboard there."""
        one = f"getHtmlElement({self._result.id})"
        ui.run_javascript(f"{one}.focus({{ preventScroll: true }}); {one}.scrollIntoView();")

    def _now(self) -> Model:
        seen = self._state.seen  # another kind may have been chosen since
        return self._state.models[self._state.noun if seen is None else seen.noun]

    async def _try(self, model: Model) -> None:
        """Run what is seen with other settings."""
        state = self._state
        if state.job is None and state.seen is not None:
            state.again(state.seen)
            self._kind.value = state.noun
            state.models[state.noun] = model
            self._inputs.show()
            await self.run()
            self._result.run_method("focus")  # what was pressed is gone

    def _back(self) -> None:
        state = self._state
        if state.seen is not None and state.ran is not None:
            state.choose(state.seen.noun)
            self._kind.value = state.noun
            state.models[state.noun] = state.ran
            self._inputs.show()

    def _open(self, run: Kept) -> None:
        with errors_shown():
            self._state.again(run)
            self._kind.value = run.noun
            self._inputs.show()
            self._show()


def scenes_page(
    path: str, title: str, lead: str, kinds: Mapping[str, str], shown: Mapping[str, Shown]
) -> Callable[[bool, str], Awaitable[None]]:
    """Return what builds the page of a system whose scenes and recordings are run by its commands.

    Parameters
    ----------
    path, title, lead
        Where it is, and what stands above it.
    kinds
        What can be run, by the nouns of the kinds, and what each is called; the first is a scene.
    shown
        How the parameters of a kind are shown, where not all are.
    """
    scene = next(iter(kinds))

    async def build(example: bool, file: str) -> None:
        """Build it; ``example``: run the ready scene at once; ``file``: a scene, recording or run that is opened."""
        head(path)
        state = await state_of(path, lambda: RunState(tuple(kinds), scene))
        with errors_shown():
            if file:
                state.take(file)
                if state.seen is None:
                    ui.notify(f"{file} is open: press Run.", type="positive")
            elif example:
                state.choose(scene)
        with main(title, lead):
            opened = RunWindow(state, kinds, shown)
        if example:
            await opened.example(scene)

    return build
