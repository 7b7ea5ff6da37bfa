"""What tracking came to: tracks over time, their files, and their scores against the truth; one way for all systems."""

from elusive.results.exports import write_geojson, write_mot_csv
from elusive.results.folder import write_recording
from elusive.results.log import ByTrack, TrackLog, read_tracks_csv, write_tracks_csv
from elusive.results.netcdf import write_result
from elusive.results.scores import Scored, Scores, score, scored
from elusive.results.table import CONFIRMED, DELETED, STATUSES, Columns, Unit, spread

__all__ = [
    "CONFIRMED",
    "DELETED",
    "STATUSES",
    "ByTrack",
    "Columns",
    "Scored",
    "Scores",
    "TrackLog",
    "Unit",
    "read_tracks_csv",
    "score",
    "scored",
    "spread",
    "write_geojson",
    "write_mot_csv",
    "write_recording",
    "write_result",
    "write_tracks_csv",
]
