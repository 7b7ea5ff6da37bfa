"""Who is present, and where, over MQTT as home automation reads it: with discovery as Home Assistant has it."""

from __future__ import annotations

import json
import re
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from typing import Any

from elusive.errors import DataError
from elusive.io.sinks.formats import json_line
from elusive.io.sinks.outlet import CLOSING_S, HELD, HELD_OCTETS
from elusive.io.sinks.seen import Seen, Told
from elusive.io.sources.address import Address
from elusive.io.sources.mqtt import Contact, client_for

DISCOVERY = "homeassistant"
LONGEST_PREFIX = 1000  # octets; the format has 65535 for a topic


class Presence:
    """Publishes under a prefix: ``count``, ``presence`` (ON, OFF), ``tracks`` and ``track/<number>``, retained.

    A track that has ended is told as absent and its topic cleared. ``status`` is ``online``, or ``offline`` once the
    run has ended, however that came.

    Parameters
    ----------
    address
        Of the broker; its path is the prefix.
    unit
        Of the tracks' places.
    say
        Told when the broker goes and comes back.
    """

    def __init__(self, address: Address, unit: str, say: Callable[[str], None]) -> None:
        self.name, self.counts = address.text, Counter[str]()
        self._prefix, self._unit, self._say = address.path.strip("/"), unit, say
        long = len(self._prefix.encode()) > LONGEST_PREFIX
        if not self._prefix or long or self._prefix.startswith("$") or set("+#\0") & set(self._prefix):
            raise DataError(
                f"{address.text}: names no topic to write under, without +, # and a leading $; write mqtt://{address.host}/site."
            )
        self._client: Any = client_for(address)
        self._client.max_queued_messages_set(0)  # what waits is counted here, by octets too
        self._contact = Contact(address, say)
        self._waits, self._octets, self._turn = deque[int](), 0, threading.Lock()  # sizes, in the order they are taken
        self._client.will_set(f"{self._prefix}/status", "offline", qos=1, retain=True)
        self._client.on_connect, self._client.on_disconnect = self._joined, self._gone
        self._client.on_publish, self._client.on_connect_fail = self._published, self._never
        self._latest: int | None = None
        self._owed: dict[str, str] = {}  # retained topics that another value stands under, by what they should say
        self._discovery = address.options.get("discovery", DISCOVERY)
        self._closed = self._is_full = False
        self._client.connect_async(address.host, address.port)
        self._client.loop_start()

    def prepared(self, told: Told) -> Callable[[], None]:
        """Return what publishes a step."""
        return lambda: self._tell(told)

    def _tell(self, told: Told) -> None:
        for topic, payload in list(self._owed.items()):
            self._publish(topic, payload, retain=True)
        present = [seen for seen in told.seen if seen.status == "confirmed"]
        for seen in told.ended:
            self._publish(f"track/{seen.track}", json_line({"track": seen.track, "present": False}))
            self._publish(f"track/{seen.track}", "")
        for seen in present:
            self._publish(f"track/{seen.track}", json_line(self._where(seen)), retain=True)
        if self._latest != len(present):
            self._latest = len(present)
            self._publish_count(self._latest)
        whole = {"unix_s": told.unix_s, "count": len(present), "tracks": [self._where(seen) for seen in present]}
        self._publish("tracks", json_line(whole), retain=True)

    def close(self) -> None:
        """Say that it ends, if the broker is there."""
        self._closed = True
        self._publish("status", "offline", retain=True)
        until_s = time.monotonic() + CLOSING_S
        while self.counts["sent"] < self.counts["published"] - self.counts["dropped"] and time.monotonic() < until_s:
            time.sleep(0.02)
        left = self.counts["published"] - self.counts["dropped"] - self.counts["sent"]
        if left > 0:
            self._say(f"{self.name}: {left} messages could not be sent any more.")
        self._client.disconnect()
        self._client.loop_stop()

    def _where(self, seen: Seen) -> dict[str, Any]:
        told: dict[str, Any] = {"track": seen.track, "present": True, "existence": seen.existence}
        told |= {
            f"x_{self._unit}": round(seen.x, 3),
            f"y_{self._unit}": round(seen.y, 3),
            "age_s": round(seen.age_s, 3),
        }
        if seen.lon_deg == seen.lon_deg:
            told |= {"longitude": round(seen.lon_deg, 7), "latitude": round(seen.lat_deg, 7)}
        return told

    def _publish_count(self, present: int) -> None:
        self._publish("count", str(present), retain=True)
        self._publish("presence", "ON" if present else "OFF", retain=True)

    def _publish(self, topic: str, payload: str, *, retain: bool | None = None) -> None:
        keep = payload == "" if retain is None else retain  # an empty message that is retained clears a topic
        if not self._send(f"{self._prefix}/{topic}", payload, retain=keep):
            if not self._is_full:
                self._say(f"{self.name}: {len(self._waits)} messages wait, as many as are held; newer ones are lost.")
            self._is_full = True
            self.counts["dropped"] += 1
            if keep:
                self._owed[topic] = payload
        elif keep:
            self._owed.pop(topic, None)

    def _send(self, topic: str, payload: str, *, retain: bool) -> bool:
        """Publish, if not too much waits to be taken."""
        size = len(topic.encode()) + len(payload.encode())
        with self._turn:
            self.counts["published"] += 1
            if len(self._waits) >= HELD or self._octets + size > HELD_OCTETS:
                return False
            self._waits.append(size)
            self._octets += size
        self._client.publish(topic, payload, qos=1, retain=retain)
        return True

    def _published(self, *_: Any) -> None:
        with self._turn:
            self.counts["sent"] += 1
            self._octets -= self._waits.popleft()
            self._is_full &= bool(self._waits)

    def _joined(self, _: Any, __: Any, ___: Any, code: Any, *____: Any) -> None:
        if code.is_failure:
            self._contact.refused(code)
            return
        self._contact.joined(
            f"; {len(self._waits)} messages that waited are sent now, {self.counts['dropped']} were lost"
        )
        self.counts["joined"] += 1
        self._publish("status", "online", retain=True)
        if self._latest is not None:  # a broker that was started anew may have forgotten
            self._publish_count(self._latest)
        for kind, config in self._entities():
            topic = f"{self._discovery}/{kind}/{config['unique_id']}/config"
            if self._discovery:
                self._send(topic, json.dumps(config), retain=True)

    def _never(self, *_: Any) -> None:
        if not self._closed:
            self._contact.unanswered()

    def _gone(self, *_: Any) -> None:
        if not self._closed:
            self._contact.gone()

    def _entities(self) -> list[tuple[str, dict[str, Any]]]:
        """Return what home automation is told of: how many, and whether anybody is there."""
        site = re.sub(r"[^A-Za-z0-9_-]", "_", self._prefix)
        shared = {
            "availability_topic": f"{self._prefix}/status",
            "device": {
                "identifiers": [f"elusive_{site}"],
                "name": f"elusive {self._prefix}",
                "manufacturer": "elusive",
            },
        }
        count = {
            "name": "Present",
            "unique_id": f"elusive_{site}_count",
            "state_topic": f"{self._prefix}/count",
            "state_class": "measurement",
            "json_attributes_topic": f"{self._prefix}/tracks",
        }
        presence = {
            "name": "Presence",
            "unique_id": f"elusive_{site}_presence",
            "state_topic": f"{self._prefix}/presence",
            "device_class": "occupancy",
        }
        return [("sensor", count | shared), ("binary_sensor", presence | shared)]
