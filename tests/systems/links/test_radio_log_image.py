"""A real radio log: where the tracker by way of an image takes somebody to be who carries nothing.

642 frames of ten nodes in a basement, the first 50 with nobody there; then a person walks for 508 frames whose place is
known. Nothing was chosen by that place: the noise of the links follows from the levels of the empty room, and the rest
was chosen on simulated logs with fading.

The person of a frame is the confirmed track at which that frame's image is brightest; where no track is confirmed, the
place that was shown last. Both are known when the frame is.
"""

from __future__ import annotations

from itertools import islice
from typing import NamedTuple

import numpy as np
import pytest

from elusive.io.link_logs import open_link_log
from elusive.io.placed_files import read_nodes
from elusive.preprocess.link_calibration import Calibrate
from elusive.systems.links.by_image import FADED_DB, channel_deviation
from elusive.systems.links.track import ImageMethod, LinkTracking, track
from tests import recordings

DATA = recordings.DATA / "rti" / "basement"
LOG = DATA / "basement_listenx_out_1.txt"
EMPTY, WALK_S, PIVOT_S = 50, 56.0, 8.0

pytestmark = pytest.mark.skipif(not LOG.exists(), reason=f"needs the radio log under {DATA}")


class Run(NamedTuple):
    errors_m: np.ndarray  # (508,) of the person; infinite before the first confirmed track
    confirmed: np.ndarray  # (508,) tracks a frame
    early: int  # confirmed tracks in the empty frames
    identities: int  # tracks that were ever confirmed


def network():
    nodes = read_nodes(DATA / "sensor_coords_basement_m.txt")
    return nodes, open_link_log(LOG, nodes)


def followed(method: ImageMethod, calibration_frames: int = EMPTY) -> Run:
    pivots = np.loadtxt(DATA / "pivot_coords_basement_m.txt")
    corners = pivots[np.loadtxt(DATA / "path_basement_1_f.txt").astype(int)]
    nodes, log = network()
    shown, errors, confirmed, early = np.full(2, np.inf), [], [], 0
    identities = set()
    parameters = LinkTracking(method=method, calibration_frames=calibration_frames)
    grid = parameters.grid_of(nodes)
    for number, result in enumerate(track(log, nodes, parameters)):
        people = [one for one in result.tracks if one.status == "confirmed"]
        identities |= {one.track for one in people}
        early += len(people) if number < EMPTY else 0
        if people:
            places = np.array([one.mean[[0, 2]] for one in people])
            voxels = ((grid.centres[:, None] - places) ** 2).sum(axis=2).argmin(axis=0)
            shown = places[result.state.people.image[voxels].argmax()]
        way = (result.time_s - WALK_S) / PIVOT_S
        if 0 <= way <= len(corners) - 1:
            place = [np.interp(way, np.arange(len(corners)), corners[:, axis]) for axis in (0, 1)]
            errors.append(float(np.hypot(*(shown - place))))
            confirmed.append(len(people))
    return Run(np.array(errors), np.array(confirmed), early, len(identities))


@pytest.mark.validate
def test_the_person_is_found_without_ghosts():
    run = followed(ImageMethod())
    assert len(run.errors_m) == 508
    assert run.early == 0
    assert run.errors_m.mean() <= 1.2  # .973 measured; 1.37 to 1.44 with links that are taken not to fade
    assert np.median(run.errors_m) <= 1.0
    assert np.maximum(run.confirmed - 1, 0).mean() <= 0.2  # ghosts a frame: .059
    assert (run.confirmed > 0).mean() >= 0.97
    assert run.identities <= 10  # 7; 15 with a gate of 2.5 m, where links fade too


@pytest.mark.validate
def test_it_is_by_counting_the_fading_as_noise():
    """Told that links do not fade, the same tracker sees several people in one."""
    assert (followed(ImageMethod(fading_db=0.0)).confirmed > 1).mean() > 0.5


def test_the_links_of_a_basement_fade():
    """Their channels differ nearly as much as in Rayleigh's fading, 5.6 dB."""
    levels = Calibrate().over(islice(network()[1], EMPTY)).mean_dbm
    assert 2 * FADED_DB > channel_deviation(levels) > 1.5 * FADED_DB
