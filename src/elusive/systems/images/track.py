"""From a sequence of frames to a track and the probability, in each frame, that a target is there.

The frames are whitened where the sensor model asks for it, then filtered; existence decides about tracks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import Array, Filter
from elusive.errors import DataError, ParameterError
from elusive.filters import BernoulliFilter, ExistenceParticleFilter, MeasurementBirth, UniformBirth
from elusive.filters.particle.recorded import RecordedFilter, RecordedFrames, RecordedState
from elusive.io import FrameSource, TrackRow, atomic_folder, write_mot_csv, write_netcdf, write_tracks_csv
from elusive.model import Model, over_default
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.preprocess.background import LEVELS
from elusive.runner import collect, run
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.systems.images.recurrent import RecurrentImages, SeveralState, SeveralTargets
from elusive.systems.images.report import FrameKeeper, Tracked, write_html, write_png
from elusive.systems.images.results import FrameTrack, rows_of, several_tracks, tracked_of
from elusive.tracking import Life, Lifecycle

LEAST_PIXELS = 48 * 48  # of a frame whose noise is estimated from itself


class ImageTracking(RecordedFrames):
    """Everything `elusive track images` can be told; the defaults are for recorded frames.

    The filter's sensor decides how frames are taken: ``clutter``, as recorded, to be whitened against earlier ones
    (velocities are then relative to the scene); ``white``, as they are, with white noise of a known deviation about
    zero. What is given in part keeps these defaults for the rest.
    """

    main_options: ClassVar[tuple[str, ...]] = (
        "filter", "sensor", "noise_sigma", "psf_sigma", "snr_db", "birth_probability", "motion", "max_speed",
        "particles", "seed",
    )  # fmt: skip

    filter: Annotated[BernoulliFilter | ExistenceParticleFilter | RecurrentImages, Field(discriminator="kind")] = Field(
        BernoulliFilter(
            motion=WithIntensity(motion=ConstantVelocity(q=0.0025)),
            sensor=ClutterSensor(),
            birth=MeasurementBirth(snr_db=11.1, max_speed=4.0),
            particles=6000,
            newborns=3000,
        ),
        description="Filter",
    )
    tracks: Lifecycle = Field(Lifecycle(), description="When a track begins and ends")
    seed: int = Field(0, ge=0, description="Root of all random numbers")

    @model_validator(mode="before")
    @classmethod
    def _keep_defaults(cls, given: Any) -> Any:
        """Fill what is given in part from this pipeline's defaults, not from those of the part's class."""
        if not isinstance(given, Mapping):
            return given
        defaults = {name: field.default for name, field in cls.model_fields.items()}
        other = given.get("filter")
        if isinstance(other, Mapping) and "sensor" not in other:
            # another filter looks at the same frames: without this it would take a recording for white noise
            given = {**given, "filter": {"sensor": defaults["filter"].sensor, **other}}
        return {
            name: over_default(defaults[name], value) if isinstance(defaults.get(name), Model) else value
            for name, value in given.items()
        }

    @model_validator(mode="after")
    def _takes_effect(self) -> Self:
        idle = {}
        if not isinstance(self.filter.sensor, ClutterSensor):
            idle = dict.fromkeys(RecordedFrames.model_fields, "frames taken as they are, which are not whitened")
        if isinstance(self.filter, RecurrentImages):
            others = ("tracks", "jitter_px", "clump_px")
            idle |= dict.fromkeys(others, "filter 'recurrent', whose tracks are those of its tracker")
        for name, reason in idle.items():
            if getattr(self, name) != type(self).model_fields[name].default:
                raise ParameterError(f"ImageTracking.{name}: has no meaning for {reason}; leave it out.")
        return self

    def fitted_to(self, shape: tuple[int, int]) -> ImageTracking:
        """Return the same with a sensor of the frames' size."""
        sensor = self.filter.sensor
        if not isinstance(sensor, ImageSensor | ClutterSensor):
            return self
        sensor = sensor.replace(rows=shape[0], columns=shape[1])
        if isinstance(sensor, ClutterSensor):
            if shape[0] * shape[1] < LEAST_PIXELS:
                raise DataError(
                    f"frames of {shape[1]} x {shape[0]} pixels are too few to learn the noise from; give its deviation "
                    "(--noise-sigma), and the frames are taken as they are, with white noise about zero."
                )
            if sensor.lowest_snr is None and self._sought_snr_db is not None:
                sensor = sensor.replace(lowest_snr=sensor.intensity_of(self._sought_snr_db))
        return self.replace(filter=self.filter.replace(sensor=sensor))

    @property
    def _sought_snr_db(self) -> float | None:
        """Peak SNR of the target sought, where the filter says [dB]."""
        if isinstance(self.filter, RecurrentImages):
            return self.filter.target_snr_db
        return self.filter.birth.snr_db if isinstance(self.filter.birth, UniformBirth) else None

    @property
    def spread_px(self) -> float:
        """Width of the point spread [px]; one where the sensor is a user's own."""
        sensor = self.filter.sensor
        return sensor.spread_px if isinstance(sensor, ImageSensor | ClutterSensor) else 1.0

    @property
    def lifecycle(self) -> Lifecycle:
        """When a track begins and ends; in recorded frames it must outlive what is not yet known to rest."""
        if not isinstance(self.filter.sensor, ClutterSensor):
            return self.tracks
        least = self.background.rest_lag + 2
        return self.tracks.replace(confirm_frames=max(self.tracks.confirm_frames, least))

    def build(self) -> Filter[Any, Array]:
        """Put the filter together that takes the frames."""
        if isinstance(self.filter, RecurrentImages):
            return SeveralTargets(self.filter, self.background)
        if not isinstance(self.filter.sensor, ClutterSensor):
            return self.filter
        prepared = {name: getattr(self, name) for name in RecordedFrames.model_fields}
        return RecordedFilter(detector=self.filter, **prepared)


