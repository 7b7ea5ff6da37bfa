"""A person's own recording, of any kind: opened, tracked by the command itself, seen in its report, kept, compared."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import ui

from elusive.errors import DataError
from elusive.model import Model
from elusive.workbench.asking import FOLLOW, Asked, listed, refused
from elusive.workbench.files import PLAIN, UPLOAD_MOST_BYTES, in_folder, stranger
from elusive.workbench.form import Form, FormTools, are_right
from elusive.workbench.guessing import kind_of
from elusive.workbench.jobs import Job, away
from elusive.workbench.kept_runs import Kept, is_result, settings_of, track
from elusive.workbench.live import Live, serves, watch
from elusive.workbench.own_runs import RunList, asking_of, run_named, show_none, show_run
from elusive.workbench.parts import Changed, LiveDrawing, errors_shown, refuse
from elusive.workbench.run_bar import RunBar
from elusive.workbench.session import state_of
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import OWN, head, main, window

PATH, TITLE = OWN
LEAD = (
    "Say what you have, choose its files, press Run: it is tracked as the command line does it, and what came of it is "
    "kept in the workbench's folder, with its report, until you delete it."
)


class OwnState:
    """What one tab holds: the kind of recording, what was given of each kind, the run that is seen."""

    def __init__(self) -> None:
        self.noun = ""
        self.given: dict[str, dict[str, str | bool]] = {}
        self.models: dict[str, Model] = {}
        self.seen: Kept | None = None
        self.ran: Model | None = None  # settings of the run that is seen
        self.job: Job | None = None
        self.live: Live | None = None  # shown, going on or ended

    def choose(self, noun: str) -> None:
        """Take another kind of recording."""
        self.noun = noun
        self.given.setdefault(noun, {})
        self.models.setdefault(noun, asking_of(noun).parameters())

    def take(self, file: str) -> None:
        """Take a file of the folder, or the results in it, for what it seems to be."""
        if is_result(SETTINGS.folder / file):
            self.again(run_named(file))
        elif stranger(SETTINGS.folder, SETTINGS.folder / file):
            raise DataError(f"{file}: leads out of the workbench's folder; put a copy there.")
        elif noun := kind_of(SETTINGS.folder / file):
            self.choose(noun)
            self.given[noun][asking_of(noun).asked[0].name] = file
            self.seen = self.live = None
        else:
            raise DataError(f"{file}: does not tell what it is; say what you have, and choose it there.")

    def again(self, run: Kept) -> None:
        """Take a run's files and settings, and see it."""
        settings = settings_of(run.folder, asking_of(run.noun).parameters)
        self.choose(run.noun)
        self.given[run.noun] = dict(run.given) or self.given[run.noun]
        self.models[run.noun] = settings
        self.seen, self.ran, self.live = run, settings, None


