"""What is set of the images: a scenario or a recording, and the filter; forms from the models' fields."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from nicegui import ui

from elusive.filters.particle.recorded import RecordedFrames
from elusive.io import Truth
from elusive.systems.images.page.recording import KINDS, TRUTHS, Recorded, read_frames, read_places
from elusive.systems.images.page.state import ImagesState
from elusive.systems.images.peaks import PeakImages
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.scene import ImageScene
from elusive.systems.images.track import ImageTracking
from elusive.workbench.form import Form
from elusive.workbench.opener import opener

KIND = ("motion", "motion", "kind")
MAIN = (("snr_db",), ("targets",), KIND, ("appears",), ("leaves",), ("frames",))
UNITS = (("sensor", "dx"), ("sensor", "dy"))  # pixels
INNER = (("motion",), ("sensor",), ("tracking",))
FILTER = ("tracking", "filter")
RECORDED_ONLY = tuple(("tracking", name) for name in ("background", "jitter_px", "clump_px"))
KNOWN = tuple(
    (*FILTER, *path) for path in (("motion",), ("birth", "snr_db"), ("birth", "snr_db_range"), ("target_snr_db",))
)
SOURCES = {"scene": "Make a scenario", "file": "Open frames"}
OPEN_MAIN = (
    ("filter", "kind"),
    ("show",),
    ("filter", "birth", "snr_db"),
    ("filter", "particles"),
    ("filter", "target_snr_db"),
)


class ImageInputs:
    """The inputs of one page."""

    def __init__(self, state: ImagesState) -> None:
        self._state = state
        self._forms: list[Form] = []
        self._is_open = False  # the filter's fields
        choice = ui.radio(SOURCES, value="file" if state.records else "scene", on_change=self._choose)
        choice.props('inline dense aria-label="Where the frames come from"')
        self._box = ui.column().classes("w-full gap-2 ew-wide")
        self._build()

    def forms(self) -> Sequence[Form]:
        """Return the forms that count."""
        return self._forms

    def _choose(self, event: Any) -> None:
        self._state.records = event.value == "file"
        self._build()

    def _build(self) -> None:
        self._box.clear()
        with self._box:
            self._forms = self._of_recording() if self._state.records else self._of_scene()

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

    def _of_recording(self) -> list[Form]:
        state = self._state
        opener("frames", KINDS, read_frames, self._opened, folders=True)
        if state.recorded is not None:
            count, rows, columns = state.recorded.frames.shape
            ui.label(f"{state.name}: {count} frames of {columns} x {rows} pixels").props('role="status"')
            for remark in state.recorded.remarks:
                ui.label(remark).classes("ew-fault").props('role="alert"')
        with ui.expansion("Where it truly was").props("dense").classes("w-full"):
            opener("truth", TRUTHS, read_places, self._told_truth)
        if state.truth is not None:
            ui.label(f"{state.truth_name}: targets: {len(state.truth.paths)}")
        idle = self._idle
        forms = [Form(state.tracking, OPEN_MAIN, self._track, without=idle, grouped=False)]
        without = [*OPEN_MAIN, *idle]
        with self._filter():
            forms.append(Form(state.tracking, ((),), self._track, without=without))
        return forms

    @property
    def _idle(self) -> list[tuple[str, ...]]:
        """What has no meaning for the filter that is chosen."""
        flt = self._state.tracking.filter
        if isinstance(flt, PeakImages):
            return [(name,) for name in (*RecordedFrames.model_fields, "pedestal", "polarity")]
        several = ("tracks", "jitter_px", "clump_px") if isinstance(flt, RecurrentImages) else ()
        return [(name,) for name in ("show", *several)]

    def _track(self, tracking: ImageTracking) -> ImageTracking:
        before, self._state.tracking = self._state.tracking, tracking
        for form in self._forms:
            form.model = tracking
        if before.filter.kind != tracking.filter.kind:
            self._build()
        return tracking

    def _opened(self, name: str, recorded: Recorded) -> None:
        self._state.name, self._state.recorded = name, recorded
        self._state.truth = None
        self._build()

    def _told_truth(self, name: str, truth: Truth) -> None:
        self._state.truth_name, self._state.truth = name, truth
        self._build()


def _built_for(scene: ImageScene) -> tuple[object, ...]:
    return scene.filter_knows_target, scene.tracking.filter.kind, scene.motion.motion.kind
