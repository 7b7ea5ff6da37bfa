"""`elusive track signal`: objects that differ from a signal's noise only in their statistics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from elusive.cli.fit import FittedOut, tell_fitted
from elusive.cli.given import accepts, parameters_of
from elusive.cli.live import Follow, IdleS, To, check_live, feed_of, memory_of_run, run_live, sinks_of
from elusive.cli.recorded import RateHz, Start, Stop, cutoff_in, tell_run, truth_of
from elusive.cli.terminal import Config, OneBased, Out, Strict, bar, known_truth
from elusive.errors import ParameterError
from elusive.io import SignalFrame, SignalSource, open_signal
from elusive.io.arrivals import Arrivals, fed
from elusive.io.live_signals import STANDARD_INPUT, RawForm, follow_signal
from elusive.io.sinks import Sinks
from elusive.results.live import LiveEnd, LiveStep
from elusive.systems.signals.fit import SIZES, fit_signal
from elusive.systems.signals.live import LIVE_FILES, follow_signal_live
from elusive.systems.signals.parameters import SignalTracking
from elusive.systems.signals.run import FILES, track_signal_recording

RECORDED = "Array (time, sample) as .npy, .csv or .txt; or a long recording: .wav, one column, 1-D."
Recording = Annotated[Path, typer.Argument(help=RECORDED)]
FrameSamples = Annotated[int | None, typer.Option(help="Samples of a frame, of a long recording. [default: 1200]")]
HopSamples = Annotated[int | None, typer.Option(help="Samples from a frame's start to the next. [default: a frame's]")]
Channel = Annotated[int | None, typer.Option(help="Channel of a .wav file, from 0.")]
RawAs = Annotated[
    RawForm | None,
    typer.Option("--raw", help="Samples stand alone, little-endian: of so many bits; f: floats; c: I and Q in turn."),
]


@accepts(SignalTracking)
def track_signals_command(
    recording: Annotated[str, typer.Argument(help=f"{RECORDED} Live: a file that grows, or -.")],
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
    raw: RawAs = None,
    start: Start = 0,
    stop: Stop = None,
    follow: Follow = False,
    to: To = None,
    idle_s: IdleS = None,
    strict: Strict = False,
) -> None:
    """Track objects that differ from a signal's noise only in their statistics."""
    parameters = parameters_of(SignalTracking, given, config)
    feed = feed_of(recording, follow, idle_s)
    check_live(feed is not None, idle_s, truth, strict=strict)
    if recording == STANDARD_INPUT and not follow:
        raise ParameterError("-: standard input is tracked as it comes; add --follow.")
    sinks = sinks_of(to, "signals", "samples", live=feed is not None)
    if feed is not None:
        if start or stop is not None:
            raise ParameterError("--start and --stop: have no meaning for what is still to come; leave them out.")
        source = follow_signal(
            recording, feed, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, rate_hz=rate_hz,
            raw=raw, after=memory_of_run().place,
        )  # fmt: skip
        _live(source, fed(source, feed), parameters, out, sinks, starts_anew=recording == STANDARD_INPUT)
        return
    known = known_truth(truth, "samples", one_based=truth_one_based, cutoff=truth_cutoff)
    frames = open_signal(
        recording, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, start=start, stop=stop,
        rate_hz=rate_hz, raw=raw,
    )  # fmt: skip
    with bar("frames", frames.length) as advance:
        outcome = track_signal_recording(
            frames, parameters, out, truth=known, cutoff_samples=truth_cutoff, on_frame=advance
        )
    tracked = outcome.tracked
    tell_run(
        outcome, (tracked.title, tracked.rows), out, FILES, sinks, strict=strict, verdict=tracked.verdict,
        tracks=(tracked.header, tracked.tracks),
    )  # fmt: skip


def _live(
    source: SignalSource,
    coming: Arrivals[SignalFrame],
    parameters: SignalTracking,
    out: Path,
    sinks: Sinks,
    *,
    starts_anew: bool,
) -> None:
    """Track objects while their signal is written."""

    def run(told: Callable[[LiveStep], None]) -> LiveEnd:
        return follow_signal_live(coming, source, parameters, out, told, memory_of_run(), starts_anew=starts_anew)

    run_live(coming, run, out, LIVE_FILES, sinks=sinks)


def fit_signals_command(
    recording: Recording,
    out: FittedOut = None,
    frame_samples: FrameSamples = None,
    hop_samples: HopSamples = None,
    channel: Channel = None,
    raw: RawAs = None,
    start: Start = 0,
    stop: Stop = None,
) -> None:
    """Fit an object's size to a recording, and whether its noise is white; then: track signal --config."""
    frames = open_signal(
        recording, frame_samples=frame_samples, hop_samples=hop_samples, channel=channel, start=start, stop=stop,
        raw=raw,
    )  # fmt: skip
    with bar("frames", None if frames.length is None else len(SIZES) * frames.length) as advance:
        fitted = fit_signal(frames, advance)
    tell_fitted("signal", frames.name, fitted, out)
