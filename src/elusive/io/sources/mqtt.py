"""Messages of an MQTT broker's topics, as lines (paho-mqtt, the extra ``live``)."""

from __future__ import annotations

import queue
from collections.abc import Callable, Iterator
from typing import Any

from elusive.errors import DataError
from elusive.io.sources.address import Address
from elusive.io.sources.feed import LOOK_S, Feed

OPTIONS = ("columns",)
LONGEST_WAIT_S = 5  # between two tries to reach a broker
HELD = 10_000  # messages that wait at most
LONGEST = 1 << 20  # octets of a message


class Contact:
    """Says once what became of a broker, however often it is tried: none answers, it refuses, is gone, is back.

    Parameters
    ----------
    address
        Of the broker.
    say
        Told in a sentence.
    """

    def __init__(self, address: Address, say: Callable[[str], None]) -> None:
        self._name, self._say, self._by = address.text, say, " by TLS" * (address.scheme == "mqtts")
        self._is_joined, self._fault = False, ""

    def joined(self, more: str = "") -> None:
        """Take note that it has taken us in."""
        if self._fault:
            self._say(f"{self._name}: is back{more}.")
        self._is_joined, self._fault = True, ""

    def refused(self, why: object) -> None:
        """Take note that it refuses."""
        self._is_joined = False
        self._met(f"the broker refuses ({why})")

    def unanswered(self) -> None:
        """Take note that a try has failed."""
        if not self._fault:
            self._met(f"no broker answers there{self._by}")

    def gone(self) -> None:
        """Take note that the connection has ended."""
        if self._is_joined:
            self._is_joined = False
            self._met("the broker is gone")

    def _met(self, fault: str) -> None:
        if fault != self._fault:
            self._say(f"{self._name}: {fault}; it is tried again until it is there.")
        self._fault = fault


def client_for(address: Address) -> Any:
    """Return a client of a broker, not yet connected, that connects again by itself.

    Raises
    ------
    DataError
        If paho-mqtt is not installed.
    """
    try:
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion
    except ImportError:
        raise DataError(f"{address.text}: MQTT needs paho-mqtt; install it with: pip install 'elusive[live]'") from None
    client = Client(CallbackAPIVersion.VERSION2)
    if address.user is not None:
        client.username_pw_set(address.user, address.password)
    if address.scheme == "mqtts":
        client.tls_set()
    client.reconnect_delay_set(1, LONGEST_WAIT_S)
    return client


def mqtt_messages(address: Address, feed: Feed) -> Iterator[bytes]:
    """Yield the messages of a topic, which may hold ``+`` and ``#``, until the feed is over.

    Raises
    ------
    DataError
        If no topic is named, or paho-mqtt is not installed.
    """
    if not address.path:
        raise DataError(f"{address.text}: names no topic; write {address.text.rstrip('/')}/site/links.")
    client, held, contact = client_for(address), queue.Queue[bytes](HELD), Contact(address, feed.say)

    def came(_: Any, __: Any, message: Any) -> None:
        if len(message.payload) > LONGEST:
            feed.spoilt(f"{address.text}: a message is longer than {LONGEST} octets.")
            return
        try:
            held.put_nowait(message.payload)
        except queue.Full:
            feed.spoilt(f"{address.text}: {HELD} messages wait already.", "dropped")

    def joined(_: Any, __: Any, ___: Any, code: Any, *____: Any) -> None:
        if code.is_failure:
            contact.refused(code)
            return
        contact.joined()
        feed.counts["reconnected"] += bool(feed.counts["connected"])
        feed.counts["connected"] += 1
        client.subscribe(address.path, qos=1)

    def gone(*_: Any) -> None:
        if not feed.over:
            contact.gone()

    def failed(*_: Any) -> None:
        contact.unanswered()

    client.on_message, client.on_connect, client.on_disconnect = came, joined, gone
    client.on_connect_fail = failed
    client.connect_async(address.host, address.port)
    client.loop_start()
    try:
        while not feed.over:
            try:
                yield held.get(timeout=LOOK_S)
            except queue.Empty:
                continue
            feed.stir()
    finally:
        client.disconnect()
        client.loop_stop()
