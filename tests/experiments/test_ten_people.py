"""Ten people whose paths cross: straight on the links, and by way of an image, on the same twenty runs."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.experiments.mendieta2017.scenario import FIRST
from elusive.experiments.mendieta2017.trial import ChapterFour, trial

CROWD = FIRST.replace(walks=FIRST.walks.replace(users=10))


def mota(method, run):
    rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(run,)))
    return trial(ChapterFour(simulation=CROWD, method=method), rng)["mota"][0]


@pytest.mark.validate
def test_straight_on_the_links_is_better_than_any_image():
    links, image = (np.array([mota(method, run) for run in range(20)]) for method in ("links", "image"))
    assert links.mean() >= 0.99
    assert image.mean() >= 0.965
    better = links - image
    assert better.mean() > 2 * better.std() / np.sqrt(20)
