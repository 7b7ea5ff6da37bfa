"""Figure 3 of Mazurek (2013), 1000 cases of 80 iterations on two processes, against a minute."""

from __future__ import annotations

import pytest

from elusive.campaign import CampaignConfig, make_executor, run_campaign
from elusive.experiments.mazurek2013.trial import METHODS, SCENARIO

CASES, MINUTE = 1000, 60.0


@pytest.mark.parametrize(
    ("methods", "what"),
    [
        ([method for method in METHODS if method[0] == "dot"], "the paper's statistic, 6 windows"),
        (METHODS, "four statistics, 6 windows each"),
    ],
    ids=["dot", "all"],
)
def test_figure_3_within_a_minute(benchmark, report, tmp_path, methods, what):
    configuration = CampaignConfig(
        scenario="mazurek2013",
        parameters={"object_size": 3, "smoothings": [0.95], "methods": methods},
        trials=CASES,
    )

    def figure():
        with make_executor(2) as executor:
            return run_campaign(SCENARIO, configuration, tmp_path / "cases.zarr", executor=executor).load()

    results = benchmark.pedantic(figure, rounds=1)  # the processes' start counts as well
    assert results["done"].all()
    assert 0 < results["error"].mean() < 300
    report(f"figure 3 of mazurek2013, {what}, in a minute", MINUTE / benchmark.stats["mean"], 1)
