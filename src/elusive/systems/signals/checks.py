"""Whether a signal looks as its models say: white noise of even levels, enough of it, the axes in order."""

from __future__ import annotations

import math

import numpy as np

from elusive.checks import Fact, Finding
from elusive.preprocess.contrast import contrast
from elusive.preprocess.standardise import LEAST_FRAMES
from elusive.preprocess.windows import ChiSquare, DotProduct, LikelihoodRatio
from elusive.systems.signals.facts import MANY, MEMORY, SignalFacts
from elusive.systems.signals.parameters import SignalTracking

FEW = 20  # frames in which hardly anything accumulates
LEAST_SHARE = 0.25  # of the likelihood ratio's contrast, four times: sixteen times the frames
OWN = {made.model_fields["kind"].default: made.model_fields["boundaries"].default for made in (ChiSquare, DotProduct)}
WINDOWS = 8  # of a frame at least, for its noise to be known
SILENT = 0.5  # share of frames that are gaps, from which a run says little
TURN = "Save the array as (time, sample): signal.T in NumPy."
ESTIMATE = "Let it be estimated (--noise estimated)"


def findings_of(parameters: SignalTracking, facts: SignalFacts) -> tuple[Finding, ...]:
    """Return what a run's frames say of what it assumed."""
    return (
        _colour(parameters, facts),
        _levels(parameters, facts),
        _alarms(parameters, facts),
        _bursts(facts),
        _followed(facts),
        _clutter(parameters, facts),
        _alike(facts),
        _quieter(parameters, facts),
        _rest(parameters, facts),
        _axes(facts),
        _interleaved(facts),
        *_length(parameters, facts),
        _silent(facts),
        _even(facts),
        _boundaries(parameters, facts),
    )


def _remedy(parameters: SignalTracking, else_do: str) -> str:
    if parameters.noise == "white":
        return f"{ESTIMATE}."
    return (
        f"Leave --calibration-frames out, or give more of them; {else_do}" if parameters.calibration_frames else else_do
    )


