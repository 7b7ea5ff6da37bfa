"""From a sequence of frames to a track and the probability, in each frame, that a target is there.

The frames are whitened where the sensor model asks for it, then filtered; existence decides about tracks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from elusive.contracts import VX, VY, Array, Filter, X, Y
from elusive.errors import DataError
from elusive.filters import BernoulliFilter, ExistenceParticleFilter, MeasurementBirth, UniformBirth
from elusive.filters.recorded import RecordedFilter, RecordedFrames
from elusive.io import FrameSource, TrackRow, atomic_folder, write_mot_csv, write_netcdf, write_tracks_csv
from elusive.model import Model, over_default
from elusive.motion import ConstantVelocity, WithIntensity
from elusive.report import FrameKeeper, Tracked, write_html, write_png
from elusive.runner import collect, run
from elusive.sensors import ClutterSensor, ImageSensor
from elusive.tracking import Lifecycle

LEAST_PIXELS = 48 * 48  # of a frame whose noise is estimated from itself


class ImageTracking(RecordedFrames):
    """Everything `elusive track images` can be told; the defaults are for recorded frames.

    The filter's sensor decides how frames are taken: ``clutter``, as recorded, to be whitened against earlier ones
    (velocities are then relative to the scene); ``white``, as they are, with white noise of a known deviation about
    zero. What is given in part keeps these defaults for the rest.
    """

    filter: Annotated[BernoulliFilter | ExistenceParticleFilter, Field(discriminator="kind")] = Field(
        BernoulliFilter(
            motion=WithIntensity(motion=ConstantVelocity(q=0.0025)),
            sensor=ClutterSensor(),
            birth=MeasurementBirth(snr_db=11.1, max_speed=4.0),
            death_probability=0.1,
            particles=3000,
            newborns=1500,
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
        return {
            name: over_default(defaults[name], value) if isinstance(defaults.get(name), Model) else value
            for name, value in given.items()
        }

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
            if sensor.lowest_snr is None and isinstance(self.filter.birth, UniformBirth):
                sensor = sensor.replace(lowest_snr=sensor.intensity_of(self.filter.birth.snr_db))
        return self.replace(filter=self.filter.replace(sensor=sensor))

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
        if not isinstance(self.filter.sensor, ClutterSensor):
            return self.filter
        prepared = {name: getattr(self, name) for name in RecordedFrames.model_fields}
        return RecordedFilter(detector=self.filter, **prepared)


class FrameTrack(NamedTuple):
    """What is known after a frame, in pixels and pixels a frame."""

    existence: float
    mean: Array  # (d,) given presence
    covariance: Array  # (d, d) given presence
    track: int | None
    status: str


def track_images(frames: Iterable[Array | None], parameters: ImageTracking) -> Iterator[FrameTrack]:
    """Track one target through frames, lazily; a live stream and a file are the same.

    Parameters
    ----------
    frames
        ``(rows, columns)`` each; ``None`` where one is missing, NaN where a pixel is masked.
    parameters
        The filter, with a sensor of the frames' size (see :meth:`ImageTracking.fitted_to`), and the tracks' levels.

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
    life = lifecycle.init()
    rng = np.random.default_rng(parameters.seed)
    for state in run(parameters.build(), frames, rng):
        life = lifecycle.step(life, state.existence)
        yield FrameTrack(state.existence, state.mean, state.covariance, life.track, life.status)


