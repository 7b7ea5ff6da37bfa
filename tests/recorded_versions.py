"""Versions of recorded infrared, as other cameras, recorders and units would have given it.

``python -m tests.recorded_versions`` measures the rows of their table in docs/recordings.md, of some versions or all.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw
from scipy import ndimage

from tests import infrared
from tests.infrared import Sequence
from tests.recorded_table import DOCUMENT

FRAMES, BEFORE = 100, 50  # of each recording that are tracked; of them before its target comes, at most
LEAST_DUE = 10  # frames in which a target is due, without which it says nothing of what is shown

SHAKE_PX, SHAKE_FRAMES = 3.0, 17.0  # amplitude and period of a camera that sways
BAR_PX = 12  # of a border about the frame
RADIANCE = 1e-4  # a grey level in other units
SPOILT = 0.02  # share of the pixels


def _placed(sequence: Sequence, frames: np.ndarray, scale: float, shift: np.ndarray | float = 0.0) -> Sequence:
    """Return other frames, in which what was at ``p`` is at ``scale p + shift``; what is out of them has no label."""
    labels = scale * sequence.labels + shift
    rows, columns = frames.shape[1:]
    inside = ((labels >= 0) & (labels <= [columns - 1, rows - 1])).all(axis=1)
    return Sequence(frames, np.where(inside[:, None], labels, np.nan), scale * sequence.near_px)


def cropped(sequence: Sequence) -> Sequence:
    """Cut a third off each axis, such that most labels stay."""
    rows, columns = sequence.frames.shape[1:]
    high, wide = (2 * rows) // 3, (2 * columns) // 3
    x, y = np.nanmedian(sequence.labels, axis=0)
    left = int(np.clip(x - wide / 2, 0, columns - wide))
    top = int(np.clip(y - high / 2, 0, rows - high))
    frames = sequence.frames[:, top : top + high, left : left + wide]
    return _placed(sequence, frames, 1.0, -np.array([left, top]))


def halved(sequence: Sequence) -> Sequence:
    """Average 2 x 2 pixels; a label is no better than a pixel and a half."""
    n, rows, columns = sequence.frames.shape
    whole = sequence.frames[:, : rows // 2 * 2, : columns // 2 * 2].astype(float)
    frames = np.round(whole.reshape(n, rows // 2, 2, columns // 2, 2).mean(axis=(2, 4)))
    return _placed(sequence, frames, 0.5, -0.25)._replace(near_px=sequence.near_px / 2 + 1)


def magnified(sequence: Sequence) -> Sequence:
    """Read 1.5 times as many pixels a side, as a recorder does that scales its video."""
    rows, columns = sequence.frames.shape[1:]
    high, wide = (3 * rows) // 2, (3 * columns) // 2
    at = np.meshgrid((np.arange(high) + 0.5) / 1.5 - 0.5, (np.arange(wide) + 0.5) / 1.5 - 0.5, indexing="ij")
    frames = [ndimage.map_coordinates(frame.astype(float), at, order=3, mode="nearest") for frame in sequence.frames]
    return _placed(sequence, np.round(np.clip(frames, 0, 255)), 1.5, 0.25)


def every_second(sequence: Sequence) -> Sequence:
    """Leave out every other frame: everything goes twice as fast."""
    return sequence._replace(frames=sequence.frames[::2], labels=sequence.labels[::2])


def shaken(sequence: Sequence) -> Sequence:
    """Sway the camera by a sinusoid, and cut off what it does not see throughout."""
    edge = int(np.ceil(SHAKE_PX)) + 1
    frames, labels = [], sequence.labels.copy()
    for k, frame in enumerate(sequence.frames):
        turn = 2 * np.pi * k / SHAKE_FRAMES
        way = SHAKE_PX * np.array([np.sin(turn), np.cos(1.3 * turn)])
        moved = ndimage.shift(frame.astype(float), way[::-1], order=3, mode="nearest")
        frames.append(moved[edge:-edge, edge:-edge])
        labels[k] += way
    shifted = sequence._replace(labels=labels)
    return _placed(shifted, np.round(np.clip(frames, 0, 255)), 1.0, -edge)


def noisier(sequence: Sequence) -> Sequence:
    """Add as much noise again as a pixel has: what differs between it and its neighbours, in the first frame."""
    first = sequence.frames[0].astype(float)
    left = first - ndimage.median_filter(first, 5)
    deviation = max(1.4826 * float(np.median(np.abs(left - np.median(left)))), 1.0)
    noise = np.random.default_rng(14).normal(0.0, deviation, sequence.frames.shape)
    return sequence._replace(frames=np.clip(np.round(sequence.frames + noise), 0, 255))


def negative(sequence: Sequence) -> Sequence:
    """White for black."""
    return sequence._replace(frames=255 - sequence.frames)


def six_bits(sequence: Sequence) -> Sequence:
    """Keep 64 grey levels."""
    return sequence._replace(frames=sequence.frames // 4)


def radiance(sequence: Sequence) -> Sequence:
    """Floating point numbers, in units in which a grey level is little."""
    return sequence._replace(frames=(RADIANCE * sequence.frames + 1.0).astype(np.float64))


def bordered(sequence: Sequence) -> Sequence:
    """Lay a black border about the frame, as a recorder does that fills a format."""
    frames = np.pad(sequence.frames, ((0, 0), (BAR_PX, BAR_PX), (BAR_PX, BAR_PX)))
    return _placed(sequence, frames, 1.0, BAR_PX)


def captioned(sequence: Sequence) -> Sequence:
    """Write two lines into the frame: a name, and a clock that counts frames."""
    frames = []
    for k, frame in enumerate(sequence.frames):
        image = Image.fromarray(frame.astype(np.uint8))
        pen = ImageDraw.Draw(image)
        pen.text((6, 4), "CAM 1  WHITE HOT", fill=255)
        pen.text((6, frame.shape[0] - 16), f"12:04:{k // 25:02d}.{k % 25 * 4:02d}", fill=255)
        frames.append(np.array(image))
    return sequence._replace(frames=np.stack(frames))


def gappy(sequence: Sequence) -> Sequence:
    """Lose one pixel in fifty, each frame others."""
    missing = np.random.default_rng(3).random(sequence.frames.shape) < SPOILT
    return sequence._replace(frames=np.where(missing, np.nan, sequence.frames))


def snowy(sequence: Sequence) -> Sequence:
    """Make as many pixels white or black, as a disturbed transmission does."""
    rng = np.random.default_rng(4)
    spoilt = rng.random(sequence.frames.shape) < SPOILT
    return sequence._replace(frames=np.where(spoilt, rng.choice([0.0, 255.0], sequence.frames.shape), sequence.frames))


def flickering(sequence: Sequence) -> Sequence:
    """Draw gain and level of each frame anew."""
    rng, each = np.random.default_rng(5), (len(sequence.frames), 1, 1)
    gain, level = rng.normal(1.0, 0.1, each), rng.normal(0.0, 20.0, each)
    return sequence._replace(frames=np.clip(np.round(gain * sequence.frames + level), 0, 255))


def banded(sequence: Sequence) -> Sequence:
    """Add noise that a whole row shares, each frame anew."""
    rows = np.random.default_rng(6).normal(0.0, 3.0, (*sequence.frames.shape[:2], 1))
    return sequence._replace(frames=np.round(sequence.frames + rows))


def compressed(sequence: Sequence) -> Sequence:
    """Compress each frame by itself, as JPEG of quality 40."""
    frames = []
    for frame in sequence.frames:
        file = io.BytesIO()
        Image.fromarray(frame.astype(np.uint8)).save(file, "JPEG", quality=40)
        frames.append(np.array(Image.open(file)))
    return sequence._replace(frames=np.stack(frames))


def unchanged(sequence: Sequence) -> Sequence:
    """The recording itself."""
    return sequence


VERSIONS: dict[str, Callable[[Sequence], Sequence]] = {
    made.__name__.replace("_", " "): made
    for made in (
        unchanged, cropped, halved, magnified, every_second, shaken, noisier, negative, six_bits,
        radiance, bordered, captioned, gappy, snowy, flickering, banded, compressed,
    )
}  # fmt: skip


class Means(NamedTuple):
    """A version's scores over all recordings, as :class:`~tests.infrared.Score` has them."""

    followed: float
    shown: float
    others: float
    sure: float
    worst: str  # the recording followed least, and in what share


