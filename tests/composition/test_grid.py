"""Every motion with every sensor, knowledge and filter, over uneven times: it runs, or is refused in a sentence."""

from __future__ import annotations

import numpy as np
import pytest

from elusive import run
from elusive.contracts import AdditiveSensor, DetectionSensor, Linearisable, Sensor
from elusive.errors import ElusiveError, ParameterError
from elusive.model import Model
from elusive.sensors.field import FieldSensors
from tests.composition.builders import FILTERS, KNOWLEDGE, MIDDLE, MOTIONS, SENSORS, prior_of
from tests.composition.table import PAGE, page_with, refusal, table

TIMES = [3.0, 3.2, 8.0, 8.0, 9.5]
MISSING = 2  # that measurement does not come


def measured(case, sensor, names, rng):
    state = np.array([MIDDLE.get(name, 0.0) for name in names])
    seen = [case.measure(sensor, state, time_s, rng) for time_s in TIMES]
    return [None if k == MISSING else one for k, one in enumerate(seen)]


@pytest.mark.parametrize("sensor_name", SENSORS)
@pytest.mark.parametrize("name", FILTERS)
def test_it_runs_at_uneven_times_or_says_why_not(name, sensor_name):
    case = SENSORS[sensor_name]
    ran = 0
    for motion_name, motion in MOTIONS.items():
        why = refusal(name, motion_name, sensor_name)
        if why is not None:
            assert ": " in why
            assert why.endswith((".", ")")) or len(why) > 40
            continue
        names = tuple(motion.state_names)
        sensor, rng = case.build(names), np.random.default_rng(1)
        seen = measured(case, sensor, names, rng)
        for known_name, known in (KNOWLEDGE if FILTERS[name].knows else {"none": ()}).items():
            what = f"{name}, {motion_name}, {sensor_name}, {known_name}"
            filter = FILTERS[name].build(motion, sensor, known, prior_of(names))
            assert tuple(filter.state_names)[:4] == ("x", "vx", "y", "vy"), what
            states = list(run(filter, seen, rng, TIMES, start_s=2.5))
            assert [state.time_s for state in states] == TIMES, what
            assert all(np.isfinite(state.mean).all() for state in states), what
            assert all(np.isfinite(state.covariance).all() for state in states), what
            assert all(0 <= getattr(state, "existence", 1.0) <= 1 for state in states), what
            with pytest.raises(ElusiveError, match="sort"):
                filter.step(states[-1], TIMES[0], None, rng)
            ran += 1
    assert ran or not hasattr(case.build(MOTIONS["cv"].state_names), "residual"), "nothing of this row composes"


@pytest.mark.parametrize("name", FILTERS)
def test_yaml_is_read_back_or_the_part_that_cannot_be_is_named(name, tmp_path):
    pairs = [(motion, "linear") for motion in MOTIONS] + [("cv", sensor) for sensor in SENSORS]
    pairs = [pair for pair in pairs if refusal(name, *pair) is None]
    assert len(pairs) > 3
    for motion_name, sensor_name in pairs:
        motion = MOTIONS[motion_name]
        names = tuple(motion.state_names)
        filter = FILTERS[name].build(motion, SENSORS[sensor_name].build(names), (), prior_of(names))
        if getattr(filter, "birth", None) is not None:
            filter = filter.replace(birth=type(filter).model_fields["birth"].default)
        own = [part for part in ("motion", "sensor") if not isinstance(getattr(filter, part, filter), Model)]
        if own:
            with pytest.raises(ParameterError, match=rf"\.{own[0]}: holds a Own"):
                filter.to_yaml()
            continue
        path = tmp_path / "filter.yaml"
        path.write_text(filter.to_yaml())
        assert type(filter).from_yaml(path) == filter, (motion_name, sensor_name)


def test_sensors_offer_what_their_filters_ask():
    sensors = {name: case.build(MOTIONS["cv"].state_names) for name, case in SENSORS.items()}
    assert all(isinstance(sensor, Sensor) for sensor in sensors.values())
    linearised = {name for name, sensor in sensors.items() if isinstance(sensor, Linearisable)}
    assert linearised == {"radar", "bearings", "arrival times", "both", "linear", "a user's own"}
    assert isinstance(sensors["radar"], DetectionSensor)
    assert isinstance(FieldSensors(positions_m=((0.0, 0.0),)), AdditiveSensor)


def test_the_docs_say_what_composes():
    """Made anew by ``python -m tests.composition.table``."""
    assert page_with(table()) == PAGE.read_text(encoding="utf-8")
