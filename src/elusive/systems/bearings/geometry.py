"""Whether a track lies where bearings can tell a place: on no sensor, no surer than they allow, not too far away."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from elusive.checks import Finding
from elusive.contracts import Array
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.faults import norths_are_exact
from elusive.systems.bearings.heard import sensors_of
from elusive.systems.bearings.parameters import BearingTracking

AT_SENSOR, OFTEN = 0.02, 0.2  # distance to a sensor, of the sensors' extent, and share of the times that near
TOO_SURE = 0.5  # of the deviation that all bearings together allow
REMOTE, SHIFTED = 5.0, 4.0  # extents of the sensors away, and deviations that a north off by its own moves the place


def geometry_findings(
    places: Array, spread: Array, heard: Sequence[object], parameters: BearingTracking, sites: SensorSites, said: str
) -> list[Finding]:
    """Check that places ``(K, 2)`` of covariances ``(K, 2, 2)`` are on no sensor, and no surer than bearings allow."""
    used = sorted(set[int]().union(*(set(sensors_of(times).tolist()) for times in heard)))  # type: ignore[arg-type]
    stations = np.repeat(sites.positions_m[None, used, :2], len(places), axis=0)  # (K, n, 2)
    for k, times in enumerate(heard):
        if isinstance(times, BearingSet) and times.places_m is not None:
            stations[k, np.searchsorted(used, times.sensor)] = times.places_m[:, :2]
    extent = float(np.linalg.norm(np.ptp(stations.reshape(-1, 2), axis=0)))
    away = np.linalg.norm(places[:, None] - stations, axis=2)
    near = away < AT_SENSOR * extent
    share = float(near.any(axis=1).mean())
    name = sites.names[used[int(near.sum(axis=0).argmax())]]
    found = [
        Finding(
            "bearings.on-sensor", share <= OFTEN, 0.0, share,
            f"{upper(said + 'the place')} lies on a sensor, mostly {name}, at {100 * share:.0f} % of the times: there "
            "its bearings fit whatever the emitter does.",
            "Look whether azimuths, places and deviation are right; do not rely on the place.",
        )
    ]  # fmt: skip
    bearings = [times for times in heard if isinstance(times, BearingSet)]
    if len(used) > 1 and len(bearings) == len(heard):
        found.append(_remote(places, spread, stations, away, bearings, parameters, sites, said))
        count = sum(len(times.sensor) for times in bearings)
        second = float(np.median(np.sort(away, axis=1)[:, 1]))
        allowed = math.radians(parameters.deviation_deg) * second / math.sqrt(max(count, 1))
        claimed = float(np.median(np.sqrt(np.linalg.eigvalsh(spread)[:, 1])))
        found.append(
            Finding(
                "bearings.ellipse", claimed >= TOO_SURE * allowed, allowed, claimed,
                f"{upper(said + 'the place')} is claimed to {claimed:.2g} m, and all {count} bearings of "
                f"{parameters.deviation_deg:g} degrees together allow {allowed:.2g} m at that distance.",
                "Do not rely on the ellipses; look whether the sensors' places are right and in metres.",
            )
        )  # fmt: skip
    return found


def _remote(
    places: Array,
    spread: Array,
    stations: Array,
    away: Array,
    heard: list[BearingSet],
    parameters: BearingTracking,
    sites: SensorSites,
    said: str,
) -> Finding:
    """Say what a north that is off would do to a place far from all sensors, whose lines nearly run alike.

    Three sensors' lines meet in one place only if no north is off, or if these happen to agree: where they do, the
    evidence of the path is greater without biases of their deviation than with them.
    """
    extent = float(np.linalg.norm(np.ptp(stations.reshape(-1, 2), axis=0)))
    off = places[:, None] - stations  # (K, n, 2)
    slope = np.stack([off[..., 1], -off[..., 0]], axis=-1) / np.maximum(away, 1e-9)[..., None] ** 2
    shifts = np.einsum("kab,knb->kna", np.linalg.pinv(np.einsum("kna,knb->kab", slope, slope)), slope)
    shift = math.radians(parameters.deviation_deg) * float(np.median(np.linalg.norm(shifts, axis=2).max(axis=1)))
    claimed = float(np.median(np.sqrt(np.trace(spread, axis1=1, axis2=2))))
    far = float(np.median(away.min(axis=1))) / max(extent, 1e-9)
    perhaps = far >= REMOTE and shift >= SHIFTED * claimed
    return Finding(
        "bearings.remote", not perhaps or norths_are_exact(heard, parameters, sites), claimed, shift,
        f"{upper(said + 'the emitter')} is {far:.0f} times as far as the sensors are apart: if the north of one is "
        f"off by {parameters.deviation_deg:g} degrees all the time, the place is {shift:.2g} m elsewhere, and the "
        f"bearings fit as well. The {claimed:.2g} m that are claimed hold for norths that are exact.",
        "Measure each sensor's north, or let it be estimated: --bias-sd-deg with --bias-memory-s 1e6.", grave=False,
    )  # fmt: skip


def upper(sentence: str) -> str:
    """Return a sentence that begins with a capital."""
    return sentence[:1].upper() + sentence[1:]
