"""What a camera writes into its frames now and then: a blinking mark, digits that change, a box that moves.

No source; an own test. What is written has one value, to the bit, and is sharp at the pixel, which optics let no part
of a scene be. That alone tells no target that is as sharp from it, nor a lamp that is cut off, of optics sharper than
the pixels, which is smaller. So it is known by what no target does: it is gone, and there again with the same value on
the same pixels; it has rested, and goes at once; several parts of one value rest; it is a thin straight line. What is
beside it and as sharp, with its value, is written, too, unless it moves on as it is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from elusive.preprocess import _drawn_kernels, _written_kernels, scales
from elusive.preprocess._scale_kernels import Image, Mask

STEP, MOSTLY = 4.0, 0.9  # times the step below which most are, between pixels and frames, that an outline has
SHARP, LEFT = 0.7, 0.2  # share of an outline that is sharp; share of its step left at the first pixel, at most
LEAST, LEAST_PX, FEW = 8, 5, 2  # pixels of a part, and along it, that tells; pixels from which it is remembered
SAME = 0.4  # share of its pixels that are there again: of digits most keep their value as they change
RESTED, AT_ONCE = 3, 0.8  # frames of one that goes at once; share of its pixels that do
NEAR_PX = 10  # about what is known, within which what has its value is of it
RESTS, SEVERAL = 8, 4  # frames; parts of one value that are text where they rest
LONG_PX, WIDE_PX, STRAIGHT = 10, 3, 0.5  # of lines; side of a square that is in none; share of a part in long ones
CHANCE = 0.01  # lines in a frame that may be so long because neighbours have one value
MEMORY = 300  # frames
BESIDE_PX = 2  # about what is written, and a pixel at each scale, in which nothing is seen
MOST = 400  # parts, of more of which nothing is told

Pixels = NDArray[np.int64]
Part = tuple[float, bytes]  # value and shape


class Written(NamedTuple):
    """What has been as sharp so far, pixel by pixel."""

    frames: int
    pixels: Pixels  # (n,) numbers in the frame, increasing
    values: NDArray[np.float32]  # (n,)
    kept: Pixels  # (n,) frames in a row in which each had its value; 0: it is gone
    latest: Pixels  # (n,) frame in which each had it last
    again: Mask  # (n,) that each was gone and is there again
    known: Mask  # (n,) that it is written
    parts: dict[Part, list[Pixels]]  # of the last frame
    now: Pixels  # pixels written into this frame
    hidden: Pixels  # and those that were until now


def _none() -> Pixels:
    return np.zeros(0, np.int64)


NOTHING = Written(
    0, _none(), np.zeros(0, np.float32), _none(), _none(), np.zeros(0, np.bool_), np.zeros(0, np.bool_), {}, _none(),
    _none(),
)  # fmt: skip


def written(state: Written, image: Image, last: Image | None) -> Written:
    """Return what is written into the frames up to a new one ``(rows, columns)``, as recorded; ``last`` is before."""
    steps = [np.abs(np.diff(image[::4], axis=1))[:, ::4]]
    if last is not None:
        steps.append(np.abs(image[::4, ::4] - last[::4, ::4]))
    bound = np.float32(STEP * max(scales.quantile_of(step, MOSTLY) for step in steps))
    parts = _sharp(state, image, bound) if bound > 0 else []
    frames = state.frames + 1
    if not parts and not len(state.pixels):
        return NOTHING._replace(frames=frames)
    flat = image.ravel()
    shapes = dict[Part, list[Pixels]]()
    for part in parts:
        shapes.setdefault(_shape(part, flat), []).append(part)
    gone = ~(np.abs(flat[state.pixels] - state.values) <= bound)
    state = state._replace(frames=frames, known=state.known | _went(state, gone, shapes, image.shape[1]))
    hidden = state.pixels[gone & state.known & (state.kept > 0)]
    over, others = list[Pixels](), list[Pixels]()
    text = _resting(state, parts, image)
    for shape, alike in shapes.items():
        for part in alike:
            is_written = int(part[0]) in text or _is_written(state, part, shape, image, alike)
            (over if is_written else others).append(part)
    now, sharp = _joined(over), _joined([*over, *(part for part in others if len(part) >= FEW)])
    return _remembered(state, gone, sharp, now, flat)._replace(parts=shapes, now=now, hidden=hidden)


def without_written(image: Image, state: Written) -> Image:
    """Return the frame with NaN where something is written."""
    if not len(state.now):
        return image
    whole = image.copy()
    whole.ravel()[state.now] = np.nan
    return whole


def hidden_of(state: Written, shape: tuple[int, int], count: int) -> list[Mask] | None:
    """Return at each of ``count`` scales where what is written hides the scene; None where nothing is."""
    pixels = np.concatenate([state.now, state.hidden])
    if not len(pixels):
        return None
    found = []
    for k in range(count):
        mask = np.zeros((-(-shape[0] // 2**k), -(-shape[1] // 2**k)), np.bool_)
        row, column = pixels // shape[1] >> k, pixels % shape[1] >> k
        reach = max(BESIDE_PX >> k, 1)
        for down in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                at = np.clip(row + down, 0, len(mask) - 1), np.clip(column + right, 0, mask.shape[1] - 1)
                mask[at] = True
        found.append(mask)
    return found


def _joined(parts: list[Pixels]) -> Pixels:
    return np.sort(np.concatenate(parts)) if parts else _none()


def _sharp(state: Written, image: Image, bound: np.float32) -> list[Pixels]:
    """Parts of one value, as sharp as optics are not, pixels of each increasing."""
    pixels, ends = _written_kernels.sharp_parts(image, bound, SHARP, np.float32(LEFT))
    large = np.diff(ends) >= FEW
    if np.count_nonzero(large) > MOST:
        return []
    # what is less may be of writing, as a point is, but tells nothing of it
    chosen = np.flatnonzero(large | np.isin(image.ravel()[pixels[ends[:-1]]], state.values[state.known]))
    return [np.sort(pixels[ends[k] : ends[k + 1]]) for k in chosen]


def _shape(part: Pixels, flat: Image) -> Part:
    return float(flat[part[0]]), (part - part[0]).tobytes()


def _went(state: Written, gone: Mask, shapes: dict[Part, list[Pixels]], columns: int) -> Mask:
    """Say which pixels are of parts that rested, and went at once, and are nowhere else now."""
    went = np.zeros(len(gone), np.bool_)
    if not (gone & (state.kept >= RESTED)).any():
        return went
    for shape, parts in state.parts.items():
        for part in parts if shape not in shapes else ():
            at = np.searchsorted(state.pixels, part)
            if _tells(part, columns) and (gone[at] & (state.kept[at] >= RESTED)).mean() >= AT_ONCE:
                went[at] = True
    return went


def _resting(state: Written, parts: list[Pixels], image: Image) -> set[int]:
    """Return the first pixels of parts that rest, and of whose value several others do: of text, of a reticle."""
    large = [part for part in parts if len(part) >= LEAST_PX]
    if len(large) < SEVERAL or not (state.kept >= RESTS).any():
        return set()
    starts = np.cumsum([0, *map(len, large[:-1])])
    rest = np.isin(np.concatenate(large), state.pixels[state.kept >= RESTS], assume_unique=True)
    resting = [large[k] for k in np.flatnonzero(np.logical_and.reduceat(rest, starts))]
    first = np.array([part[0] for part in resting if _extent(part, image.shape[1]) >= LEAST_PX], np.int64)
    _, which, counts = np.unique(image.ravel()[first], return_inverse=True, return_counts=True)
    return set(first[counts[which] >= SEVERAL].tolist())


def _extent(part: Pixels, columns: int) -> int:
    return 1 + max(int(np.ptp(at)) for at in np.divmod(part, columns))


def _tells(part: Pixels, columns: int) -> bool:
    return len(part) >= LEAST and _extent(part, columns) >= LEAST_PX


def _is_written(state: Written, part: Pixels, shape: Part, image: Image, alike: list[Pixels]) -> bool:
    """Say of a sharp part if it is known, there again, or a thin line; or beside what is known, and did not move."""
    if len(part) < LEAST and not state.known.any():
        return False
    rows, columns = np.divmod(part, image.shape[1])
    if _is_line(rows, columns, image):
        return True
    told = (state.known | state.again | (state.kept == 0)) & (state.values == shape[0])
    if not told.any() or _moved(state, part, shape, alike):
        return False
    if _tells(part, image.shape[1]) and np.isin(part, state.pixels[told], assume_unique=True).mean() >= SAME:
        return True
    y, x = np.divmod(state.pixels[told & state.known], image.shape[1])
    beside = (y >= rows[0] - NEAR_PX) & (y <= rows[-1] + NEAR_PX)
    beside &= (x >= columns.min() - NEAR_PX) & (x <= columns.max() + NEAR_PX)
    return bool(beside.any())


def _is_line(rows: Pixels, columns: Pixels, image: Image) -> bool:
    """Say if a part is thin, long, mostly straight along rows and columns, and none that an edge of the frame is."""
    extent = 1 + max(int(np.ptp(rows)), int(np.ptp(columns)))
    if extent < LONG_PX or extent < (least := max(LONG_PX, _by_chance(image))):
        return False
    box = np.zeros((np.ptp(rows) + 1, np.ptp(columns) + 1), np.uint8)
    box[rows - rows[0], columns - columns.min()] = 1
    ends = ((at.min(), size - 1 - at.max(), np.ptp(at)) for at, size in zip((rows, columns), image.shape, strict=True))
    if any(min(low, high) + extent < WIDE_PX for low, high, extent in ends):
        return False
    if min(box.shape) >= WIDE_PX and ndimage.binary_erosion(box, np.ones((WIDE_PX, WIDE_PX))).any():
        return False
    lines, _ = _drawn_kernels.long_lines(box, 1, least)
    return bool(np.count_nonzero(lines) >= STRAIGHT * len(rows))


def _by_chance(image: Image) -> int:
    """How long a line of one value must be, thin along a row or a column, that chance hardly makes one in a frame.

    Few neighbours have one value to the bit in what a camera takes, and many in what a coder has smoothed.
    """
    longest = 0.0
    for lines in (image, image.T):
        middle = lines[1:-1]
        thin = ((middle != lines[:-2]) & (middle != lines[2:]))[:, :-1]
        count = 1 + np.count_nonzero(thin)
        same = 0.5 + np.count_nonzero(thin & (middle[:, 1:] == middle[:, :-1]))
        longest = max(longest, 1 + math.log(count / CHANCE) / math.log(count / same))
    return math.ceil(longest)


def _moved(state: Written, part: Pixels, shape: Part, alike: list[Pixels]) -> bool:
    """Say if a part was elsewhere in the last frame, and is not there any more."""
    before, now = {int(one[0]) for one in state.parts.get(shape, ())}, {int(one[0]) for one in alike}
    return int(part[0]) not in before and bool(before - now)


def _remembered(state: Written, gone: Mask, sharp: Pixels, now: Pixels, flat: Image) -> Written:
    """Remember the pixels of sharp parts, and forget those that were not seen for long."""
    known = np.stack([state.values, np.where(gone, 0, state.kept), state.latest, state.again, state.known])
    stays = state.latest > state.frames - MEMORY
    pixels = np.union1d(state.pixels[stays], sharp)
    table = np.full((len(known), len(pixels)), np.nan)
    table[:, np.searchsorted(pixels, state.pixels[stays])] = known[:, stays]
    here = np.searchsorted(pixels, sharp)
    value, kept, _, again, written_before = table[:, here]
    same = value == flat[sharp]
    table[:, here] = (
        flat[sharp], np.where(same, kept, 0) + 1, np.full(len(here), state.frames),
        same & ((again > 0) | (kept == 0)), same & (written_before > 0),
    )  # fmt: skip
    table[4, np.searchsorted(pixels, now)] = 1
    return state._replace(
        pixels=pixels, values=table[0].astype(np.float32), kept=table[1].astype(np.int64),
        latest=table[2].astype(np.int64), again=table[3] > 0, known=table[4] > 0,
    )  # fmt: skip
