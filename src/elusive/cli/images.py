"""`elusive track images`: a target too faint to threshold, through a sequence of frames."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.terminal import Config, OneBased, Out, Strict, bar, known_truth, show, tell_findings, tell_written
from elusive.io import open_frames
from elusive.model import read_yaml
from elusive.options import accepts, nested
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.run import FILES, track_recording


@accepts(ImageTracking)
def track_images_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video."
        ),
    ],
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
    start: Annotated[int, typer.Option(help="First frame to use, from 0.")] = 0,
    stop: Annotated[int | None, typer.Option(help="Frame before which to stop.")] = None,
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
