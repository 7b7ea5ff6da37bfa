"""`elusive track signal`: objects that differ from a signal's noise only in their statistics."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.live import To, send_recording, sinks_of
from elusive.cli.terminal import (
    Config,
    OneBased,
    Out,
    Strict,
    bar,
    console,
    known_truth,
    show,
    show_run,
    tell_findings,
    tell_written,
)
from elusive.io import open_signal
from elusive.model import read_yaml
from elusive.options import accepts, nested
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
Start = Annotated[int, typer.Option(help="First frame to use, from 0.")]
Stop = Annotated[int | None, typer.Option(help="Frame before which to stop.")]


@accepts(SignalTracking)
def track_signals_command(
    recording: Recording,
    out: Out,
    given: dict[str, Any],
    config: Config = None,
    truth: Annotated[
        Path | None,
        typer.Option("--truth", help="Where objects truly are: .csv of frame, track, x_samples; or x a line. Scores."),
    ] = None,
    truth_one_based: OneBased = False,
    truth_cutoff: Annotated[
        float | None,
        typer.Option(
            "--truth-cutoff-samples",
            help="Scores: further off is missed; c of GOSPA; by default an object's size.",
        ),
    ] = None,
    rate_hz: Annotated[float | None, typer.Option("--rate-hz", help="Frames a second; else from the file.")] = None,
    frame_samples: FrameSamples = None,
    hop_samples: HopSamples = None,
    channel: Channel = None,
    start: Start = 0,
    stop: Stop = None,
    to: To = None,
    strict: Strict = False,
) -> None:
    """Track objects that differ from a signal's noise only in their statistics."""
    parameters = SignalTracking(**nested(SignalTracking, given, read_yaml(config) if config else {}))
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
    console.print(escape(tracked.verdict), highlight=False)
    if tracked.tracks:
        show("Tracks", [name.partition(" [")[0] for name in tracked.header], tracked.tracks)
    show_run(tracked.title, tracked.rows, outcome.findings)
    tell_written(out, FILES, outcome.scored)
    send_recording(sinks, out)
    tell_findings(outcome.findings, strict=strict)


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
