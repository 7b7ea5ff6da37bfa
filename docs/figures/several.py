"""Draw three weak targets that cross, as they are followed: ways, existence of each, GOSPA over time.

Run from the project's root, half a minute: ``python docs/figures/several.py docs/_static/several-targets.png``.
"""

import sys
from pathlib import Path

import numpy as np

from elusive.metrics import gospa, sightings, sightings_of
from elusive.report import plots
from elusive.report.scored import PARTS
from elusive.sensors import ImageSensor
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.run import follow
from elusive.systems.images.scene import held_frames
from elusive.systems.images.simulate import ImageSimulation, draw_images

SNR_DB, CUTOFF_PX = 9.0, 4.0
SENSOR = ImageSensor(psf_sigma=1.0, noise_sigma=3.0)
SCENE = ImageSimulation(
    targets=3, layout="crossing", snr_db=SNR_DB, frames=60, rows=64, columns=64, appears=5, leaves=55, sensor=SENSOR,
    seed=1,
)  # fmt: skip


def main(out: Path) -> None:
    """Draw and track the scene, and draw the figure."""
    drawn = draw_images(SCENE)
    source = held_frames("crossing", drawn.frames)
    birth = {"snr_db": None, "snr_db_range": (5.0, 15.0)}
    steps = list(follow(source, ImageTracking(filter={"sensor": SENSOR, "birth": birth}, seed=2)))
    rows = [
        (number, track.track, track.status == "confirmed", track.existence, *track.mean[[0, 2]])
        for number, step in enumerate(steps)
        for track in step.tracks
        if track.status != "deleted"
    ]
    frame, track, sure, existence, x, y = np.array(rows).T
    sure = sure > 0
    times = np.arange(SCENE.frames)
    names = np.unique(track[sure])
    worth = gospa(
        sightings_of(drawn.truth), sightings(frame[sure], track[sure], np.column_stack([x, y])[sure]), CUTOFF_PX, 2.0,
        SCENE.frames,
    )  # fmt: skip
    with plots.figure(out, 10.0, 6.6, 2, 2) as (_, ((seen, ways), (there, off))):
        plots.frame(seen, drawn.frames[30], "Frame 30: three targets in one place")
        for number in range(drawn.truth.shape[1]):
            label = "truth" if number == 0 else None
            ways.plot(*drawn.truth[:, number].T, color=plots.TRUTH, linewidth=4, alpha=0.5, label=label)
        for number in names.astype(int):
            colour, mine = plots.track_colour(number), track == number
            ways.plot(x[mine], y[mine], color=colour, marker="o", markersize=2, linewidth=1, label=f"track {number}")
            there.plot(frame[mine], existence[mine], color=colour, label=f"track {number}")
        ways.set(title="Ways", xlabel="x [px]", ylabel="y [px]", xlim=(8, 56), ylim=(56, 14), aspect="equal")
        ways.legend(loc="lower left")
        present = np.isfinite(drawn.truth[..., 0]).sum(axis=1)
        plots.shade(there, times, present > 0)
        there.set(
            title="Is it there? Existence of each track", xlabel="frame", ylabel="probability", ylim=(-0.02, 1.02)
        )
        there.legend(loc="center right")
        for name, part, colour in PARTS:
            off.plot(times, np.sqrt(getattr(worth, part)), color=colour, linewidth=1.2, label=name)
        off.plot(times, worth.distance, color=plots.ESTIMATE, label="GOSPA")
        off.set(
            title=f"GOSPA (c {CUTOFF_PX:g} px), {worth.distance.mean():.2f} px on average",
            xlabel="frame",
            ylabel="[px]",
        )
        off.legend(loc="upper right")
        for axes in (there, off):
            axes.set_xlim(0, SCENE.frames - 1)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
