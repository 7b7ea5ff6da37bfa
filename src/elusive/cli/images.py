"""`elusive track images`: a target too faint to threshold, through a sequence of frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.terminal import Config, OneBased, Out, Strict, bar, known_truth, show, tell_findings, tell_written
from elusive.io import open_frames
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.images.fit import fit_images
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.run import FILES, track_recording

Frames = Annotated[
    str,
    typer.Argument(help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video."),
]
Start = Annotated[int, typer.Option(help="First frame to use, from 0.")]
Stop = Annotated[int | None, typer.Option(help="Frame before which to stop.")]


@accepts(ImageTracking)
def track_images_command(
    source: Frames,
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None,
        typer.Option(
            "--truth", help="Where targets truly are: .csv of frame, track, x_px, y_px; or x y a line. Scores."
        ),
    ] = None,
    truth_one_based: OneBased = False,
    truth_cutoff: Annotated[
        float | None,
        typer.Option("--truth-cutoff-px", help="Scores: further off is missed; c of GOSPA; by default 4."),
    ] = None,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")] = None,
    times: Annotated[
        Path | None, typer.Option("--times", help="Times of the frames: .csv of time_s, a line a frame.")
    ] = None,
    start: Start = 0,
    stop: Stop = None,
    strict: Strict = False,
) -> None:
    """Track targets too faint to threshold through a sequence of frames."""
    parameters = ImageTracking(**nested(ImageTracking, given, read_yaml(config) if config else {}))
    known = known_truth(truth, "px", one_based=truth_one_based, cutoff=truth_cutoff)
    frames = open_frames(source, start=start, stop=stop, rate_hz=rate_hz, times=times)
    with bar("frames", frames.length) as advance:
        outcome = track_recording(frames, parameters, out, truth=known, cutoff_px=truth_cutoff, on_frame=advance)
    show(outcome.tracked.title, ("", ""), outcome.tracked.rows)
    tell_written(out, FILES, outcome.scored)
    tell_findings(outcome.findings, strict=strict)


def fit_images_command(source: Frames, out: FittedOut = None, start: Start = 0, stop: Stop = None) -> None:
    """Fit noise, level, point spread, brightness and polarity to a recording; then: track images --config."""
    frames = open_frames(source, start=start, stop=stop)
    with bar("frames", None if frames.length is None else 2 * frames.length) as advance:
        fitted = fit_images(frames, advance)
    taken = "white noise about a level" if fitted.white else "a recorded scene, whose noise is learnt as it goes"
    tell_fitted("images", f"{frames.name}: {taken}", [value.cells for value in fitted.values], fitted.to_yaml(), out)
