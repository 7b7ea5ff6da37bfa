"""What is set of the noise objects: a scene, and the filter; forms from the models' fields."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from nicegui import ui

from elusive.sensors.waveform import NoiseObjectPath
from elusive.systems.signals.scene import SignalScene
from elusive.workbench.form import Form
from elusive.workbench.parts import errors_shown
from elusive.workbench.runs import BenchState

SENSOR = ("sensor",)
MAIN = (
    *((*SENSOR, name) for name in ("object_deviation", "background_deviation", "object_size", "mode")),
    ("frames",), ("samples",),
)  # fmt: skip
MORE = ((*SENSOR, "border"), ("seed",))
FILTER = (("tracking",),)
SAME = (("tracking", "object_size"), ("tracking", "filter", "border"))  # as the scene's


class SignalInputs:
    """The inputs of one page."""

    def __init__(self, state: BenchState[SignalScene]) -> None:
        self._state = state
        self._forms: list[Form] = []
        self._box = ui.column().classes("w-full gap-2 ew-wide")
        self._build()

    def forms(self) -> Sequence[Form]:
        """Return the forms that count."""
        return self._forms

    def _build(self) -> None:
        self._box.clear()
        self._over_scene: list[Form] = []
        with self._box:
            self._forms = self._of_scene()

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
