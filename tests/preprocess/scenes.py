"""Synthetic recordings whose shift, noise, target and defects are known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import ndimage


class Scene(NamedTuple):
    frames: np.ndarray  # (n, rows, columns)
    offsets: np.ndarray  # (n, 2) x, y of the scene against the first frame
    target: np.ndarray  # (n, 2) x, y in the frame


def recording(
    n: int = 30,
    shape: tuple[int, int] = (80, 110),
    camera: tuple[float, float] = (0.63, -0.37),
    speed: tuple[float, float] = (1.5, 0.6),
    height: float = 0.0,
    noise: float = 2.0,
    defect: tuple[int, int] | None = None,
    seed: int = 0,
) -> Scene:
    """A textured scene that drifts, a Gaussian target of deviation 1 that moves against it, a hot pixel (x, y)."""
    rng = np.random.default_rng(seed)
    pad = 60
    texture = 40 * ndimage.gaussian_filter(rng.standard_normal((shape[0] + 2 * pad, shape[1] + 2 * pad)), 2.5) * 9
    offsets = np.arange(n)[:, None] * np.array(camera)
    target = np.array([30.0, 40.0]) + offsets + np.arange(n)[:, None] * np.array(speed)
    y, x = np.mgrid[: shape[0], : shape[1]].astype(float)
    frames = []
    for offset, (tx, ty) in zip(offsets, target, strict=True):
        view = ndimage.map_coordinates(texture, [y - offset[1] + pad, x - offset[0] + pad], order=3)
        view += height * np.exp(-((x - tx) ** 2 + (y - ty) ** 2) / 2)
        view += noise * rng.standard_normal(shape)
        if defect is not None:
            view[defect[1], defect[0]] = 400.0
        frames.append(view)
    return Scene(np.array(frames), offsets, target)
