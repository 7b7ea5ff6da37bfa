"""A pattern that stays on the sensor while the scene goes by: offsets of pixels that no calibration has taken away.

A frame is predicted in two ways, by the scene alone and by the scene and what has been in each pixel's own place
(Scribner et al., 1991, Proc. SPIE 1541, 100-109, take that away); what has predicted better is believed (Dawid, 1984).
In a small frame a scene alone is held where the pattern is, and all that rests in it seems to move.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from elusive.contracts import Array
from elusive.preprocess import _past_kernels, scales
from elusive.preprocess._scale_kernels import Image
from elusive.preprocess.peak_maps import in_time
from elusive.preprocess.robust import MAD
from elusive.preprocess.scene import ALIKE, BORDER, Past, Scene, past_of, registered

MOST = 5.0  # deviations of the pattern that a pixel's own is at most: what the camera follows stays where it is, too
SAMPLES = 64  # rows and columns that tell that deviation, about
GONE_BY = 1.0  # deviation of the scene's place on the sensor, from which the two are told apart [px of the map]
PARTS, LEAST = 6, 20.0  # of either side, in which predictions are compared; pixels of one
SPARED = 0.4  # of the parts, in which two layers of the scene may meet: those that speak for a pattern most
FADES, CLIP, SPREAD = 0.9, 9.0, 2.0  # left of errors a frame later; most of a square; deviation of clipped ones
BELIEVED = 6.0  # deviations from which a pattern is believed, and is no more
SEEN = 3  # frames of a place before its prediction counts


class Pattern(NamedTuple):
    """What the frames so far say of a pattern, and where the scene would be if that were otherwise."""

    frames: int
    means: tuple[Image, ...]  # of each scale's map, in its place on the sensor
    taken: bool  # away from the maps: it is believed
    turned: bool  # by the last frame
    pasts: tuple[Past, ...]  # of the maps as they are not taken, fine and coarse; of the fine one with its pattern
    offset_px: Array  # (2,) x, y: where the scene is by the maps as they are not taken
    step_px: Array  # (2,) less the last frame's
    usual_px: Array  # (2,) place of late of the scene over the pattern
    spread: float  # mean square of its distance from there [px^2]
    costs: Array  # (3, parts, 2) sums of squared errors, and pixels: of the scene alone, with a pattern, without it

    def taken_from(self, image: Image, k: int) -> Image:
        """Return the map of scale k, as recorded, without the pattern."""
        mean = self.means[k]
        few = mean[tuple(slice(None, None, -(-size // SAMPLES)) for size in mean.shape)]
        bound = np.float32(MOST * MAD * float(np.median(np.abs(few))))
        return np.asarray(image - np.clip(mean, -bound, bound))

    def maps_of(self, maps: list[Image]) -> list[Image]:
        """Return maps as they are taken."""
        return [self.taken_from(image, k) for k, image in enumerate(maps)] if self.taken else maps

    def other_of(self, maps: list[Image], two: tuple[int, int]) -> list[Image]:
        """Return two of the maps as they are not taken."""
        return [maps[k] if self.taken else self.taken_from(maps[k], k) for k in two]

    def restarted(self, maps: list[Image], two: tuple[int, int], offset_px: Array) -> Pattern:
        """Return it where the maps that are taken, or the scene, are others from this frame on."""
        here = [offset_px / 2.0**k for k in (*two, two[0])]
        pasts = tuple(past_of(*pair) for pair in zip((*self.other_of(maps, two), maps[two[0]]), here, strict=True))
        return self._replace(turned=False, pasts=pasts, offset_px=offset_px, step_px=np.zeros(2))


def begun(scene: Scene) -> Pattern:
    """Return what a first frame shows, whose maps are as recorded."""
    fine, coarse = (scene.maps[k] for k in scene.chosen())
    pasts, nowhere = tuple(past_of(one) for one in (fine, coarse, fine)), np.zeros(2)
    return Pattern(
        1, tuple(scene.maps), False, False, pasts, nowhere, nowhere, nowhere, 0.0, np.zeros((3, PARTS * PARTS, 2))
    )


def pattern_after(
    state: Pattern | None, scene: Scene, maps: list[Image], offset_px: Array, memory: int, *, cut: bool
) -> Pattern | None:
    """Return what is known after one more frame, of small frames.

    Parameters
    ----------
    scene
        Of the maps as the state takes them, and what was learnt of them.
    maps
        As recorded.
    offset_px
        ``(2,)`` of the scene.
    memory
        Frames that are averaged.
    cut
        Whether the frame begins another scene.
    """
    if state is None:
        # what a large frame is laid over its past by are coarser maps, in which a pixel's own counts little
        return begun(scene) if scene.chosen()[0] == 0 else None
    if cut or state.turned:
        return state.restarted(maps, scene.chosen(), offset_px)
    two = scene.chosen()
    other = state.other_of(maps, two)
    fine, gain = two[0], np.float32(1 / min(state.frames + 1, memory))
    floors, levels = scene.floors[[*two, fine]], (*two, fine)
    beside = Scene([*other, maps[fine]], list(state.pasts), floors, levels)
    offset = registered(beside, (0, 1), state.offset_px, state.step_px)
    alone, moving = (offset, offset_px) if state.taken else (offset_px, offset)
    by_two, by_one = (scene.pasts[fine], state.pasts[0])[:: 1 if state.taken else -1]
    usual = state.usual_px + gain * (moving - state.usual_px)
    spread = float((1 - gain) * (state.spread + gain * ((moving - state.usual_px) ** 2).sum()))
    costs = state.costs
    if spread > (GONE_BY * 2.0**fine) ** 2:
        white = scene.maps[fine] if state.taken else other[0]
        costs = FADES * costs + _costs(
            [
                _errors(maps[fine], by_one, alone / 2.0**fine),
                _errors(white, by_two, moving / 2.0**fine),
                _errors(maps[fine], state.pasts[2], moving / 2.0**fine),
            ],
            float(scene.floors[fine]),
        )
    better = _better(costs)
    taken = better > (-BELIEVED if state.taken else BELIEVED)
    pasts = in_time(beside._replace(maps=beside.maps[:2], pasts=beside.pasts[:2]), offset, memory)[1]
    last = Scene(beside.maps[2:], list(state.pasts[2:]), floors[2:], levels[2:])
    pasts = (*pasts, *in_time(last, moving, memory)[1])
    means = tuple(mean + gain * (image - mean) for mean, image in zip(state.means, maps, strict=True))
    turned = taken != state.taken
    step = offset - state.offset_px
    return Pattern(state.frames + 1, means, taken, turned, pasts, offset, step, usual, spread, costs)


def _costs(errors: list[tuple[Image, NDArray[np.int64]]], floor: float) -> Array:
    """Sum squared errors and pixels of each prediction in each part."""
    scale = min(
        ((np.sqrt(np.abs(error)).mean() / scales.MEAN_ROOT) ** 2 for error, _ in errors if len(error)), default=1.0
    )
    found = np.zeros((len(errors), PARTS * PARTS, 2))
    for sums, (error, part) in zip(found, errors, strict=True):
        squared = np.minimum((error / max(float(scale), floor)) ** 2, CLIP)
        sums[:, 0] = np.bincount(part, squared, len(sums))
        sums[:, 1] = np.bincount(part, minlength=len(sums))
    return found


def _errors(image: Image, past: Past, here: Array) -> tuple[Image, NDArray[np.int64]]:
    """Errors of a prediction: read between the past's pixels, not the image's, whose noise that would lessen; parts."""
    whole = np.round(here).astype(np.int64)
    part, roll = here - whole, whole - past.whole
    error = _past_kernels.deviate(past.mean, image, np.ones(image.shape, np.uint8), -part, -roll)
    edge = BORDER + 1
    inner = slice(edge, -edge), slice(edge, -edge)
    row, column = (at + edge for at in np.nonzero((past.seen[inner] >= SEEN) & (error[inner] != 0)))
    down, across = (
        np.clip(at * PARTS // size, 0, PARTS - 1)
        for at, size in zip((row + roll[1], column + roll[0]), image.shape, strict=True)
    )
    return error[row, column], PARTS * down + across


def _better(costs: Array) -> float:
    """By how much a pattern predicts better than the best scene alone of each part, in deviations of chance."""
    pixels = costs[:, :, 1].min(axis=0)
    seen = pixels > LEAST
    if not seen.any():
        return 0.0
    alone, patterned, gone = costs[:, seen, 0] / costs[:, seen, 1]
    gain = pixels[seen] * (np.minimum(alone, gone) - patterned)
    kept = np.argsort(gain)[: len(gain) - int(SPARED * len(gain))]
    return float(gain[kept].sum() / (SPREAD * np.sqrt(ALIKE * pixels[seen][kept].sum())))
