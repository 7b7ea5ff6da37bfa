"""Where live tracks go: lines, NMEA, Cursor-on-Target, MQTT and MOT, each to several places at once.

A sink is named by its format and where it goes: ``ndjson:tracks.ndjson``, ``geojson+tcp://127.0.0.1:5002``,
``nmea+udp://127.0.0.1:10110``, ``cot+udp://239.2.3.1:6969``, ``mqtt://127.0.0.1/site``, ``mot:tracks.txt``.
"""

from elusive.io.sinks.opening import Sinks, open_sinks
from elusive.io.sinks.seen import Ground, Seen

__all__ = ["Ground", "Seen", "Sinks", "open_sinks"]
