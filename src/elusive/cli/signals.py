"""`elusive track signal`: objects that differ from a signal's noise only in their statistics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.given import accepts, parameters_of
from elusive.cli.live import To, sinks_of
from elusive.cli.recorded import RateHz, Start, Stop, bare, cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, OneBased, Out, Strict, bar, known_truth
from elusive.io import open_signal
from elusive.systems.signals.fit import SIZES, fit_signal
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.run import FILES, track_signal_recording

Recording = Annotated[
    Path,
    typer.Argument(help="Array (time, sample) as .npy, .csv or .txt; or a long recording: .wav, one column, 1-D."),
]
FrameSamples = Annotated[int | None, typer.Option(help="Samples of a frame, of a long recording. [default: 1200]")]
HopSamples = Annotated[int | None, typer.Option(help="Samples from a frame's start to the next. [default: a frame's]")]
Channel = Annotated[int | None, typer.Option(help="Channel of a .wav file, from 0.")]


@accepts(SignalTracking)
def track_signals_command(
    recording: Recording,
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[Path | None, truth_of("objects", ".csv of frame, track, x_samples; or x a line")] = None,
    truth_one_based: OneBased = False,
    truth_cutoff: Annotated[float | None, cutoff_in("samples", "an object's size")] = None,
    rate_hz: RateHz = None,
    frame_samples: FrameSamples = None,
    hop_samples: HopSamples = None,
    channel: Channel = None,
    start: Start = 0,
    stop: Stop = None,
    to: To = None,
    strict: Strict = False,
) -> None:
    """Track objects that differ from a signal's noise only in their statistics."""
    parameters = parameters_of(SignalTracking, given, config)
    sinks = sinks_of(to, "signals", "samples", live=False)
    known = known_truth(truth, "samples", one_based=truth_one_based, cutoff=truth_cutoff)
    frames = open_signal(
        recording, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, start=start, stop=stop,
        rate_hz=rate_hz,
    )  # fmt: skip
    with bar("frames", frames.length) as advance:
        outcome = track_signal_recording(
            frames, parameters, out, truth=known, cutoff_samples=truth_cutoff, on_frame=advance
        )
    tracked = outcome.tracked
    tell_run(
        outcome, (tracked.title, tracked.rows), out, FILES, sinks, strict=strict, verdict=tracked.verdict,
        tracks=(bare(tracked.header), tracked.tracks),
    )  # fmt: skip


def fit_signals_command(
    recording: Recording,
    out: FittedOut = None,
    frame_samples: FrameSamples = None,
    hop_samples: HopSamples = None,
    channel: Channel = None,
    start: Start = 0,
    stop: Stop = None,
) -> None:
    """Fit an object's size to a recording, and whether its noise is white; then: track signal --config."""
    frames = open_signal(
        recording, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, start=start, stop=stop
    )
    with bar("frames", None if frames.length is None else len(SIZES) * frames.length) as advance:
        fitted = fit_signal(frames, advance)
    tell_fitted("signal", frames.name, [value.cells for value in fitted.values], fitted.to_yaml(), out)
