"""A scene of bearings: the command's numbers are the page's; what cannot be flown is refused; the bound is right."""

from __future__ import annotations

import numpy as np
import pytest

from elusive.cli import main
from elusive.errors import DataError, ParameterError
from elusive.systems.bearings.choices import Interacting
from elusive.systems.bearings.results import nees
from elusive.systems.bearings.scene import BearingScene, bounds_of, locate_still, track_bearing_scene


def with_simulation(scene, **changes):
    return scene.replace(simulation=scene.simulation.replace(**changes))


@pytest.mark.validate
def test_the_command_finds_the_numbers_of_the_page(tmp_path, capsys):
    scene = BearingScene(estimators=("map", "fg-ekf"))
    flown = track_bearing_scene(scene)
    file, out = tmp_path / "scene.yaml", tmp_path / "out"
    file.write_text(scene.to_yaml())
    with pytest.raises(SystemExit) as stop:
        main(["scene", str(file), "--out", str(out)])
    assert stop.value.code in (0, None)
    assert {path.name for path in out.iterdir()} == {
        "bearings.csv", "sensors.csv", "truth.csv", "scene.yaml", "map", "fg-ekf",
    }  # fmt: skip
    assert BearingScene.from_yaml(out / "scene.yaml") == scene
    for used in flown.each:
        assert (out / used.name / "tracks.csv").read_text() == used.outcome.log.csv_text()
    assert f"{flown.each[0].rmse:.2f} m RMSE" in capsys.readouterr().out


def test_what_cannot_be_flown_is_refused():
    scene = BearingScene()
    with pytest.raises(DataError, match="sensors: there is none; place one or more"):
        track_bearing_scene(with_simulation(scene, sites=()))
    with pytest.raises(DataError, match="path: is 1 m long, less than two steps of 4 m; draw a longer one"):
        with_simulation(scene, ways_m=(((0.0, 0.0), (1.0, 0.0)),)).simulation.flight()
    with pytest.raises(DataError, match="path: is 0 m long"):
        with_simulation(scene, ways_m=((),)).simulation.flight()
    with pytest.raises(ParameterError, match=r"BearingSimulation\.interval_s: the path takes .* steps, more than 2000"):
        with_simulation(scene, interval_s=1e-3)
    with pytest.raises(DataError, match="all are taken at one place"):
        locate_still(with_simulation(scene, sites=scene.simulation.sites[:1]))


@pytest.mark.parametrize(
    ("given", "name"),
    [({"tracking": {"emitters": {"kind": "several"}}}, "tracking.emitters"),
     ({"simulation": {"labelled": True}}, "simulation.labelled")],
)  # fmt: skip
def test_a_scene_is_of_one_emitter(given, name):
    with pytest.raises(ParameterError, match=rf"BearingScene\.{name}: has no meaning in a scene"):
        BearingScene(**given)


def test_an_estimator_that_refuses_leaves_the_others():
    scene = BearingScene()
    tracking = scene.tracking.replace(motion=Interacting())
    flown = track_bearing_scene(scene.replace(tracking=tracking, estimators=("iekf", "map")))
    filtered, refused = flown.each
    assert filtered.outcome is not None
    assert refused.outcome is None
    assert "map does not take it" in refused.refusal
    assert flown.bounds is None  # of no single motion


def test_the_bound_of_one_step_is_that_of_its_bearings():
    """Bearings of two sensors at right angles, hardly any prior: the bound is that of their intersection."""
    scene = BearingScene()
    simulation = scene.simulation
    places = ({"x_m": -100.0, "y_m": 0.0}, {"x_m": 0.0, "y_m": -50.0})
    sites = tuple(site.replace(**place) for site, place in zip(simulation.sites, places, strict=False))
    # so that no time tells of another
    tracking = scene.tracking.replace(
        motion=scene.tracking.motion.replace(q=1e9), filter=scene.tracking.filter.replace(start_sd_m=1e6)
    )
    # eleven times within a millimetre of the crossing
    simulation = simulation.replace(
        sites=sites, sensors=simulation.sensors.replace(outlier_probability=0.0, sigma_deg=1.0),
        ways_m=(((0.0, 0.0), (1e-3, 0.0)),), speed_mps=2e-4, interval_s=0.5,
    )  # fmt: skip
    scene = scene.replace(simulation=simulation, tracking=tracking, estimators=())
    found = bounds_of(scene, track_bearing_scene(scene).sets)
    assert found is not None
    exact = np.deg2rad(1.0) * np.hypot(100.0, 50.0)
    assert found.filter_m == pytest.approx(exact, rel=1e-3)
    assert found.smoother_m == pytest.approx(exact, rel=1e-2)


@pytest.mark.thorough
def test_the_squared_error_in_deviations_is_the_tables():
    flown = track_bearing_scene(BearingScene(estimators=("map",)))
    outcome = flown.each[0].outcome
    assert outcome is not None
    words = dict(outcome.table)["NEES"]
    assert words.startswith(f"{np.nanmean(nees(outcome.tracked)):.2f} on average")