def _colour(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Look for colour that is left over."""
    fact = facts.along
    return fact.finding(
        "signals.colour",
        f"Samples near each other correlate by {fact.seen:.2f} where white noise does not: coloured noise is left "
        "over, and its false alarms are more than asked for.",
        _remedy(parameters, "give longer frames, from which a spectrum is known better."),
    )


def _levels(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Look for levels that differ between samples, or drift."""
    fact, trend = facts.stays, facts.trend
    if fact.holds and not trend.holds:
        return trend.finding(
            "signals.levels",
            f"Squares of samples farther apart than an object is long correlate by {trend.seen:.3f}: the level changes "
            "along a frame, and where it is high noise looks like objects.",
            _remedy(parameters, "give shorter frames, along which it changes less."),
        )
    return fact.finding(
        "signals.levels",
        f"What stays at a place over {MEMORY} frames varies {fact.seen:.1f} times as much as noise of one level does: "
        "the samples are not equally loud, or their levels drift, and loud ones are found as objects at rest.",
        _remedy(parameters, "leave out the samples that are louder than the others."),
    )


def _alarms(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Count what stands out for a moment, more often than noise of the kind that is assumed does."""
    fact = facts.alarms(parameters.false_alarm.probability)
    return fact.finding(
        "signals.alarms",
        f"In {fact.seen:.1%} of the frames something stood out that was gone before it could be believed, where "
        f"{fact.expected:.2g} of them was asked for: bursts that come and go, or noise far from Gaussian. Short tracks "
        "are chance as like as not.",
        "Do not rely on tracks that last no longer than the filter's memory; a smaller --clip holds bursts down.",
    )


def _bursts(facts: SignalFacts) -> Finding:
    """Look for what stands out in one frame and is no track: noise does not."""
    fact = facts.bursts
    return fact.finding(
        "signals.bursts",
        f"In {fact.seen:.0%} of the frames something stands out in that frame alone that is no track, in noise in "
        f"{fact.expected:.0%}: bursts that come and go, objects faster than --max-velocity, or noise far from "
        "Gaussian. They make alarms and tracks of their own.",
        "A smaller --clip (2) holds bursts down; do not rely on tracks that last no longer than the filter's memory.",
        grave=facts.believed,
    )


def _even(facts: SignalFacts) -> Finding:
    """Say where samples are all as large, so that nothing can be louder."""
    fact = facts.even
    return fact.finding(
        "signals.even",
        f"All samples are about as large: their squares vary by {fact.seen:.2g}, those of noise by "
        f"{fact.expected:g}. The signal was limited or rounded to its sign, and an object that is louder leaves no "
        "trace; or its bytes are read in another order.",
        "Record with more bits, or before the limiter; --raw takes little-endian samples.",
    )


def _boundaries(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Say where the boundaries told leave next to nothing of what tells an object."""
    statistic, kind = parameters.statistic, parameters.statistic.kind
    share = 1.0
    if isinstance(statistic, ChiSquare | DotProduct) and statistic.boundaries != OWN[kind] and facts.levels:
        level = math.exp(0.5 * float(np.median(facts.levels)))
        share = contrast(statistic, level) / contrast(LikelihoodRatio(window=statistic.window))
    return Fact(1.0, share, share >= LEAST_SHARE, facts.frames).finding(
        "signals.boundaries",
        f"With the boundaries told, {kind} tells an object as loud as the noise {share:.0%} as far from it as its "
        "likelihood ratio does, by chance nearly: louder samples must cross a boundary, and these lie where noise is.",
        "Leave --boundaries out, or put the outermost at two deviations; --statistic llr needs none.",
    )


def _followed(facts: SignalFacts) -> Finding:
    """Say where levels are followed so fast that what rests is taken for a level."""
    fact = facts.followed
    return fact.finding(
        "signals.drift",
        f"The samples' levels drift: in {fact.seen:.0%} of the frames each was taken from the latest ones, so that an "
        f"object that stays at a place for {MEMORY} frames is taken for a level, and is not found.",
        "Where levels are known to be steady, --noise white; where frames without an object are, --calibration-frames.",
        grave=False,
    )


def _clutter(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Say where the level of the noise lasts or travels, as clutter's does, so that objects must be louder."""
    errs, smoothing = 1.0, parameters.recursion.smoothing
    if parameters.calibration_frames:
        # the energy of a sample errs by the variance of one frame's over the frames, and by the same in all of them
        errs = math.sqrt(1 + (1 + smoothing) / (1 - smoothing) / parameters.calibration_frames)
    fact = facts.clutter(errs)
    return fact.finding(
        "signals.clutter",
        f"Noise accumulates to up to {fact.seen:.1f} times as much as white noise does: its level lasts for some "
        "frames, or travels, as that of clutter. Scores are held against it, and an object along such a velocity has "
        "to be that much louder to be found.",
        "A smaller --smoothing forgets sooner what lasts; --max-velocity and a longer --object-size leave some out.",
        grave=False,
    )


def _alike(facts: SignalFacts) -> Finding:
    """Tell one source whose loudness repeats from many objects."""
    fact = facts.alike
    evenly = "" if fact.seen >= MANY else " and stand evenly apart"
    return fact.finding(
        "signals.alike",
        f"{fact.seen:.0f} tracks at once have one velocity{evenly}: they may be one source whose loudness repeats (a "
        "rotor, a propeller, rectified mains, a pulse) at a period that does not fit the frame, and no objects on "
        "their way.",
        "Look at the spectrum of the squared samples for a line, or choose --frame-samples of whole periods, in which "
        "what repeats is at rest.",
        grave=False,
    )


def _quieter(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Say where something moves that has less noise than what is about it."""
    fact, statistic = facts.quieter(parameters.false_alarm.probability), parameters.statistic
    if not isinstance(statistic, LikelihoodRatio) or statistic.mode == "replacing":
        fact = fact._replace(holds=True)  # of these noise's evidence may be as far below its mean as above
    return fact.finding(
        "signals.quieter",
        f"Along a path evidence lies {-fact.seen:.0f} deviations below noise's, as far as an object's above it: "
        "something moves there that is quieter than the noise about it, or hides it, and objects are sought louder.",
        "--mode replacing --object-deviation 0.3 seeks what has .3 of the noise's deviation (in the signal's units).",
        grave=False,
    )


def _rest(parameters: SignalTracking, facts: SignalFacts) -> Finding:
    """Say where a track rests, for so does a sample that is louder than others."""
    fact = facts.rest
    told = "; --noise white or --calibration-frames takes levels as known" if parameters.noise == "estimated" else ""
    return fact.finding(
        "signals.rests",
        f"{fact.seen:.0f} of the sure tracks rest, as far as is seen: an object at rest is not told from samples that "
        "are louder than others, a tone or a channel of its own; short tracks beside one are of it as like as not.",
        f"Look at moves in tracks.csv, at the report with --show all, and at what is received there{told}.",
        grave=False,
    )


def _axes(facts: SignalFacts) -> Finding:
    """Tell an array whose axes are (sample, time) by what belongs to time and to samples."""
    in_time, unordered, goes_on = facts.in_time, facts.unordered, facts.goes_on
    if in_time.holds and not goes_on.holds:
        return goes_on.finding(
            "signals.axes",
            f"Samples at the same place in frames after one another correlate by {goes_on.seen:.2f}, and neighbours "
            "within a frame do not: the noise changes more slowly than frames come, or the axes are (sample, time).",
            f"{TURN} If the axes are right, there is nothing to do: what the frames before predict is taken out.",
            grave=False,
        )
    if in_time.holds and not unordered.holds:
        return unordered.finding(
            "signals.axes",
            f"Frames differ in loudness {unordered.seen:.0f} times as much as noise does, and in no order, as samples "
            "of an array do whose channels are not equally loud: its axes may be (sample, time).",
            TURN,
            grave=False,
        )
    return in_time.finding(
        "signals.axes",
        f"Samples at the same place in frames after one another correlate by {in_time.seen:.2f}: the array's axes are "
        "(sample, time), or its noise changes more slowly than frames come; every place looks like an object then.",
        f"{TURN} Or take every n-th frame, so that they are independent.",
    )


def _interleaved(facts: SignalFacts) -> Finding:
    """Tell two signals whose samples come in turn, and a real one read as I and Q."""
    contrast, skipped, paired = facts.interleaved
    if paired:
        sentence = (
            f"I and Q correlate by {paired:.2f}, and Q with the I after it as much: neighbours of one real signal, "
            "whose samples were read as I and Q in turn. Frames have half its samples, and velocities are half as fast."
        )
        remedy = "Read the samples as real: signal.view(float) in NumPy, --raw without its c."
    else:
        seen = (
            f"Even and odd samples differ by {contrast:.2f} of the power"
            if contrast
            else f"Samples two apart correlate by {skipped:.2f}, and those one and three apart do not"
        )
        sentence = (
            f"{seen}: two signals seem to come in turn, two channels or I and Q. An object has twice its length then, "
            "and moves twice as fast; each signal is the other's noise."
        )
        remedy = "Give one channel, signal[..., ::2] in NumPy; of I and Q signal[..., ::2] + 1j * signal[..., 1::2]."
    worst = max(contrast, skipped, abs(paired))
    return Fact(0.0, worst, worst == 0.0, facts.frames).finding("signals.interleaved", sentence, remedy, grave=False)


def _length(parameters: SignalTracking, facts: SignalFacts) -> tuple[Finding, Finding]:
    """Say where there is too little to know what noise does."""
    window, frames = parameters.statistic.window, facts.frames - facts.gaps
    few = Fact(FEW, frames, frames >= FEW, frames).finding(
        "signals.few",
        f"There are {frames} frames that can be used: what noise alone accumulates to is hardly known from fewer than "
        f"{FEW}, and levels that differ are not told from objects.",
        "Give more frames; or cut a long recording into shorter ones (--frame-samples, --hop-samples).",
        grave=frames < FEW // 2,
    )
    least = WINDOWS * window
    calibration = parameters.calibration_frames
    memory = math.ceil(1 / (1 - parameters.recursion.smoothing) - 1e-9)
    if facts.samples >= least and 0 < calibration < max(memory, 2 * LEAST_FRAMES):
        sentence = (
            f"Calibration has {calibration} frames, less than the filter's memory of {memory}: a sample whose noise "
            "came out too low stands out ever after, and alarms are a few times as many as asked for."
        )
        short = Fact(memory, calibration, False, calibration)
        return few, short.finding("signals.short", sentence, "Give more --calibration-frames.", grave=False)
    short = Fact(least, facts.samples, facts.samples == 0 or facts.samples >= least, facts.samples)
    return few, short.finding(
        "signals.short",
        f"Frames have {facts.samples} samples, and the window {window}: in fewer than {least} an object is a large "
        "part of what the noise is learnt from.",
        "Give longer frames (--frame-samples), or a smaller --object-size.",
        grave=False,
    )


def _silent(facts: SignalFacts) -> Finding:
    """Say how much was not received."""
    share = facts.gaps / facts.frames if facts.frames else 0.0
    return Fact(0.0, share, facts.gaps == 0, facts.frames).finding(
        "signals.silent",
        f"{facts.gaps} of {facts.frames} frames are constant, half one value, or more than a quarter of their samples "
        "is missing: they count as gaps, over which nothing is found.",
        "Check the recording there; --start and --stop choose a part.",
        grave=share > SILENT,
    )
