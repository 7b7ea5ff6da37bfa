"""Readers and writers: image sequences in; tracks, datasets and truth in and out, whole or not at all."""

from elusive.io.atomic import atomic_folder, atomic_path
from elusive.io.exports import write_geojson, write_mot_csv, write_netcdf
from elusive.io.frames import FrameSource, open_frames
from elusive.io.tracks import TrackRow, read_tracks_csv, write_tracks_csv
from elusive.io.truth import read_truth

__all__ = [
    "FrameSource",
    "TrackRow",
    "atomic_folder",
    "atomic_path",
    "open_frames",
    "read_tracks_csv",
    "read_truth",
    "write_geojson",
    "write_mot_csv",
    "write_netcdf",
    "write_tracks_csv",
]
