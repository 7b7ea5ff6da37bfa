"""What a camera or a recorder lays over the scene, whichever way it is known, and the frame without it."""

from __future__ import annotations

from typing import NamedTuple

from elusive.contracts import Array
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.drawn import Drawn, drawn, without_drawn
from elusive.preprocess.impulses import without_impulses
from elusive.preprocess.overlaid import Overlaid, overlaid, without_overlaid
from elusive.preprocess.written import NOTHING, Written, without_written, written


class Overlays(NamedTuple):
    """What is laid over the frames so far."""

    drawn: Drawn | None = None  # keeps its value while the scene changes
    written: Written = NOTHING  # has one value, and comes and goes
    overlaid: Overlaid | None = None  # stays on the sensor while the scene goes by

    @property
    def last(self) -> Image | None:
        """The last frame, as recorded; None before any."""
        return None if self.drawn is None else self.drawn.last


def laid_over(state: Overlays, image: Image, scene_px: Array, step_px: Array, *, cut: bool) -> tuple[Overlays, Image]:
    """Return what is laid over the frames up to a new one, and that one with NaN where something is.

    Parameters
    ----------
    image
        ``(rows, columns)``, as recorded.
    scene_px, step_px
        ``(2,)`` x, y: where the scene was in the last frame, and how far it had come from the one before.
    cut
        Whether that frame began another scene.
    """
    last, lies = state.last, state.overlaid
    if last is not None:
        lies = overlaid(None if cut else lies, last, scene_px)
    over, marks = drawn(state.drawn, image), written(state.written, image, last)
    known = without_drawn(without_impulses(image, last, step_px), over.mask)
    return Overlays(over, marks, lies), without_overlaid(without_written(known, marks), lies)
