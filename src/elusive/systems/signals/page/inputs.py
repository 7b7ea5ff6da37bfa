"""What is set of the noise objects: a scene or a recording, and the filter; forms from the models' fields."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from nicegui import ui

from elusive.io import Truth, read_truth
from elusive.sensors.waveform import NoiseObjectPath
from elusive.systems.signals.page.recording import KINDS, TRUTHS, Recorded
from elusive.systems.signals.page.state import Cutting, SignalsState
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.scene import SignalScene
from elusive.workbench.form import Form
from elusive.workbench.opener import opener
from elusive.workbench.parts import errors_shown

SENSOR = ("sensor",)
MAIN = (
    *((*SENSOR, name) for name in ("object_deviation", "background_deviation", "object_size", "mode")),
    ("frames",), ("samples",),
)  # fmt: skip
MORE = ((*SENSOR, "border"), ("seed",))
FILTER = (("tracking",),)
SAME = (("tracking", "object_size"), ("tracking", "filter", "border"))  # as the scene's
SOURCES = {"scene": "Make a scene", "file": "Open a signal"}
OPEN_MAIN = (("object_size",), ("calibration_frames",), ("filter", "smoothing"), ("filter", "max_velocity"))


class SignalInputs:
    """The inputs of one page."""

    def __init__(self, state: SignalsState) -> None:
        self._state = state
        self._forms: list[Form] = []
        choice = ui.radio(SOURCES, value="file" if state.records else "scene", on_change=self._choose)
        choice.props('inline dense aria-label="Where the signal comes from"')
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
        self._over_scene: list[Form] = []
        with self._box:
            self._forms = self._of_recording() if self._state.records else self._of_scene()

    def _of_scene(self) -> list[Form]:
        scene = self._state.scene
        self._over_scene = [Form(scene, MAIN, self._take, grouped=False)]
        paths = []
        for number, path in enumerate(scene.objects):
            with ui.element("div").classes("ew-row w-full"):
                ui.label(f"Object {number + 1}").classes("ew-section grow")
                ui.button("Remove", on_click=partial(self._remove, number)).props(
                    f'flat dense no-caps aria-label="Remove object {number + 1}"'
                )
            paths.append(Form(path, ((),), partial(self._move, number), grouped=False))
        ui.button("Add an object", on_click=self._add).props("outline no-caps")
        with ui.expansion("More of the scene").props("dense").classes("w-full"):
            self._over_scene.append(Form(scene, MORE, self._take, grouped=False))
        with ui.expansion("The filter").props("dense").classes("w-full"):
            self._over_scene.append(Form(scene, FILTER, self._take, without=SAME))
        return [*self._over_scene, *paths]

    def _take(self, scene: SignalScene) -> SignalScene:
        before, kept = self._state.scene, scene.settled
        self._state.scene = kept
        for form in self._over_scene:
            form.model = kept
        size = kept.sensor.object_size
        if before.tracking.statistic.kind != kept.tracking.statistic.kind or before.sensor.object_size != size:
            self._over_scene[-1].show(kept)  # what follows from the object's size has changed with it
        return kept

    def _move(self, number: int, path: NoiseObjectPath) -> None:
        objects = [*self._state.scene.objects]
        objects[number] = path
        self._take(self._state.scene.replace(objects=tuple(objects)))

    def _add(self) -> None:
        scene = self._state.scene
        with errors_shown():
            path = NoiseObjectPath(start=(float(scene.samples // 2),), velocity=(-1.0,), appears=scene.frames // 8)
            self._take(scene.replace(objects=(*scene.objects, path)))
        self._build()

    def _remove(self, number: int) -> None:
        objects = self._state.scene.objects
        self._take(self._state.scene.replace(objects=(*objects[:number], *objects[number + 1 :])))
        self._build()

    def _of_recording(self) -> list[Form]:
        state = self._state
        forms = [Form(state.cutting, ((),), self._cut, grouped=False)]
        opener("a signal", KINDS, lambda path: self._state.cutting.read(path), self._opened)
        if state.recorded is not None:
            count, samples = state.recorded.frames.shape
            ui.label(f"{state.name}: {count} frames of {samples} samples").props('role="status"')
        with ui.expansion("Where objects truly were").props("dense").classes("w-full"):
            opener("truth", TRUTHS, partial(read_truth, unit="samples"), self._told_truth)
        if state.truth is not None:
            ui.label(f"{state.truth_name}: objects: {len(state.truth.paths)}")
        tracked = [Form(state.tracking, OPEN_MAIN, self._track, grouped=False)]
        with ui.expansion("The filter").props("dense").classes("w-full"):
            tracked.append(Form(state.tracking, ((),), self._track, without=OPEN_MAIN))
        self._over_tracking = tracked
        return [*forms, *tracked]

    def _cut(self, cutting: Cutting) -> None:
        self._state.cutting = cutting

    def _track(self, tracking: SignalTracking) -> SignalTracking:
        self._state.tracking = tracking
        for form in self._over_tracking:
            form.model = tracking
        return tracking

    def _opened(self, name: str, recorded: Recorded) -> None:
        state = self._state
        state.name, state.recorded, state.recorded_by = name, recorded, state.cutting.options
        state.truth = None
        self._build()

    def _told_truth(self, name: str, truth: Truth) -> None:
        self._state.truth_name, self._state.truth = name, truth
        self._build()