def measured(version: str) -> Means:
    """Track a part of every recording in a version, and score it."""
    scores = {}
    for name in (*infrared.SEQUENCES, *infrared.CLIPS):
        recording = infrared.read(name)
        start = max(0, int(np.flatnonzero(np.isfinite(recording.labels[:, 0]))[0]) - BEFORE)
        part = slice(start, start + FRAMES * (1 + (VERSIONS[version] is every_second)))
        recording = recording._replace(frames=recording.frames[part], labels=recording.labels[part])
        scores[name.removeprefix("IR_")] = infrared.score(VERSIONS[version](recording))
    least = min(scores, key=lambda name: scores[name].followed)
    return Means(
        float(np.mean([score.followed for score in scores.values()])),
        float(np.mean([score.shown for score in scores.values() if score.due >= LEAST_DUE])),
        float(np.mean([score.others for score in scores.values()])),
        float(np.mean([score.sure for score in scores.values()])),
        f"{least} {_short(scores[least].followed)}",
    )


def _short(number: float) -> str:
    return f"{number:.2f}".removeprefix("0")


def row(version: str, means: Means) -> str:
    """Write a version's row as it stands in the document."""
    return f"| {' | '.join([version, *map(_short, means[:-1]), means.worst])} |"


def documented(version: str) -> str:
    """The row that the document has; empty where there is none."""
    lines = DOCUMENT.read_text(encoding="utf-8").split("| version | followed |")[1].splitlines()
    return next((line for line in lines if line.startswith(f"| {version} |")), "")


if __name__ == "__main__":
    for asked in sys.argv[1:] or VERSIONS:
        print(row(asked, measured(asked)), flush=True)
