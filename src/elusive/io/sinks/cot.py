"""Cursor-on-Target 2.0 events (MITRE MP090284), which TAK shows: a track an event, stale once it has ended."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from elusive.io.sinks.seen import Seen, Told

UNKNOWN = 9_999_999.0  # of a height or an error, by the format
DEVIATIONS = 2.0  # of the circular error


class Cot(NamedTuple):
    """Writes confirmed tracks."""

    uid: str  # a track's identity is ``<uid>.<number>``
    kind: str  # type of the events: a-u-S, something unknown on the sea
    stale_s: float  # after which a track of which nothing more is heard is not shown as current

    def events(self, told: Told) -> Iterator[bytes]:
        """Yield the events of a step."""
        for seen in told.seen:
            if seen.status == "confirmed":
                yield self._event(seen, told.unix_s, self.stale_s)
        for seen in told.ended:
            yield self._event(seen, told.unix_s, 0.0)

    def _event(self, seen: Seen, unix_s: float, stale_s: float) -> bytes:
        time, stale = _moment(unix_s), _moment(unix_s + stale_s)
        error = UNKNOWN if math.isnan(seen.sd) else DEVIATIONS * seen.sd
        sure = "" if math.isnan(seen.existence) else f"existence {seen.existence:.4f}, "
        ended = " ended," if stale_s == 0.0 else ""
        remarks = f"track {seen.track},{ended} {sure}age {seen.age_s:.1f} s"
        course, speed = (0.0 if math.isnan(value) else value for value in (seen.course_deg, seen.speed_mps))
        return (
            '<?xml version="1.0" encoding="UTF-8" standalone="yes"?>'
            f'<event version="2.0" uid={quoteattr(f"{self.uid}.{seen.track}")} type={quoteattr(self.kind)} how="m-f"'
            f' time="{time}" start="{time}" stale="{stale}">'
            f'<point lat="{seen.lat_deg:.7f}" lon="{seen.lon_deg:.7f}" hae="{UNKNOWN}" ce="{error:.1f}"'
            f' le="{UNKNOWN}"/><detail><contact callsign={quoteattr(f"{self.uid} {seen.track}")}/>'
            f'<track course="{course:.2f}" speed="{speed:.3f}"/><remarks>{remarks}</remarks></detail></event>\n'
        ).encode()


def _moment(unix_s: float) -> str:
    return datetime.fromtimestamp(unix_s, UTC).strftime("%Y-%m-%dT%H:%M:%S.%f")[:23] + "Z"
