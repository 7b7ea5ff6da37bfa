"""Whether radar video looks as it was told: its north, its place on the chart, its clutter, its turns."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from elusive.checks import Finding
from elusive.sensors.echo_extent import EchoExtent
from elusive.sensors.radar_video import RadarVideo
from elusive.systems.video.registration import Registration
from elusive.systems.video.spirals import spirals
from elusive.systems.video.start import VideoStart
from elusive.systems.video.swinging import FEW_TURNS

CHANGED = 3  # turns at the end in another range scale
SURE = 3.0  # errors of a registration beyond which it is told
WIDE_DEG, PART = 1.0, 0.3  # of a bias of north that matters: in degrees, and in beams
LIKE = 0.3  # correlation of what is fixed with charted land from which they are the same coast
FIXES_M = 10.0  # of a position that jitters
SPIKY = 2.0  # share of the clutter beyond what its law lets expect, to that
OTHER_EXTENT = 2.0  # factor by which echoes reach further or less far than told
CROWDED = 0.1  # share of the cells that are fixed
BLIND, MOSTLY = 0.02, 0.3  # share of the sea in which nothing can stand out: some, and much
INTERFERED = 0.002  # share of azimuths
LEVELS = 8  # of amplitude, three bits


def findings_of(
    counts: Counter[str], registration: Registration | None, held: list[float], moved_m: float, start: VideoStart,
    fixed: NDArray[np.bool_], blind: float = 0.0, *, charted: bool = False,
) -> tuple[Finding, ...]:  # fmt: skip
    """Return what a recording says of what was told of it."""
    spokes, sensor = max(counts["spokes"], 1), start.sensor
    still = still_m(sensor)
    found = [
        _turns(counts["turns"]),
        _north(counts["no heading"] / spokes),
        _scale(counts["other scale"] / spokes, counts["turns away"]),
    ]
    spoilt = counts["spoilt"] / max(counts["turns"] * sensor.shape[0], 1)
    found += [_clutter(held), _extent(sensor, start.extent), _interference(spoilt), _levels(start.levels)]
    found.append(_saturated(blind))
    found.append(spirals(counts["pulses"], counts["pulses left"], counts["sliding"], counts["samples"]))
    found.append(
        Finding(
            "video.moving-radar", not (moved_m > still and fixed.any()), still, moved_m,
            f"The radar moved by {moved_m:.0f} m: what is fixed moves through its cells and is told from ships less "
            "well.", "Give --chart, so that land is known; look at slow tracks with care.", grave=False,
        )
    )  # fmt: skip
    if not charted:
        share = float(fixed.mean())
        found.append(
            Finding(
                "video.crowded", share < CROWDED, CROWDED, share,
                f"{100 * share:.0f} % of the cells return turn after turn: land, or a harbour. Ships that pass there "
                "are told from it by their motion alone.",
                "Give --chart, so that land is known.", grave=False,
            )
        )  # fmt: skip
    if registration is not None and registration.likeness > LIKE:
        found += _registered(registration, start)
    return tuple(found)


def still_m(sensor: RadarVideo) -> float:
    """Return how far a radar that stands may move [m]."""
    return max(sensor.cell_m, FIXES_M)


def _registered(registration: Registration, start: VideoStart) -> list[Finding]:
    """Whether what is fixed begins where charted land does."""
    off, sd = registration.azimuth_deg, registration.azimuth_se_deg
    found = [
        Finding(
            "video.azimuth", abs(off) < max(WIDE_DEG, PART * start.sensor.beam_deg, SURE * sd), 0.0, off,
            f"What is fixed lies on charted land best if azimuths are turned by {off:.1f} degrees (error {sd:.1f}): "
            "north is not where the recording says, and ships near the coast are taken for land.",
            f"Give --azimuth-bias-deg {off:.1f}, added to what was given.",
        )
    ]  # fmt: skip
    if math.isfinite(registration.shift_se_m) and start.frame is not None:
        east, north = registration.shift_m
        away = math.hypot(east, north)
        lon, lat = start.frame.to_lonlat(np.array([registration.shift_m]))[0].tolist()
        found.append(
            Finding(
                "video.place", away < max(2 * still_m(start.sensor), SURE * registration.shift_se_m), 0.0, away,
                f"What is fixed lies on charted land best if the radar stands {abs(east):.0f} m further "
                f"{'east' if east > 0 else 'west'} and {abs(north):.0f} m further {'north' if north > 0 else 'south'} "
                f"(error {registration.shift_se_m:.0f} m): its place, or the chart's, is off.",
                f"Give --radar-lon-deg {lon:.6f} --radar-lat-deg {lat:.6f}.",
            )
        )  # fmt: skip
    return found


def _turns(turns: int) -> Finding:
    return Finding(
        "video.turns", turns >= FEW_TURNS, FEW_TURNS, turns,
        f"The recording has {turns} turn{'s' * (turns != 1)}: too few to tell a faint ship from clutter, or what is "
        "fixed from a ship.",
        "Record longer.", grave=False,
    )  # fmt: skip


def _north(share: float) -> Finding:
    return Finding(
        "video.heading", share < 0.01, 0.0, share,
        f"{100 * share:.0f} % of the spokes count from the bow and have no heading: they are taken to look north where "
        "the bow looks.", "Record the heading (NMEA HDG, HDT) beside, or give --azimuth-bias-deg.",
    )  # fmt: skip


def _interference(share: float) -> Finding:
    return Finding(
        "video.interference", share < INTERFERED, 0.0, share,
        f"{100 * share:.1f} % of the azimuths were filled by another radar's pulses at all ranges and are taken as "
        "not received: ships there are seen less.", "Turn the radar's interference rejection on.", grave=share > 0.3,
    )  # fmt: skip


def _saturated(share: float) -> Finding:
    return Finding(
        "video.saturated", share < BLIND, BLIND, share,
        f"In {100 * share:.0f} % of the sea clutter itself reaches the greatest amplitude that was received: what is "
        "stronger is cut off, and no ship can be seen there, however strong.",
        "Turn the gain down, or the sea clutter control up; record more bits, or logarithms.", grave=share > MOSTLY,
    )  # fmt: skip


def _levels(levels: int) -> Finding:
    if levels == 1:
        return Finding(
            "video.levels", False, LEVELS, levels, "All samples of the first turn are the same: no echo was received.",
            "See whether the radar transmits, and whether its video was written.", grave=True,
        )  # fmt: skip
    return Finding(
        "video.levels", levels >= LEVELS, LEVELS, levels,
        f"Samples have {levels} levels: how strong an echo is, against its clutter, is cut off. Spots of clutter are "
        "tracked as ships, sure and wrong.", "Record the video before any threshold, in four bits or more.",
        grave=levels <= 2,
    )  # fmt: skip


def _scale(share: float, away: int) -> Finding:
    """Whether all spokes have the first one's range scale; ``away`` turns at the end did not."""
    name, remedy = "video.scale", "Record one range scale at a time, or start anew where it changes."
    if away >= CHANGED:
        return Finding(
            name, False, 0.0, share,
            f"The radar's range scale changed, and did not change back in {away} turns: nothing was tracked from then "
            "on.", remedy,
        )  # fmt: skip
    return Finding(
        name, share == 0, 0.0, share,
        f"{100 * share:.0f} % of the spokes have another range scale than the first and were left out.", remedy,
        grave=share > 0.5,
    )  # fmt: skip