def row_of(result: FrameTrack, time_s: float, rate_hz: float | None) -> TrackRow:
    """Lay a result out as a row of the table; speeds are a second where the rate is known, else a frame."""
    if result.track is None:
        return TrackRow(time_s, None, "none", result.existence)
    rate = 1.0 if rate_hz is None else rate_hz
    x, y = result.mean[[X, Y]]
    vx, vy = rate * result.mean[[VX, VY]]
    sd_x, sd_y = np.sqrt(np.maximum(np.diag(result.covariance)[[X, Y]], 0.0))
    return TrackRow(time_s, result.track, result.status, result.existence, *map(float, (x, y, vx, vy, sd_x, sd_y)))


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
    rows: list[TrackRow] = []
    results: list[FrameTrack] = []

    def watched() -> Iterator[Array]:
        for number, frame in enumerate(source):
            keeper.offer(number, frame)
            yield frame

    with atomic_folder(out) as folder:
        for result in track_images(watched(), fitted):
            rows.append(row_of(result, source.time_s(len(rows)), source.rate_hz))
            results.append(result)
            if on_frame is not None:
                on_frame(len(rows))
        after = source.start + len(rows)
        if truth is not None and len(truth) < after:
            raise DataError(
                f"truth: has {len(truth)} rows for {after} frames; give one row a frame of the file, nan nan if absent."
            )
        times = np.array([row.time_s for row in rows])
        dataset = collect(results, state_names=fitted.filter.state_names, times_s=times.tolist())
        dataset["track"] = ("time", [0 if row.track is None else row.track for row in rows])
        dataset["status"] = ("time", [row.status for row in rows])
        dataset.attrs = {"title": source.name, "units": "px, px/frame", "config": fitted.to_yaml()}
        write_tracks_csv(folder / "tracks.csv", rows)
        write_mot_csv(folder / "tracks_mot.csv", rows, sigma_px=fitted.spread_px, rate_hz=source.rate_hz)
        write_netcdf(folder / "result.nc", dataset)
        (folder / "config.yaml").write_text(fitted.to_yaml(), encoding="utf-8")
        tracked = tracked_of(
            source.name, rows, source.shape, source.rate_hz, None if truth is None else truth[source.start : after]
        )
        write_png(folder / "report.png", tracked, keeper)
        write_html(folder / "report.html", tracked, keeper)
    return Outcome(rows, tracked)


def tracked_of(
    title: str, rows: list[TrackRow], shape: tuple[int, int], rate_hz: float | None, truth: Array | None
) -> Tracked:
    """Gather a table of tracks for the report."""
    existence = np.array([row.existence for row in rows])
    living = np.array([row.status in ("candidate", "confirmed") for row in rows])
    estimate = np.where(living[:, None], [(row.x, row.y) for row in rows], np.nan)
    tracked = Tracked(
        Path(title).name or title,
        np.array([row.time_s for row in rows]),
        "frame" if rate_hz is None else "s",
        existence,
        estimate,
        np.where(living[:, None], [(row.sd_x, row.sd_y) for row in rows], np.nan),
        truth,
        shape,
        (),
    )
    return tracked._replace(rows=_table(rows, tracked))


def _table(rows: list[TrackRow], tracked: Tracked) -> list[tuple[str, str]]:
    confirmed = sorted({row.track for row in rows if row.status == "confirmed" and row.track is not None})
    table = [
        ("Frames", f"{len(rows)}, {tracked.shape[1]} x {tracked.shape[0]} pixels"),
        ("Is something there?", f"P above .5 in {int((tracked.existence > 0.5).sum())} of {len(rows)} frames"),
        ("Confirmed tracks", ", ".join(map(str, confirmed)) or "none"),
    ]
    first = next((row for row in rows if row.status == "confirmed"), None)
    if first is not None:
        when = f"frame {first.time_s:g}" if tracked.time_unit == "frame" else f"{first.time_s:.2f} s"
        table.append(("First confirmed", f"{when}, at x {first.x:.1f}, y {first.y:.1f}"))
    if tracked.truth is not None and tracked.error is not None:
        present = np.isfinite(tracked.truth[:, 0])
        near = (tracked.existence > 0.5) & (tracked.error < 4.0)
        if present.any():
            table.append(
                ("Found: P above .5, within 4 px", f"{100 * near[present].mean():.0f} % of the frames with it")
            )
        if (~present).any():
            false = (tracked.existence > 0.5)[~present].mean()
            table.append(("False: P above .5 without it", f"{100 * false:.0f} % of the frames without it"))
        if np.isfinite(tracked.error).any():
            table.append(("Error where tracked, RMS", f"{np.sqrt(np.nanmean(tracked.error**2)):.2f} px"))
    return table
