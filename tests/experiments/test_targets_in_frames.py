"""Trials of several targets: what a campaign keeps is what tracking the same scene writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from elusive.campaign import CampaignConfig, run_campaign
from elusive.experiments.targets_in_frames import SCENARIO, TargetsInFrames, trial
from elusive.systems.images.scene import track_image_scene
from elusive.systems.images.simulate import draw_images

SMALL = {"rows": 28, "columns": 32, "frames": 22, "appears": 2, "leaves": 20, "stagger": 1, "targets": 2}
SMALL |= {"layout": "crossing", "velocity_x": 0.7, "velocity_y": 0.3, "snr_db": 14.0}


def test_a_trial_keeps_the_scores_that_tracking_writes(tmp_path: Path) -> None:
    parameters = TargetsInFrames(**SMALL)
    found = trial(parameters, np.random.default_rng(3))
    seeds = np.random.default_rng(3)
    drawn = parameters.replace(seed=int(seeds.integers(2**31)))
    scene = drawn.replace(tracking=drawn.tracking.replace(seed=int(seeds.integers(2**31))))
    track_image_scene(scene, tmp_path / "out")
    written = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert found["mota"] == pytest.approx(written["confirmed"]["mota"])
    assert found["idf1"] == pytest.approx(written["confirmed"]["idf1"])
    assert np.mean(found["gospa"]) == pytest.approx(written["confirmed"]["gospa"])
    parts = found["localisation"] + found["missed"] + found["false"]
    np.testing.assert_allclose(parts, np.square(found["gospa"]))
    # a target that is missed costs half the cutoff's square
    truth = np.isfinite(draw_images(drawn).truth[..., 0]).sum(axis=1)
    assert (found["missed"] <= truth * parameters.cutoff_px**2 / 2 + 1e-9).all()
    assert found["found"] > 0.6


@pytest.mark.thorough
def test_a_campaign_over_layouts_and_filters(tmp_path: Path) -> None:
    configuration = CampaignConfig(
        scenario="targets",
        parameters={**SMALL, "frames": 12, "leaves": 10, "tracking": {"filter": {"particles": 200}}},
        grid={"layout": ["crossing", "parallel"]},
        trials=2,
        seed=4,
    )
    results = run_campaign(SCENARIO, configuration, tmp_path / "store.zarr").load()
    assert dict(results.sizes) == {"layout": 2, "trial": 2, "frame": 12}
    assert (results["gospa"] >= 0).all()
    assert np.isfinite(results["mota"]).all()
    values = results["gospa"].values
    assert (values[:, 0] != values[:, 1]).any()  # trials differ
