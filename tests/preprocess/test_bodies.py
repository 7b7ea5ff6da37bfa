"""What is connected about a point of a frame, against what was drawn."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.bodies import body_about

ROWS, COLUMNS = 120, 160


def drawn(seed: int, *boxes: tuple[int, int, int, int, float]) -> np.ndarray:
    """Noise of deviation 2 about 100, and boxes: left, top, width, height, contrast."""
    frame = np.random.default_rng(seed).normal(100.0, 2.0, (ROWS, COLUMNS))
    for left, top, width, height, contrast in boxes:
        frame[top : top + height, left : left + width] += contrast
    return frame.astype(np.float32)


@pytest.mark.parametrize("bright", [True, False])
@pytest.mark.parametrize("point", [(62.0, 52.0), (78.0, 58.0)])
def test_a_body_of_parts_is_one_from_each_of_them(point: tuple[float, float], bright: bool) -> None:
    sign = 1.0 if bright else -1.0
    # two hot ends, and a cooler bar between them
    frame = drawn(1, (60, 50, 6, 6, 90 * sign), (75, 55, 6, 6, 90 * sign), (66, 53, 9, 3, 40 * sign))
    found = body_about(frame, np.array(point), bright)
    assert found is not None
    assert found.extent_px == 21
    row, column = np.nonzero(np.abs(frame - 100) > 20)
    np.testing.assert_allclose(found.centre_px, [column.mean(), row.mean()], atol=0.01)
    assert body_about(frame, np.array(point), not bright) is None


def test_what_is_apart_or_cut_off_or_everywhere_is_no_body() -> None:
    two = drawn(2, (40, 50, 3, 3, 60), (70, 50, 3, 3, 60))
    found = body_about(two, np.array([41.0, 51.0]), True)
    assert found is not None
    assert found.extent_px == 3
    np.testing.assert_allclose(found.centre_px, [41, 51], atol=0.01)
    assert body_about(drawn(3, (0, 50, 20, 20, 60)), np.array([8.0, 60.0]), True) is None  # comes into the picture
    assert body_about(drawn(4, (0, 60, 160, 60, 60)), np.array([80.0, 70.0]), True) is None  # ground
    assert body_about(two, np.array([-3.0, 51.0]), True) is None
    assert body_about(np.full((60, 60), np.nan, np.float32), np.array([30.0, 30.0]), True) is None
