"""Which parts of frames a coder repeats while the scene goes on."""

from __future__ import annotations

import numpy as np

from elusive.preprocess.old_blocks import TILE, OldBlocks, old_blocks, within

ROWS, COLUMNS = 38, 50
AT_REST = np.zeros(2)


def frames(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Two frames, of which the second repeats a part."""
    last, image = rng.integers(10, 200, (2, ROWS, COLUMNS)).astype(np.float32)
    image[8:24, 12:32] = last[8:24, 12:32]
    return last, image


def slow(image: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Look at each tile's four squares, pixel by pixel."""
    rows, columns = (size // TILE for size in image.shape)
    low, high = np.nanmin(image), np.nanmax(image)

    def alike(j: int, i: int) -> bool:
        part = slice(TILE * j, TILE * j + TILE), slice(TILE * i, TILE * i + TILE)
        inside = 0 <= j < rows and 0 <= i < columns
        return bool(inside and (image[part] == last[part]).all() and low < image[part][0, 0] < high)

    steps = (-1, 0), (0, 1)
    squares = [[(b, a) for b in down for a in right] for down in steps for right in steps]
    return np.array(
        [
            [any(all(alike(j + b, i + a) for b, a in square) for square in squares) for i in range(columns)]
            for j in range(rows)
        ]
    )


def test_repeated_tiles_are_old_once_the_scene_has_gone_on() -> None:
    last, image = frames(np.random.default_rng(0))
    begun = old_blocks(None, last, None, AT_REST)
    found = old_blocks(begun, image, last, np.array([0.0, -0.4]))
    np.testing.assert_array_equal(found.tiles, slow(image, last))
    assert np.count_nonzero(found.tiles) == 4 * 5
    places = np.array([[13.0, 9.0], [11.0, 9.0], [-1.0, 60.0], [15.0, 17.0], [15.0, 17.0]])
    np.testing.assert_array_equal(
        within(found.tiles, places, np.array([1.0, 1.0, 1.0, 1.0, 4.0])), [True, False, False, True, False]
    )
    assert not old_blocks(begun, image, last, np.array([0.2, -0.2])).tiles.any()


def test_how_far_the_scene_has_gone_is_counted_from_when_a_tile_was_new() -> None:
    last, image = frames(np.random.default_rng(1))
    state, old = old_blocks(None, last, None, AT_REST), []
    for k in range(1, 5):
        state = old_blocks(state, image, last if k == 1 else image, np.array([0.1 * k, 0.0]))
        old.append(int(np.count_nonzero(state.tiles)))
    # of the tiles that kept their values from the first frame, and of those that did so from the second
    assert old == [0, 0, 0, 20]


def test_what_is_drawn_or_cut_off_is_not_repeated() -> None:
    last, image = frames(np.random.default_rng(2))
    begun, gone = (
        OldBlocks(
            np.zeros((ROWS // TILE, COLUMNS // TILE), bool), np.zeros((ROWS // TILE, COLUMNS // TILE, 2), np.float32)
        ),
        np.ones(2),
    )
    drawn = image.copy()
    drawn[8:24, 12:32] = np.nan
    assert not old_blocks(begun, drawn, last, gone).tiles.any()
    for level in (0.0, 255.0):
        last[8:24, 12:32] = image[8:24, 12:32] = level
        assert not old_blocks(begun, image, last, gone).tiles.any()
