"""Whether a recording of frames looks as its models say: its order, its length, its scene, its noise."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from elusive.checks import Fact, Finding
from elusive.contracts import Array
from elusive.preprocess.peaks import LEVELS
from elusive.sensors import ImageSensor
from elusive.systems.images.folded import Folded
from elusive.systems.images.frame_facts import FrameFacts
from elusive.systems.images.left_over import LeftOver
from elusive.systems.images.movers import Movers
from elusive.systems.images.octets import Octets
from elusive.systems.images.parameters import ImageTracking
from elusive.systems.images.peaks import PeakImages, PeaksState
from elusive.systems.images.recorded_checks import again_finding, recorded_findings
from elusive.systems.images.scene_facts import SceneFacts
from elusive.systems.images.several import SeveralImages
from elusive.systems.images.swift import Swift
from elusive.systems.images.white_checks import white_findings
from elusive.systems.images.writing import Writing
from elusive.tracking import Step

NOTHING: Mapping[float, float] = MappingProxyType({})
CLEAR = 4.0  # point spreads about a track in which no noise is read
REPEATED = 0.1  # share of frames that are their predecessor
ODD, SUSPECT = 0.03, 0.7  # change along an axis of a frame over that along time: another order; if its shape is odd too
ASPECT = 2.4  # of a frame's sides, from which no camera is so
OFTEN = 0.1  # share of frames that show nothing, from which that is no accident
ORDER = "Save the array as (time, row, column): numpy.moveaxis(frames, -1, 0) where time is last."


class FrameChecks:
    """Takes a run's steps and says what its frames say of what it assumed."""

    def __init__(self, parameters: ImageTracking) -> None:
        self.parameters, self.noise, self.scene = parameters, FrameFacts(), SceneFacts()
        self._sensor = sensor = parameters.sensor
        self._quantiles, self._whitened = np.zeros(len(LEVELS)), 0  # of whitened pixels, summed over so many frames
        self._left: LeftOver | None = None
        self._movers, self._writing, self._octets, self._folded = Movers(), Writing(), Octets(), Folded()
        self._swift = Swift()
        self._taken, self._blank_s = 0, list[float]()  # frames, and the times of those that show nothing
        self._again = math.nan, 0  # share of sure tracks that were there again, and of how many
        if isinstance(sensor, ImageSensor) and sensor.noise == "gaussian":
            self._left = LeftOver(sensor)

    @property
    def _peaks(self) -> bool:
        return isinstance(self.parameters.filter, PeakImages)

    def take(self, step: Step) -> None:
        """Take a step; of one without a frame it is kept that there was none."""
        self._taken += 1
        if step.measurement is None:
            self._blank_s.append(step.time_s)
            return
        self.add(step.measurement, places_of(step))
        if isinstance(step.state, PeaksState) and step.state.peaks is not None:
            self._quantiles += step.state.peaks.quantiles
            self._whitened += 1
            self._movers.take(step.state.belief)
            self._swift.take(step.state.peaks, step.state.belief.targets)
            self._writing.take(step.state.found.overlays, step.measurement.shape)
            if isinstance(self.parameters.filter, PeakImages):
                self._again = self.parameters.filter.persistence.sure_again(step.state.belief.reliability)

    def add(self, frame: Array, places: Iterable[tuple[float, float]] = ()) -> None:
        """Take a frame ``(rows, columns)``, and where tracks are in it, x, y."""
        self._octets.add(frame)
        self._folded.add(frame)
        if isinstance(self._sensor, ImageSensor):
            frame, places = self.parameters.levelled(frame), list(places)
            self.noise.add(frame, places, CLEAR * self.parameters.spread_px)
            if self._left is not None:
                self._left.add(frame, places)
        else:
            self.noise.look(frame)
            self.scene.add(frame)

    def findings(self, whitened: Mapping[float, float] = NOTHING) -> tuple[Finding, ...]:
        """Return what there is to say.

        Parameters
        ----------
        whitened
            Mean quantile of the whitened pixels, by its probability, where frames were whitened.
        """
        octets = self._octets.finding()
        found = [order_finding(self.noise, self.noise.count), octets, _copies(self.noise)]
        found.append(blank_finding(self._blank_s, self._taken))
        if octets.holds:  # swapped, the lower one leads, and folds
            found.append(self._folded.finding())
        if isinstance(self._sensor, ImageSensor):
            found += white_findings(self._sensor, self.parameters, self.noise)
            if self._left is not None and all(one.holds for one in found):  # else noise itself may stand out
                found += self._left.findings(grave=isinstance(self.parameters.filter, SeveralImages))
        else:
            if self._peaks and self._whitened:
                whitened = dict(zip(LEVELS, (self._quantiles / self._whitened).tolist(), strict=True))
            found += recorded_findings(self.scene, whitened, self._movers.standing() if self._peaks else None)
            if self._peaks:
                found += [again_finding(*self._again), *self._movers.findings(), self._writing.finding()]
                found.append(self._swift.finding())
        return tuple(found)


