"""`elusive track images`: a target too faint to threshold, through a sequence of frames."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.given import accepts, parameters_of
from elusive.cli.live import Follow, IdleS, To, check_live, memory_of_run, run_live, sinks_of, tell
from elusive.cli.recorded import RateHz, Start, Stop, cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, OneBased, Out, Strict, bar, check_scores, known_truth
from elusive.errors import ParameterError
from elusive.io import open_frames
from elusive.io.live_frames import LiveFrames, is_live, open_live_frames
from elusive.systems.images.fit import fit_images
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.run import FILES, LIVE_FILES, track_live, track_recording

FAULTS_TOLD = 3

Frames = Annotated[
    str,
    typer.Argument(help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video."),
]


@accepts(ImageTracking)
def track_images_command(
    source: Annotated[
        str,
        typer.Argument(
            help="Folder or glob of PNG/TIFF, multi-page TIFF, .npy, .npz, HDF5 (file.h5::/name), GIF, video; live: "
            "rtsp://... and the like, camera:0, - (standard input: YUV4MPEG2, PGM, PNG, .npy)."
        ),
    ],
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[Path | None, truth_of("targets", ".csv of frame, track, x_px, y_px; or x y a line")] = None,
    truth_one_based: OneBased = False,
    truth_cutoff: Annotated[float | None, cutoff_in("px", "4")] = None,
    rate_hz: RateHz = None,
    times: Annotated[
        Path | None, typer.Option("--times", help="Times of the frames: .csv of time_s, a line a frame.")
    ] = None,
    start: Start = 0,
    stop: Stop = None,
    follow: Follow = False,
    to: To = None,
    idle_s: IdleS = None,
    strict: Strict = False,
) -> None:
    """Track targets too faint to threshold through a sequence of frames, recorded or as they come."""
    parameters = parameters_of(ImageTracking, given, config)
    follow = follow or is_live(source)
    sinks = sinks_of(to, "images", "px", live=follow)
    check_live(follow, idle_s, truth)
    check_scores(truth, truth_one_based=truth_one_based, truth_cutoff=truth_cutoff)
    if follow:
        if times is not None or start or stop is not None:
            name = "--times" if times is not None else "--start" if start else "--stop"
            raise ParameterError(f"{name}: has no meaning for frames that are still to come; leave it out.")
        live = open_live_frames(source, rate_hz=rate_hz, idle_s=idle_s, on_fault=lambda said: _tell_fault(said, live))
        run = partial(track_live, live, parameters, out, memory=memory_of_run())
        run_live(live, run, out, LIVE_FILES, sinks, strict=strict)
        return
    known = known_truth(truth, "px", one_based=truth_one_based, cutoff=truth_cutoff)
    frames = open_frames(source, start=start, stop=stop, rate_hz=rate_hz, times=times)
    with bar("frames", frames.length) as advance:
        outcome = track_recording(frames, parameters, out, truth=known, cutoff_px=truth_cutoff, on_frame=advance)
    tell_run(outcome, (outcome.tracked.title, outcome.tracked.rows), out, FILES, sinks, strict=strict)


def _tell_fault(sentence: str, frames: LiveFrames) -> None:
    """Say what is wrong with a frame, unless so much has been said already."""
    if frames.unusable <= FAULTS_TOLD:
        tell(sentence + " Further ones are counted." * (frames.unusable == FAULTS_TOLD))


def fit_images_command(source: Frames, out: FittedOut = None, start: Start = 0, stop: Stop = None) -> None:
    """Fit noise, level, point spread, brightness and polarity to a recording; then: track images --config."""
    frames = open_frames(source, start=start, stop=stop)
    with bar("frames", None if frames.length is None else 2 * frames.length) as advance:
        fitted = fit_images(frames, advance)
    tell_fitted("images", frames.name, fitted, out)
