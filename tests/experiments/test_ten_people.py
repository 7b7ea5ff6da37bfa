"""People whose paths cross: straight on the links, and by way of an image, on the same runs of the campaign."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.campaign import CampaignConfig, run_campaign
from elusive.experiments.mendieta2017.trial import SCENARIO


def scores(method, store, trials, **walks):
    """Errors (misses, false positives, mismatches) and targets of each run, all tracks counted."""
    configuration = CampaignConfig(
        scenario="mendieta2017", parameters={"method": method}, trials=trials, seed=2017,
        grid={f"simulation.walks.{name}": [value] for name, value in walks.items()},
    )  # fmt: skip
    runs = run_campaign(SCENARIO, configuration, store).load().squeeze()
    errors = [runs[name].sel(shown=0).values for name in ("misses", "false_positives", "mismatches")]
    return np.sum(errors, axis=0), runs["targets"].values


def compared(folder, trials, **walks):
    """Pooled MOTA (eq. 4.4) of the links and of the image, and the standard error of the difference."""
    (links, there), (image, same) = (
        scores(method, folder / f"{method}.zarr", trials, **walks) for method in ("links", "image")
    )
    np.testing.assert_array_equal(there, same)  # the same runs
    better = (image - links) * trials / there.sum()
    return 1 - links.sum() / there.sum(), 1 - image.sum() / there.sum(), better.std(ddof=1) / np.sqrt(trials)


@pytest.mark.validate
def test_five_people_for_a_while(tmp_path):
    links, image, _ = compared(tmp_path, 2, users=5, total_positions=30, latest_entrance=5)
    assert links >= 0.98
    assert image >= 0.9
    assert links > image


@pytest.mark.validate
def test_ten_people_cross(tmp_path):
    links, image, error = compared(tmp_path, 20, users=10)
    assert image >= 0.965
    assert links >= 0.99
    assert links - image > 2 * error