def track_images(
    frames: Iterable[Array | None], parameters: ImageTracking, *, on_state: Callable[[Any], None] | None = None
) -> Iterator[FrameTrack]:
    """Track one target, or several, through frames, lazily; a live stream and a file are the same.

    Parameters
    ----------
    frames
        ``(rows, columns)`` each; ``None`` where one is missing, NaN where a pixel is masked.
    parameters
        The filter, with a sensor of the frames' size (see :meth:`ImageTracking.fitted_to`), and the tracks' levels.
    on_state
        Called with the filter's state after each frame, particles and all; nothing of it is kept here.

    Yields
    ------
    FrameTrack
        One a frame.

    Raises
    ------
    DataError
        If a frame has another size than the sensor.
    """
    lifecycle = parameters.lifecycle
    life, born = Life(), 0
    rng = np.random.default_rng(parameters.seed)
    for state in run(parameters.build(), frames, rng, start_s=-1.0):
        if on_state is not None:
            on_state(state)
        if isinstance(state, SeveralState):
            yield several_tracks(state)
            continue
        life, born = lifecycle.step(life, state.existence, born)
        seen = state.whitener.output if isinstance(state, RecordedState) else None
        quantiles = None if seen is None else seen.quantiles[0]
        yield FrameTrack(state.existence, state.mean, state.covariance, life.track, life.status or "none", quantiles)


class Outcome(NamedTuple):
    """What a tracked recording came to."""

    rows: list[TrackRow]
    tracked: Tracked


def track_recording(
    source: FrameSource,
    parameters: ImageTracking,
    out: Path,
    *,
    truth: Array | None = None,
    on_frame: Callable[[int], None] | None = None,
) -> Outcome:
    """Track a recording and write ``tracks.csv``, ``tracks_mot.csv``, ``result.nc``, ``report.html``, ``report.png``.

    ``config.yaml`` beside them repeats the run. Nothing is left in ``out`` if the recording cannot be used.

    Parameters
    ----------
    source
        From :func:`elusive.io.open_frames`.
    parameters
        What to do; the sensor takes its size from the source.
    out
        Folder for the results.
    truth
        ``(T, 2)`` x, y in pixels of each frame of the file, NaN where the target is absent; scores only.
    on_frame
        Called with the number of frames done.

    Raises
    ------
    DataError
        If a frame cannot be used, or the truth has fewer rows than there are frames.
    """
    fitted = parameters.fitted_to(source.shape)
    keeper = FrameKeeper()
    rows: list[list[TrackRow]] = []
    results: list[FrameTrack] = []

    def watched() -> Iterator[Array]:
        for number, frame in enumerate(source):
            keeper.offer(number, frame)
            yield frame

    with atomic_folder(out) as folder:
        for result in track_images(watched(), fitted):
            rows.append(rows_of(result, source.time_s(len(rows)), source.rate_hz))
            results.append(result)
            if on_frame is not None:
                on_frame(len(rows))
        after = source.start + len(rows)
        if truth is not None and len(truth) < after:
            raise DataError(
                f"truth: has {len(truth)} rows for {after} frames; give one row a frame of the file, nan nan if absent."
            )
        table = [row for of_frame in rows for row in of_frame]
        times = np.array([of_frame[0].time_s for of_frame in rows])
        dataset = collect(results, state_names=fitted.filter.state_names, times_s=times.tolist())
        dataset["track"] = ("time", [first.track or 0 for first, *_ in rows])
        dataset["status"] = ("time", [first.status for first, *_ in rows])
        if any(result.quantiles is not None for result in results):
            unknown = np.full(len(LEVELS), np.nan)
            measured = [unknown if result.quantiles is None else result.quantiles for result in results]
            dataset["whitened_quantiles"] = (("time", "level"), np.array(measured), {"units": "noise deviations"})
            dataset = dataset.assign_coords(level=list(LEVELS))
        dataset.attrs = {"title": source.name, "units": "px, px/frame", "config": fitted.to_yaml()}
        write_tracks_csv(folder / "tracks.csv", table)
        write_mot_csv(folder / "tracks_mot.csv", table, sigma_px=fitted.spread_px, rate_hz=source.rate_hz)
        write_netcdf(folder / "result.nc", dataset)
        (folder / "config.yaml").write_text(fitted.to_yaml(), encoding="utf-8")
        known = None if truth is None else truth[source.start : after]
        tracked = tracked_of(source.name, results, rows, source.shape, source.rate_hz, known)
        write_png(folder / "report.png", tracked, keeper)
        write_html(folder / "report.html", tracked, keeper)
    return Outcome(table, tracked)
