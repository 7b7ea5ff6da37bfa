"""Addresses of live sources and sinks: scheme, host, port, path and options of a URL."""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Mapping
from typing import NamedTuple
from urllib.parse import parse_qsl, unquote, urlsplit

from elusive.errors import DataError

SOURCES = ("udp", "tcp", "mqtt", "mqtts", "asterix+udp")
PORTS = {"mqtt": 1883, "mqtts": 8883}
LOOPBACK = "127.0.0.1"


class Address(NamedTuple):
    """A place on the network, as the user wrote it."""

    text: str  # without a password
    scheme: str
    host: str  # loopback where none was given
    port: int
    path: str  # without the slash before it
    options: Mapping[str, str]
    user: str | None = None
    password: str | None = None

    @property
    def is_multicast(self) -> bool:
        """Whether the host is a group."""
        try:
            return ipaddress.ip_address(self.host).is_multicast
        except ValueError:
            return False


def is_address(source: str | os.PathLike[str]) -> bool:
    """Whether a source is an address that lines or packets come from."""
    scheme, mark, _ = os.fspath(source).partition("://")
    return bool(mark) and scheme.lower() in SOURCES


def address_of(text: str, known: Mapping[str, tuple[str, ...]]) -> Address:
    """Take an address apart.

    Parameters
    ----------
    text
        ``scheme://user:password@host:port/path?option=value``; a host that is left out is this machine's loopback.
    known
        The schemes that have a meaning here, and each one's options.

    Raises
    ------
    DataError
        If the scheme, the port or an option has no meaning.
    """
    try:
        parts = urlsplit(text)
        port, host = parts.port, parts.hostname
        (host or LOOPBACK).encode("idna")
    except UnicodeError:
        raise DataError(f"{text}: is no address (a part of the host's name is empty or too long).") from None
    except ValueError as error:
        raise DataError(f"{text}: is no address ({error}); write udp://127.0.0.1:5000.") from None
    scheme = parts.scheme.lower()
    if scheme not in known:
        raise DataError(f"{text}: {scheme or 'nothing'}:// has no meaning here; take {', '.join(known)}.")
    port = PORTS.get(scheme) if port is None else port
    if not port:
        raise DataError(f"{text}: names no port; write {scheme}://{host or LOOPBACK}:5000.")
    options = dict(parse_qsl(parts.query, keep_blank_values=True))
    unknown = sorted(options.keys() - set(known[scheme]))
    if unknown:
        may = ", ".join(known[scheme]) or "none"
        raise DataError(f"{text}: the option {unknown[0]!r:.40} has no meaning; known are {may}.")
    network = options.get("interface")
    if network and ":" not in (host or LOOPBACK) and not _is_ipv4(network):
        raise DataError(
            f"{text}: interface={network:.40} is no IPv4 address; write that of this machine's own network."
        )
    shown = text if parts.password is None else text.replace(f":{parts.password}@", ":***@", 1)
    user = None if parts.username is None else unquote(parts.username)
    password = None if parts.password is None else unquote(parts.password)
    return Address(shown, scheme, host or LOOPBACK, port, unquote(parts.path).lstrip("/"), options, user, password)


def _is_ipv4(text: str) -> bool:
    try:
        ipaddress.IPv4Address(text)
    except ValueError:
        return False
    return True
