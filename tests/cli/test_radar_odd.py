"""Recordings of radars that are not what they are taken for, told nothing: named, or tracked all the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from elusive.contracts import Array
from tests.cli.test_radar import Run
from tests.longer import longer

RANGE_SD_M, BEARING_SD, DETECTED, FALSE, FURTHEST_M = 10.0, 2e-3, 0.9, 2.0, 6000.0
TURN_S, SCANS = 2.5, 80
TRACK = ["track", "radar", "plots.csv", "--out", "out", "--particles", "500"]
Plot = tuple[float, float, float]  # time, range, bearing [s, m, rad]


def sailed(rng: np.random.Generator, ships: int = 5, fixed: int = 0) -> Array:
    """Places of ships that sail nearly straight at 3 to 9 m/s, and of what lies still, ``(SCANS, n, 2)``."""
    place, angle = rng.uniform(-3000, 3000, (ships + fixed, 2)), rng.uniform(0, 2 * np.pi, ships + fixed)
    speed = np.where(np.arange(ships + fixed) < ships, rng.uniform(3, 9, ships + fixed), 0.0)
    way = np.column_stack([speed * np.sin(angle), speed * np.cos(angle)])
    return place + TURN_S * np.arange(SCANS)[:, None, None] * way


def looked(rng: np.random.Generator, places: Array, time_s: float, own: Array | None = None) -> list[Plot]:
    """What a radar sees of places ``(n, 2)``, and false alarms."""
    off = places - (np.zeros(2) if own is None else own)
    far, angle = np.hypot(*off.T), np.arctan2(*off.T)
    seen = (rng.random(len(off)) < DETECTED) & (far < FURTHEST_M)
    found = [
        (time_s, abs(r + rng.normal(0, RANGE_SD_M)), (b + rng.normal(0, BEARING_SD)) % (2 * np.pi))
        for r, b in zip(far[seen].tolist(), angle[seen].tolist(), strict=True)
    ]
    alarms = rng.poisson(FALSE)
    pairs = zip((FURTHEST_M * np.sqrt(rng.random(alarms))).tolist(), rng.uniform(0, 2 * np.pi, alarms), strict=True)
    return found + [(time_s, r, b) for r, b in pairs]


def seen(rng: np.random.Generator, places: Array) -> list[Plot]:
    return [plot for k in range(SCANS) for plot in looked(rng, places[k], TURN_S * k)]


def turned(plots: list[Plot], by: Callable[[float], float]) -> list[Plot]:
    return [(t, r, (b + by(t)) % (2 * np.pi)) for t, r, b in plots]


def right(rng: np.random.Generator) -> list[Plot]:
    return seen(rng, sailed(rng))


def on_a_bow(rng: np.random.Generator) -> list[Plot]:
    """Moored, swinging by 15 degrees in two minutes."""
    return turned(right(rng), lambda t: -np.radians(15) * np.sin(2 * np.pi * t / 120))


def north_set_anew(rng: np.random.Generator) -> list[Plot]:
    return turned(right(rng), lambda t: np.radians(8) * (t > 100))


def second_radar(rng: np.random.Generator, later_s: float) -> list[Plot]:
    places, other = sailed(rng), np.array([3000.0, 500.0])
    beside = [plot for k in range(SCANS) for plot in looked(rng, places[k], TURN_S * k + later_s, other)]
    return seen(rng, places) + beside


def second_antenna(rng: np.random.Generator) -> list[Plot]:
    places = sailed(rng)
    return seen(rng, places) + turned(seen(rng, places), lambda t: np.radians(20))


def by_another_way(rng: np.random.Generator, way: Callable[[float, float], tuple[float, float]]) -> list[Plot]:
    """Every second echo comes a second time, elsewhere."""
    plots = seen(rng, 0.8 * sailed(rng, 4))
    return plots + [(t, *way(r, b)) for t, r, b in plots if rng.random() < 0.5]


def twice(rng: np.random.Generator) -> list[Plot]:
    return by_another_way(rng, lambda r, b: (2 * r + rng.normal(0, RANGE_SD_M), b))


def mast(rng: np.random.Generator) -> list[Plot]:
    return by_another_way(rng, lambda r, b: (r + 5, 2.27 + rng.normal(0, BEARING_SD)))


def side_lobes(rng: np.random.Generator) -> list[Plot]:
    """Of one ship alone, to either side."""
    places = 0.8 * sailed(rng, 4)
    echoes = list[Plot]()
    for k in range(SCANS):
        far, angle = float(np.hypot(*places[k, 0])), float(np.arctan2(*places[k, 0]))
        aside = [one for one in np.radians([-18, -12, -6, 6, 12, 18]).tolist() if rng.random() < 0.7]
        echoes += [(TURN_S * k, far + rng.normal(0, RANGE_SD_M), (angle + one) % (2 * np.pi)) for one in aside]
    return seen(rng, places) + echoes


def sails_untold(rng: np.random.Generator) -> list[Plot]:
    """The radar sails at 6 m/s past ten that lie still, and does not say so."""
    places = sailed(rng, 4, 10)
    return [p for k in range(SCANS) for p in looked(rng, places[k], TURN_S * k, TURN_S * k * np.array([3.6, 4.8]))]


def a_scan_twice(rng: np.random.Generator) -> list[Plot]:
    plots = right(rng)
    return plots + [(t + 0.5, r, b) for t, r, b in plots if round(t / TURN_S) in (20, 40, 60)]


def milliseconds(rng: np.random.Generator) -> list[Plot]:
    return [(1000 * t, r, b) for t, r, b in right(rng)]


def minutes(rng: np.random.Generator) -> list[Plot]:
    return [(t / 60, r, b) for t, r, b in right(rng)]


def hard_turns(rng: np.random.Generator) -> list[Plot]:
    """Boats at 15 m/s that turn by a right angle in ten seconds, again and again."""
    heading = rng.uniform(0, 2 * np.pi, 4) + np.cumsum(np.where(np.arange(SCANS) % 16 < 4, np.pi / 8, 0.0))[:, None]
    steps = 15 * TURN_S * np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    return seen(rng, rng.uniform(-2500, 2500, (4, 2)) + np.cumsum(steps, axis=0))


def sector(rng: np.random.Generator) -> list[Plot]:
    """Eight ships before a radar that looks from 17 to 75 degrees."""
    far, angle, heading = rng.uniform(1000, 5000, 8), rng.uniform(0.5, 1.1, 8), rng.uniform(0, 2 * np.pi, 8)
    way = rng.uniform(3, 9, 8)[:, None] * np.column_stack([np.sin(heading), np.cos(heading)])
    place = far[:, None] * np.column_stack([np.sin(angle), np.cos(angle)])
    places = place + TURN_S * np.arange(SCANS)[:, None, None] * way
    return [plot for plot in seen(rng, places) if 0.3 < plot[2] < 1.3]


def radians_of_a_sector(rng: np.random.Generator) -> list[Plot]:
    return [(t, r, np.radians(b)) for t, r, b in sector(rng)]


ODD: dict[str, tuple[Callable[[np.random.Generator], list[Plot]], str, str]] = {
    "on a bow": (on_a_bow, "radar.turned", "only if all bearings are turned together"),
    "north set anew": (north_set_anew, "radar.turned", "only if all bearings are turned together"),
    "second radar": (lambda rng: second_radar(rng, 0.0), "radar.copies", "plots of two radars are in one file"),
    "second radar in turn": (lambda rng: second_radar(rng, 1.1), "radar.alternate", "two radars stand in turn"),
    "second antenna": (second_antenna, "radar.copies", "turned by 20 degrees"),
    "twice": (twice, "radar.copies", "twice the range"),
    "mast": (mast, "radar.copies", "at a bearing of 130 degrees"),
    "side lobes": (side_lobes, "radar.copies", "side lobes"),
    "sails untold": (sails_untold, "radar.alike", "past a radar that moves"),
    "a scan twice": (a_scan_twice, "radar.repeated", "In 3 of 83 scans"),
    "milliseconds": (milliseconds, "radar.times", "look like milliseconds"),
    "minutes": (minutes, "radar.times", "look like minutes"),
    "hard turns": (hard_turns, "radar.again", "turn harder than the motion allows"),
    "radians of a sector": (radians_of_a_sector, "radar.bearings", "look like radians"),
}


LONG = (
    "minutes", "on a bow", "mast", "sails untold", "second antenna", "radians of a sector", "side lobes", "twice",
    "hard turns",
)  # fmt: skip


NAMED_IN_THREE_OF_FOUR = pytest.param(
    "mast", marks=[pytest.mark.thorough, pytest.mark.xfail(reason="three of four such draws are named, this is not")]
)


def written(folder: Path, plots: list[Plot]) -> None:
    lines = [f"{t:.4f},{r:.1f},{np.degrees(b) % 360:.3f}" for t, r, b in sorted(plots)]
    (folder / "plots.csv").write_text("\n".join(["time_s,range_m,bearing_deg", *lines]))


def failing(folder: Path) -> set[str]:
    return {one["name"] for one in json.loads((folder / "out/checks.json").read_text()) if not one["holds"]}


LATER = "second radar", "second radar in turn", "milliseconds", "a scan twice", "north set anew"


@pytest.mark.parametrize(
    "name", [*longer([name for name in ODD if name != "mast"], *LONG, *LATER), NAMED_IN_THREE_OF_FOUR]
)
def test_it_is_named(elusive_in: Run, tmp_path: Path, name: str) -> None:
    draw, finding, sentence = ODD[name]
    written(tmp_path, draw(np.random.default_rng([5, list(ODD).index(name)])))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert finding in failing(tmp_path), said
    assert sentence in " ".join(said.split())


def rounded(rng: np.random.Generator) -> list[Plot]:
    """Each plot at the time at which the antenna passes it, in whole seconds."""
    return [(float(np.floor(t + TURN_S * b / (2 * np.pi))), r, b) for t, r, b in right(rng)]


def after_an_hour(rng: np.random.Generator) -> list[Plot]:
    return [(t + 3600 * (t > 100), r, b) for t, r, b in right(rng)]


def tracks_of(folder: Path) -> Array:
    """Times, tracks and places of what is confirmed."""
    table = np.genfromtxt(folder / "out/tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    table = table[table["status"] == "confirmed"]
    return np.column_stack([table[name] for name in ("time_s", "track", "x_m", "y_m")])


@pytest.mark.thorough
def test_a_sector_in_degrees_has_no_finding(elusive_in: Run, tmp_path: Path) -> None:
    written(tmp_path, sector(np.random.default_rng([5, 52])))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert failing(tmp_path) == set(), said


def test_bearings_that_count_anticlockwise_are_named_by_the_antenna(elusive_in: Run, tmp_path: Path) -> None:
    """Each plot at the time at which an antenna passes it, which turns clockwise."""
    plots = right(np.random.default_rng([5, 51]))
    written(tmp_path, [(t + TURN_S * b / (2 * np.pi), r, (-b) % (2 * np.pi)) for t, r, b in plots])
    code, said = elusive_in(*TRACK)
    assert code == 2
    assert "bearings look counted anticlockwise" in " ".join(said.split())
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
@pytest.mark.parametrize("change", [right, rounded, after_an_hour])
def test_ships_are_found(elusive_in: Run, tmp_path: Path, change: Callable[[np.random.Generator], list[Plot]]) -> None:
    """Of whole seconds none was; after an hour's gap a lost ship's belief took each that appeared for its own."""
    written(tmp_path, change(np.random.default_rng([5, 50])))
    code, said = elusive_in(*TRACK)
    assert code == 0, said
    assert failing(tmp_path) == set(), said
    found = tracks_of(tmp_path)
    last = found[found[:, 0] == found[:, 0].max(), 2:]
    places = sailed(np.random.default_rng([5, 50]))[-1]
    inside = places[np.hypot(*places.T) < FURTHEST_M]
    off = np.hypot(*(inside[:, None] - last).transpose(2, 0, 1)).min(axis=1)
    assert (off < 100).all(), off
