"""Where live measurements come from: one feed, lines or packets, files, standard input, UDP, TCP and MQTT.

A source is named by a path, by ``-`` (standard input) or by an address: ``udp://``, ``tcp://``, ``mqtt://``. Lines come
from :func:`lines_of`, packets from :func:`packets_of`; either is tried again where it ends or fails.
"""

from elusive.io.sources.address import Address, address_of, is_address
from elusive.io.sources.feed import Feed
from elusive.io.sources.lines import Lines, lines_of
from elusive.io.sources.order import in_order
from elusive.io.sources.packets import Packet, packets_of

__all__ = ["Address", "Feed", "Lines", "Packet", "address_of", "in_order", "is_address", "lines_of", "packets_of"]
