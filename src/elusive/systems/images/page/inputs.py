"""What is set of the images: a scenario, and the filter; forms from the models' fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui import ui

from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.scene import ImageScene
from elusive.workbench.form import Form
from elusive.workbench.runs import BenchState

KIND = ("motion", "motion", "kind")
MAIN = (("snr_db",), ("targets",), KIND, ("appears",), ("leaves",), ("frames",))
UNITS = (("sensor", "dx"), ("sensor", "dy"))  # pixels
INNER = (("motion",), ("sensor",), ("tracking",))
FILTER = ("tracking", "filter")
RECORDED_ONLY = tuple(("tracking", name) for name in ("background", "jitter_px", "clump_px"))
KNOWN = tuple(
    (*FILTER, *path) for path in (("motion",), ("birth", "snr_db"), ("birth", "snr_db_range"), ("target_snr_db",))
)


class ImageInputs:
    """The inputs of one page."""

    def __init__(self, state: BenchState[ImageScene]) -> None:
        self._state = state
        self._forms: list[Form] = []
        self._is_open = False  # the filter's fields
        self._box = ui.column().classes("w-full gap-2 ew-wide")
        self._build()

    def forms(self) -> Sequence[Form]:
        """Return the forms that count."""
        return self._forms

    def _build(self) -> None:
        self._box.clear()
        with self._box:
            self._forms = self._of_scene()

    def _filter(self) -> Any:
        opened = ui.expansion("The filter", value=self._is_open).props("dense").classes("w-full")
        opened.on_value_change(lambda event: setattr(self, "_is_open", event.value))
        return opened

    def _of_scene(self) -> list[Form]:
        scene = self._state.scene
        forms = [Form(scene, MAIN, self._take, grouped=False)]
        with ui.expansion("More of the scene").props("dense").classes("w-full"):
            forms.append(Form(scene, ((),), self._take, without=(*MAIN, *INNER), grouped=False))
            forms.append(Form(scene, INNER[:2], self._take, without=(KIND, *UNITS)))
        without = [*RECORDED_ONLY, (*FILTER, "sensor")]
        without += KNOWN if scene.filter_knows_target else ()
        without += [("tracking", "tracks")] if isinstance(scene.tracking.filter, RecurrentImages) else []
        with self._filter():
            forms.append(Form(scene, (FILTER, ("tracking",)), self._take, without=without))
        return forms

    def _take(self, scene: ImageScene) -> ImageScene:
        before, kept = self._state.scene, scene.settled
        self._state.scene = kept
        for form in self._forms:
            form.model = kept
        if _built_for(before) != _built_for(kept):
            self._build()
        return kept


def _built_for(scene: ImageScene) -> tuple[object, ...]:
    return scene.filter_knows_target, scene.tracking.filter.kind, scene.motion.motion.kind