class _Page:
    def __init__(self, state: OwnState) -> None:
        self._state = state
        self._forms: list[Form] = []
        self._busy = state.job is not None
        with window() as (side, stage):
            with side:
                kinds = {one.noun: one.name[:1].upper() + one.name[1:] for one in SETTINGS.recordings}
                self._kind = (
                    ui.select(kinds, value=state.noun or None, label="What do you have?", on_change=self._chosen)
                    .props('dense outlined data-field="kind"')
                    .classes("w-full")
                )
                self._bar = RunBar(state, self._run)
                self._inputs = ui.column().classes("w-full gap-2 ew-wide")
                with ui.expansion("Watch what runs elsewhere").props("dense").classes("w-full"):
                    self._served()
            with stage:
                self._result = ui.column().classes("w-full gap-3")
        with ui.element("section").classes("ew-box w-full"):
            self._runs = RunList(self._open, self._show)
        ui.timer(0.2, self._watch)
        self._build()
        self._show()

    def _chosen(self, event: Any) -> None:
        if event.value != self._state.noun:
            self._state.choose(event.value)
            self._build()

    def _build(self) -> None:
        self._inputs.clear()
        self._forms = []
        if not self._state.noun:
            return
        state, asked = self._state, asking_of(self._state.noun)
        needed = [one for one in asked.asked if one.needed or one.is_file]
        with self._inputs:
            if asked.follows:
                ui.switch(
                    "It comes live", value=bool(state.given[state.noun].get(FOLLOW)), on_change=self._follow
                ).props["data-field"] = FOLLOW
            for one in needed:
                self._ask(one)
            self._upload()
            rest = [one for one in asked.asked if one not in needed]
            with ui.expansion("How it is read").props("dense").classes("w-full"):
                for one in rest:
                    self._ask(one)
            model = state.models[state.noun]
            FormTools(lambda: self._forms)
            self._forms = [Form(model, asked.main, self._take, grouped=False)]
            with ui.expansion("Everything else that can be set").props("dense").classes("w-full"):
                self._forms.append(Form(model, ((),), self._take, without=asked.main))
            ui.button("The usual settings", on_click=self._reset).props("flat no-caps dense")

    def _follow(self, event: Any) -> None:
        self._state.given[self._state.noun][FOLLOW] = event.value
        self._build()

    def _ask(self, one: Asked) -> None:
        state = self._state
        given, value = state.given[state.noun], state.given[state.noun].get(one.name, "")
        typed = not one.flag and bool(given.get(FOLLOW))  # an address, too
        made: Any
        if one.switch:
            made = ui.switch(
                one.label, value=bool(value), on_change=lambda event: given.update({one.name: event.value})
            )
        elif one.is_file:
            names = in_folder(SETTINGS.folder)
            if typed and value and value not in names:
                names.append(str(value))
            chosen = [str(value)] if typed and value else [name for name in listed(str(value)) if name in names]
            several = one.values != 1

            def take(event: Any) -> None:
                parts = event.value if isinstance(event.value, list) else [event.value] if event.value else []
                given[one.name] = ", ".join(parts)

            made = ui.select(
                names, value=chosen if several else (chosen[0] if chosen else None), on_change=take, multiple=several,
                label=f"{one.label}: a file that grows, or an address" if typed else one.label,
                clearable=not one.needed, with_input=True, new_value_mode="add-unique" if typed else None,
            ).props("dense outlined options-dense").classes("w-full")  # fmt: skip
        else:
            made = ui.input(one.label, value=str(value), on_change=lambda event: given.update({one.name: event.value}))
            made.props("dense outlined").classes("w-full")
        made.props["data-field"] = one.name
        with made:
            ui.tooltip(one.help.replace("\\[", "[")).props("delay=600 max-width=320px")

    def _upload(self) -> None:
        async def sent(event: Any) -> None:
            event.sender.reset()
            data = await event.file.read()
            name = Path(event.file.name.replace("\\", "/")).name
            with errors_shown():
                if not PLAIN.fullmatch(name):
                    raise DataError(f"{name!r:.60}: is no plain file name; use letters, digits, '.', '-' and '_'.")
                if (SETTINGS.folder / name).exists():
                    raise DataError(f"{name}: is in the workbench's folder already; rename yours, or choose that one.")
                await away(lambda: (SETTINGS.folder / name).write_bytes(data))
                self._build()
                ui.notify(f"{name} is in the workbench's folder now; choose it above.")

        ui.upload(
            label="Send files from this computer to the workbench's folder", auto_upload=True, multiple=True,
            on_upload=sent, max_file_size=UPLOAD_MOST_BYTES,
            on_rejected=lambda: refuse(f"A file is refused: {UPLOAD_MOST_BYTES >> 20} MiB at most; copy it yourself."),
        ).props("flat bordered").classes("w-full")  # fmt: skip

    def _take(self, model: Model) -> Model:
        self._state.models[self._state.noun] = model
        for form in self._forms:
            form.model = model
        return model

    def _reset(self) -> None:
        self._state.models[self._state.noun] = asking_of(self._state.noun).parameters()
        self._build()

    async def _run(self) -> None:
        state = self._state
        if not state.noun:
            refuse("What do you have? Choose the kind of recording first.")
            return
        asked, given, model = asking_of(state.noun), dict(state.given[state.noun]), state.models[state.noun]
        if (sentence := refused(asked, given, SETTINGS.folder)) != "":
            refuse(sentence)
            return
        if not are_right(self._forms):
            return
        job = Live(f"{state.noun}, live") if given.get(FOLLOW) else Job()
        await self._work(job, lambda job: track(SETTINGS.folder, asked, given, model, job))

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

        if self._state.job is None:
            await self._work(Live(name), watched)

    async def _work(self, job: Job, work: Callable[[Any], Kept | None]) -> None:
        state = self._state
        state.seen, state.live = None, job if isinstance(job, Live) else None
        ran = state.models.get(state.noun)
        state.seen = await self._bar.run(job, lambda: work, self._show)
        state.ran = None if state.seen is None else ran
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
        self._result.clear()
        with self._result:
            if self._state.live is not None:
                LiveDrawing(f"/live/{self._state.live.key}").classes("ew-goes-on")
            elif run is None:
                ui.label("Nothing is tracked yet: choose a recording and press Run, or open a run below.").classes(
                    "ew-note"
                )
            if run is not None:
                Changed(lambda: self._state.ran, self._now, self._back)
                if self._state.ran is not None:
                    show_none(run, self._state.ran, self._try)
                show_run(run)
        self._runs.show()

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
            self._build()
            await self._run()

    def _back(self) -> None:
        state = self._state
        if state.seen is not None and state.ran is not None:
            state.choose(state.seen.noun)
            self._kind.value = state.noun
            state.models[state.noun] = state.ran
            self._build()

    def _open(self, run: Kept) -> None:
        with errors_shown():
            self._state.again(run)
            self._kind.value = run.noun
            self._build()
            self._show()


async def own_page(run: str = "", file: str = "") -> None:
    """Build the page; with the run that is opened, or with a file of the folder."""
    head(PATH)
    state = await state_of("own", OwnState)
    with errors_shown():
        if run:
            state.again(run_named(run))
        elif file in in_folder(SETTINGS.folder):
            state.take(file)
    with main(TITLE, LEAD):
        _Page(state)
