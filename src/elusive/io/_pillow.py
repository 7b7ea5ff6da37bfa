"""Images by Pillow: opened as a named format, their pixels at the depth they are stored in."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from PIL import Image


def open_pillow(file: Any, formats: tuple[str, ...]) -> Image.Image:
    """Open an image of one of the formats; a decompression bomb raises, small or large."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        return Image.open(file, formats=formats)


def pixels(image: Image.Image) -> np.ndarray[Any, Any]:
    """Return the pixels, ``(rows, cols)`` or ``(rows, cols, 3 or 4)``, at the depth they are stored in."""
    if image.mode in ("LA", "La"):
        image = image.getchannel(0)
    elif image.mode in ("P", "PA"):
        image = image.convert("RGBA")
    elif image.mode not in ("1", "L", "I", "F", "RGB", "RGBA") and not image.mode.startswith("I;16"):
        image = image.convert("RGB")
    return np.array(image)
