"""How many sensors hear each track of unlabelled bearings: two may be a ghost, and one tells no place.

Any two bearings cross somewhere. Two tracks may also share one emitter's bearings, each taking those of another sensor:
neither is where it says, and each explains its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scipy.special import bdtr

from elusive.checks import Finding

LEAST_TIMES = 8  # of a track, for its sensors to tell anything
UNHEARD = 0.5  # of how often the best sensor hears an emitter: one that hears less is no witness
UNLIKELY = 1e-3  # chance of as few bearings from a sensor that hears it as often as that
UNTOLD = 0.5  # probability that a track of one sensor is where it says

Hits = Mapping[int, Mapping[int, Sequence[int]]]  # of each track and sensor: of each time, whether a bearing was near


def crossed_alone(hits: Hits) -> float:
    """Share of the tracks' times that no third sensor supports, where three or more listen."""
    alone, whole = 0, 0
    for by_sensor in hits.values():
        rates = sorted((sum(part) / len(part) for part in by_sensor.values()), reverse=True)
        times = max(len(part) for part in by_sensor.values())
        if len(rates) > 2 and times >= LEAST_TIMES:
            whole += times
            alone += times if rates[2] < UNHEARD * rates[0] else 0
    return alone / whole if whole else 0.0


def of_one_sensor(hits: Hits) -> tuple[int, ...]:
    """Return the tracks that one sensor hears, and none of the others that listen, beyond chance.

    A bearing near a track counts where the track's direction is known nearly as well as a bearing tells it: that of a
    sensor which does not hear it is not.
    """
    found = []
    for number, by_sensor in sorted(hits.items()):
        heard = sorted(by_sensor.values(), key=lambda part: sum(part) / len(part))
        *others, best = [(sum(part), len(part)) for part in heard]
        least = UNHEARD * best[0] / best[1]
        if others and best[1] >= LEAST_TIMES and all(bdtr(near, times, least) < UNLIKELY for near, times in others):
            found.append(number)
    return tuple(found)


def one_sensor_finding(tracks: Sequence[int]) -> Finding:
    """Say which tracks one sensor alone hears."""
    named = ", ".join(f"track {number}" for number in tracks)
    return Finding(
        "bearings.one-sensor", not tracks, 0.0, float(len(tracks)),
        f"Of the sensors that listen one alone hears {named}: bearings of one sensor tell no place. Two tracks may "
        "share one emitter's bearings so, each with those of another sensor; then neither is where it says.",
        "Do not rely on their places; look at the sensors' norths and places, and add a third sensor.",
    )  # fmt: skip
