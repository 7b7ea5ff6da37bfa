from __future__ import annotations

import numpy as np
import pytest

from elusive.preprocess.clutter_map import ClutterMap
from elusive.sensors.radar_video import EvidenceTurn, RadarVideo
from elusive.systems.video.lasting import Lasting
from elusive.systems.video.turns import Heard, Learnt
from elusive.tracking.track import Track
from tests.reference.radar_video import level_sea


@pytest.mark.parametrize(("lives", "land"), [(False, 0.0), (True, 0.0), (True, 0.2)])
def test_spikes_that_live_for_some_turns_are_told(lives, land):
    """Boats in a sea whose spikes live for 6 s: six tracks of none, and nothing was said. A ship stays, too."""
    sensor, rng = (
        RadarVideo(beam_deg=2.0, step_m=10.0, pulse_m=20.0, start_m=200.0, samples=300),
        np.random.default_rng(1),
    )
    coast = np.broadcast_to(np.arange(sensor.shape[1]) < land * sensor.shape[1], sensor.shape)
    nothing, place = np.zeros(sensor.shape, bool), sensor.places()[100, 150]
    state = ClutterMap().learnt(None, np.ones(sensor.shape, np.float32))
    state = state._replace(fixed=coast)
    ship = Track(1, "confirmed", 1.0, np.array([place[0], 1.0, place[1], 0.0]), np.eye(4))
    lasting, before, spikes = Lasting(sensor), None, nothing
    for k in range(20):
        drawn = rng.random(sensor.shape) < (0.0003 if lives else 0.001)
        spikes = drawn | (spikes & (rng.random(sensor.shape) < 0.7 * lives))
        evidence = np.where(spikes, 8.0, rng.exponential(0.5, sensor.shape)).astype(np.float32)
        evidence[97:104, 147:154] = 9.0
        turn = EvidenceTurn(
            2.5 * k, np.full(len(evidence), 2.5 * k), evidence, (0.0, 0.0), evidence, evidence, level_sea(evidence)
        )
        heard = Heard(turn, evidence, Learnt(state, state, nothing), 1.0)
        if before is not None:
            lasting.add(before, heard, [ship])
        before = heard
    assert lasting.finding().holds != (lives and not land)  # off land, of which some may not be known as fixed