def _extent(sensor: RadarVideo, extent: EchoExtent) -> Finding:
    """Whether echoes reach as far as was told; by which factor they do not, where it is worst."""
    told, shown = (2 * sensor.cell_m, sensor.beam_deg), (extent.pulse_m, extent.beam_deg)
    factors = [a / b if math.isfinite(b) else 1.0 for a, b in zip(told, shown, strict=True)]
    worst = max(factors, key=lambda factor: abs(math.log(factor)))
    return Finding(
        "video.extent", max(worst, 1 / worst) < OTHER_EXTENT, 1.0, worst,
        f"Echoes reach as far as a pulse of {shown[0]:.3g} m and a beam of {shown[1]:.2g} degrees make them; told were "
        f"{told[0]:.3g} m and {told[1]:.2g} degrees. Of finer cells one echo is many, which wander; in coarser ones "
        "faint ships drown.", "Leave --pulse-m and --beam-deg out, or give the radar's own.",
        grave=worst < 1,
    )  # fmt: skip


def _clutter(held: list[float]) -> Finding:
    known = [one for one in held if math.isfinite(one)]
    seen = float(np.median(known)) if known else math.nan
    return Finding(
        "video.clutter", not (len(known) >= FEW_TURNS and seen > SPIKY), 1.0, seen,
        f"New turns hold {seen:.1f} times as much strong clutter as what was learnt before lets expect: existence is "
        "told too high.", "Give a shorter --memory-turns, more --sectors or --bands.",
    )  # fmt: skip
