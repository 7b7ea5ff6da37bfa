"""The health page of `elusive serve`: on loopback, for who has the token."""

from __future__ import annotations

import hmac
import html
import json
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from elusive.errors import DataError

MOST = 16  # connections at a time
PAGE = """<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="2"><title>{title}</title>
<style>body{{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}}
td{{padding:.2rem 1rem .2rem 0;vertical-align:top}}</style><h1>{title}</h1><table>{rows}</table>"""


class Bounded(ThreadingHTTPServer):
    """Answers so many at once; whoever comes then is hung up on."""

    daemon_threads, request_queue_size = True, MOST

    def __init__(self, *given: Any) -> None:
        self._free = threading.BoundedSemaphore(MOST)
        super().__init__(*given)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer, where one is free."""
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer, and be free again."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, *_: Any) -> None:
        """Say nothing: who asks has gone."""


@contextmanager
def health_page(
    host: str, port: int, token: str, health: Callable[[], Mapping[str, Any]], watched: Callable[[], Iterator[str]]
) -> Iterator[int]:
    """Serve ``/``, ``/health.json`` and ``/steps.ndjson`` while the block runs; gives the port.

    Parameters
    ----------
    host, port
        Where to listen; port 0: any that is free.
    token
        Asked for as ``?token=`` or in ``Authorization: Bearer``; without it nothing is said but 401.
    health
        What to show.
    watched
        Gives the lines of the steps, as they come, to one who watches.

    Raises
    ------
    DataError
        If the port is taken.
    """

    class Page(BaseHTTPRequestHandler):
        timeout = 10.0

        def do_GET(self) -> None:
            """Answer."""
            parts = urlsplit(self.path)
            given = self.headers.get("Authorization", "").removeprefix("Bearer ")
            given = given or parse_qs(parts.query).get("token", [""])[0]
            if not hmac.compare_digest(given.encode(), token.encode()):
                self._answer(401, "text/plain", b"the token is missing or wrong\n")
            elif parts.path == "/health.json":
                self._answer(200, "application/json", json.dumps(health()).encode())
            elif parts.path == "/":
                self._answer(200, "text/html; charset=utf-8", _page(health()).encode())
            elif parts.path == "/steps.ndjson":
                self._stream(watched())
            else:
                self._answer(404, "text/plain", b"there are /, /health.json and /steps.ndjson\n")

        def _stream(self, lines: Iterator[str]) -> None:
            """Answer with lines until who watches has gone."""
            self.send_response(200)
            self.send_header("Content-Type", "application/x-ndjson")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            with closing(lines), suppress(OSError):  # type: ignore[type-var]
                for line in lines:
                    self.wfile.write(line.encode() + b"\n")

        def _answer(self, code: int, kind: str, octets: bytes) -> None:
            self.send_response(code)
            for name, value in (
                ("Content-Type", kind),
                ("Content-Length", str(len(octets))),
                ("Cache-Control", "no-store"),
                ("Referrer-Policy", "no-referrer"),
                ("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'"),
            ):
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(octets)

        def log_message(self, *_: Any) -> None:
            """Say nothing: a request's line holds the token."""

    try:
        server = Bounded((host, port), Page)
    except OSError as error:
        raise DataError(
            f"health: port {port} of {host} cannot be had ({error.strerror or error}); name another."
        ) from None
    thread = threading.Thread(target=server.serve_forever, name="health", daemon=True)
    thread.start()
    try:
        yield server.server_address[1]
    finally:
        server.shutdown()
        server.server_close()


def _page(health: Mapping[str, Any]) -> str:
    rows = []
    for name, value in health.items():
        if name == "findings":
            text = "<br>".join(html.escape(found["said"]) for found in reversed(value)) or "none"
        elif isinstance(value, Mapping):
            text = "<br>".join(html.escape(f"{key}: {part}") for key, part in value.items()) or "none"
        else:
            text = html.escape(str(value))
        rows.append(f"<tr><td>{html.escape(name.replace('_', ' '))}<td>{text}")
    return PAGE.format(title=html.escape(str(health.get("title", "elusive"))), rows="".join(rows))
