"""What a tab holds of what commands run: the kind of recording or scene, what was given of each, the run seen."""

from __future__ import annotations

from collections.abc import Sequence

from elusive.errors import DataError
from elusive.model import Model
from elusive.workbench.files import scene_in, stranger
from elusive.workbench.guessing import kind_of, system_of
from elusive.workbench.jobs import Job
from elusive.workbench.kept_runs import Kept, settings_of
from elusive.workbench.live import Live
from elusive.workbench.own_runs import all_runs, asking_of
from elusive.workbench.settings import SETTINGS


class RunState:
    """What one tab holds.

    Parameters
    ----------
    nouns
        Kinds that can be chosen.
    noun
        The one that is chosen at first; none: a person chooses.
    """

    def __init__(self, nouns: Sequence[str], noun: str = "") -> None:
        self.nouns, self.noun = nouns, ""
        self.given: dict[str, dict[str, str | bool]] = {}
        self.models: dict[str, Model] = {}
        self.seen: Kept | None = None
        self.ran: Model | None = None  # settings of the run that is seen
        self.job: Job | None = None
        self.refused = ""
        self.live: Live | None = None  # shown, going on or ended
        if noun:
            self.choose(noun)

    def choose(self, noun: str) -> None:
        """Take another kind."""
        self.noun, self.refused = noun, ""
        self.given.setdefault(noun, {})
        self.models.setdefault(noun, asking_of(noun).parameters())

    def take(self, file: str) -> None:
        """Take a file of the folder, or the results in it, for what it seems to be."""
        path = SETTINGS.folder / file
        if run := next((one for one in all_runs(self.nouns) if one.name == file), None):
            self.again(run)
        elif stranger(SETTINGS.folder, path):
            raise DataError(f"{file}: leads out of the workbench's folder; put a copy there.")
        elif scene := next((noun for noun in self.nouns if noun == f"{system_of(path)} scene"), ""):
            self.choose(scene)
            self.models[scene] = asking_of(scene).parameters.from_yaml(scene_in(SETTINGS.folder, file))
            self.seen = self.live = None
        elif (noun := kind_of(path)) in self.nouns:
            self.choose(noun)
            self.given[noun][asking_of(noun).asked[0].name] = file
            self.seen = self.live = None
        else:
            raise DataError(f"{file}: does not tell what it is; say what you have, and choose it there.")

    def again(self, run: Kept) -> None:
        """Take a run's files and settings, and see it."""
        settings_of(run.folder, asking_of(run.noun))  # or it is gone, or of no use
        settings = asking_of(run.noun).parameters(**run.settings)  # what was set, not what the recording then gave
        self.choose(run.noun)
        self.given[run.noun] = dict(run.given) or self.given[run.noun]
        self.models[run.noun] = settings
        self.seen, self.ran, self.live = run, settings, None
