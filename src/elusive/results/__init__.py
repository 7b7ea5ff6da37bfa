"""What tracking came to: tracks over time, their files, and their scores against the truth; one way for all systems."""

from elusive.results.exports import write_geojson, write_mot_csv
from elusive.results.log import ByTrack, TrackLog, read_tracks_csv, write_tracks_csv
from elusive.results.netcdf import write_result
from elusive.results.scores import Scores, known_truth, score
from elusive.results.table import STATUSES, Columns, Unit, spread

__all__ = [
    "STATUSES",
    "ByTrack",
    "Columns",
    "Scores",
    "TrackLog",
    "Unit",
    "known_truth",
    "read_tracks_csv",
    "score",
    "spread",
    "write_geojson",
    "write_mot_csv",
    "write_result",
    "write_tracks_csv",
]