def blank_finding(blank_s: Sequence[float], count: int) -> Finding:
    """Say how many of all frames show nothing, by their times."""
    share, first = (len(blank_s) / count, f"{blank_s[0]:g}") if blank_s else (0.0, "")
    return Fact(0.0, share, not blank_s, count).finding(
        "frames.blank",
        f"Nothing is to be seen in {len(blank_s)} of {count} frames, the first at time {first}: pixels are all alike, "
        "or most have no value. They were passed over, and tracks are predicted through them.",
        "A shutter or a lost connection does that; else check how the frames were exported.",
        grave=share > OFTEN,
    )


def places_of(step: Step) -> Iterator[tuple[float, float]]:
    """Yield where a step's tracks are that may well be there."""
    for track in step.tracks:
        if track.status != "deleted" and not track.existence < 0.5 and np.isfinite(track.mean[[0, 2]]).all():
            yield float(track.mean[0]), float(track.mean[2])


def order_finding(facts: FrameFacts, count: int) -> Finding:
    """Find time among a frame's own axes: along it a scene changes least; few frames look like a narrow picture.

    Parameters
    ----------
    facts
        Of the frames that were looked at.
    count
        Frames of the whole recording.
    """
    rows, columns = facts.shape
    time, x, y = np.median(np.array(facts.steps).reshape(-1, 3), axis=0).tolist() if facts.steps else (math.nan,) * 3
    ratio = min(x, y) / time if time > 0 else math.nan
    least, most = sorted(facts.shape)
    alike = count == most > least  # as many frames as rows: of a square camera's
    odd = ratio < ODD or (ratio < SUSPECT and (alike or most > ASPECT * least))
    axis = f"{columns} columns" if least == columns else f"{rows} rows"
    if ratio < ODD:
        axis = f"{columns} columns" if x < y else f"{rows} rows"
    why = f"change {ratio:.2g} times as much from one to the next as frames do" if odd else "are fewer than the frames"
    fact = Fact(1.0, ratio, not (odd or alike), len(facts.steps))
    return fact.finding(
        "frames.axes",
        f"A frame's {axis} {why}, as if they were times: {count} frames of {columns} x {rows} pixels look like "
        "an array in another order of axes.",
        ORDER,
        grave=odd,
    )


def _copies(facts: FrameFacts) -> Finding:
    """Find frames that are copies: their noise is no new evidence."""
    pairs = facts.count - 1
    share = facts.repeated / pairs if pairs else 0.0
    return Fact(0.0, share, not share > REPEATED, pairs).finding(
        "frames.repeated",
        f"{facts.repeated} of {pairs} frames are copies of the one before: they are passed over as missing, and show "
        "nothing new of a track.",
        "Export the recording at the rate at which it was taken, and give that as --rate-hz.",
        grave=False,
    )
