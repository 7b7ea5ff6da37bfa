"""Figure of docs/believe.md: for checks of bearings, what holds and what does not."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from elusive.contracts import Array
from elusive.report import plots
from elusive.sensors.bearing_sets import BearingSet, SensorSites
from elusive.systems.bearings.choices import Estimation, OneEmitter
from elusive.systems.bearings.leftovers import Leftovers, leftovers
from elusive.systems.bearings.parameters import BearingTracking
from elusive.systems.bearings.simulate import BearingSimulation
from elusive.systems.bearings.track import track
from elusive.tracking.track import Step

HOLDS, FAILS = plots.TRUTH, "#b91c1c"
SCENE, SIGMA_DEG = BearingSimulation(), 2.0
PLACES = np.array([(site.x_m, site.y_m, 0.0) for site in SCENE.sites])
NAMES = tuple(site.name for site in SCENE.sites)
FLIGHT = SCENE.flight()
HEARD = SCENE.placed_sensors.simulate(FLIGHT.states, FLIGHT.times_s, np.random.default_rng([3, 0]))


def main(path: Path) -> None:
    """Draw all checks."""
    panels = [residuals, convention, sensors, independent, manoeuvres, alone]
    with plots.figure(path, 11.0, 6.4, 2, 3) as (_, grid):
        for axes, panel in zip(grid.ravel(), panels, strict=True):
            panel(axes)


def tracked(
    heard: list[BearingSet], places: Array = PLACES, flt: str = "map", **given: Any
) -> tuple[list[Step], Leftovers]:
    """The steps of a track, and what each bearing leaves."""
    settings = {"sigma_deg": SIGMA_DEG, "filter": {"kind": flt}, "emitters": OneEmitter(), **given}
    parameters = BearingTracking(**settings)
    steps = list(track(heard, parameters, SensorSites(NAMES, places), live=flt != "map"))
    assert isinstance(parameters.filter, Estimation)
    sensor = parameters.sensor_of(SensorSites(NAMES, places), BearingSet, solid=False)
    return steps, leftovers(steps, sensor, parameters.filter)


def changed(second: Any) -> list[BearingSet]:
    """The flight with the azimuths of its second sensor as a function has them."""
    return [
        one._replace(azimuth_rad=np.where(one.sensor == 1, second(k, one.azimuth_rad), one.azimuth_rad))
        for k, one in enumerate(HEARD)
    ]


def named(axes: Any, title: str, x: str, y: str = "") -> None:
    """Name a panel by its finding."""
    axes.set(title=title, xlabel=x, ylabel=y)
    axes.legend(fontsize=7, loc="best", frameon=True, framealpha=0.85, edgecolor="none")


def way(axes: Any, steps: list[Step], colour: str, label: str) -> None:
    """Draw a path over the ground with some of its 95 % ellipses."""
    known = [step.tracks[0] for step in steps if step.tracks and step.state.started]
    axes.plot([one.mean[0] for one in known], [one.mean[2] for one in known], color=colour, label=label)
    for one in known[::8]:
        plots.ellipse(axes, one.mean[[0, 2]], one.covariance[np.ix_([0, 2], [0, 2])], 2.45, colour)


def ground(axes: Any, places: Array = PLACES) -> None:
    """Draw sensors and the truth."""
    axes.plot(*places[:, :2].T, "s", color="#334155", markersize=5)
    axes.plot(*FLIGHT.states[:, [0, 2]].T, color=plots.MUTED, linewidth=0.8, linestyle=(0, (4, 3)), label="the truth")
    axes.set(xlim=(-100, 100), ylim=(-60, 110), aspect="equal")


def residuals(axes: Any) -> None:
    edges = np.linspace(-8, 8, 65)
    for sigma_deg, colour, label in ((SIGMA_DEG, HOLDS, "told right"), (SIGMA_DEG / 4, FAILS, "a quarter told")):
        density, _ = np.histogram(tracked(HEARD, sigma_deg=sigma_deg)[1].deviations, edges, density=True)
        axes.stairs(density, edges, color=colour, linewidth=1.5, label=label)
    named(axes, "bearings.residuals", "residual [what the deviation leaves]", "density")


def convention(axes: Any) -> None:
    turned = [one._replace(azimuth_rad=np.pi / 2 - one.azimuth_rad) for one in HEARD]
    ground(axes)
    way(axes, tracked(HEARD)[0], HOLDS, "clockwise from north")
    way(axes, tracked(turned)[0], FAILS, "anticlockwise from east")
    named(axes, "bearings.residuals: convention", "x, east [m]", "y, north [m]")


def sensors(axes: Any) -> None:
    ground(axes)
    way(axes, tracked(HEARD)[0], HOLDS, "as it is")
    off = changed(lambda _, azimuth: azimuth + np.deg2rad(8))
    way(axes, tracked(off)[0], FAILS, "one sensor 8 degrees off")
    named(axes, "bearings.sensors", "x, east [m]", "y, north [m]")


def independent(axes: Any) -> None:
    for q, colour, label in ((1e-2, FAILS, "q far too small"), (1.0, HOLDS, "each new")):
        left = tracked(HEARD, motion={"kind": "cv", "q": q})[1].of(1).deviations
        axes.plot(left[:-1], left[1:], ".", color=colour, label=label)
    axes.set(xlim=(-4, 4), ylim=(-4, 4))
    named(axes, "bearings.independent", "residual, time before", "residual")


def manoeuvres(axes: Any) -> None:
    for q, colour, label in ((1.0, HOLDS, "q as it moves"), (1e-4, FAILS, "q far too small")):
        steps = tracked(HEARD, flt="iekf", motion={"kind": "cv", "q": q})[0]
        known = [k for k, step in enumerate(steps) if step.state.started]
        off = [np.hypot(*(steps[k].tracks[0].mean[[0, 2]] - FLIGHT.states[k, [0, 2]])) for k in known]
        times = FLIGHT.times_s[known]
        axes.plot(times, off, color=colour, label=label)
        anew = [k for k, row in enumerate(known) if steps[row].state.reopened]
        axes.plot(times[anew], np.array(off)[anew], "o", color=colour, markersize=4)
    named(axes, "bearings.manoeuvres (dots: sought anew)", "time [s]", "error [m]")


def alone(axes: Any) -> None:
    one = [step._replace(**{name: getattr(step, name)[:1] for name in ("sensor", "azimuth_rad", "elevation_rad")})
           for step in HEARD]  # fmt: skip
    ground(axes)
    way(axes, tracked(HEARD)[0], HOLDS, "three sensors")
    steps = tracked(one, flt="iekf")[0]
    way(axes, steps, FAILS, "one alone, iekf")
    named(axes, "bearings.alone", "x, east [m]", "y, north [m]")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
