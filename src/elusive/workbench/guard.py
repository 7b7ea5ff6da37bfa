"""Who may ask, and how much: this machine's own browser, or whoever holds the token; bodies of bounded size."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

Message = MutableMapping[str, Any]
Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
COOKIE = "elusive_token"
HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-frame-options", b"SAMEORIGIN"),  # reports stand in a page of ours
)


class TooLargeError(Exception):
    """More was sent than is taken."""


class Guard:
    """An ASGI application before the workbench's.

    Parameters
    ----------
    app
        What is guarded.
    token
        What a browser has to show once, as ``?token=``; None where only this machine is served.
    most_bytes
        Of the body of a request.
    """

    def __init__(self, app: Application, token: str | None, most_bytes: int) -> None:
        self._app, self._token, self._most = app, token, most_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a stranger's request, count a body, or hand it on."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        shown = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        if not self._is_known(headers, shown):
            await _refuse(scope, receive, send, 403, "This is not open to you: use the address the workbench printed.")
            return
        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > self._most:
            await _refuse(scope, receive, send, 413, f"More than {self._most} bytes were sent.")
            return
        got = 0

        async def counted() -> Message:
            nonlocal got
            message = await receive()
            got += len(message.get("body", b"")) if message["type"] == "http.request" else 0
            if got > self._most:
                raise TooLargeError
            return message

        async def stamped(message: Message) -> None:
            if message["type"] == "http.response.start":
                cookie = f"{COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/".encode()
                given = [(b"set-cookie", cookie)] if self._token and shown else []
                message["headers"] = [*message.get("headers", []), *HEADERS, *given]
            await send(message)

        try:
            await self._app(scope, counted, stamped)
        except TooLargeError:
            await _refuse(scope, receive, send, 413, f"More than {self._most} bytes were sent.")

    def _is_known(self, headers: dict[str, str], shown: str) -> bool:
        host = headers.get("host", "")
        origin = headers.get("origin")
        try:
            if origin is not None and urlsplit(origin).netloc != host:
                return False  # a page of another site
            if self._token is None:
                return (urlsplit(f"//{host}").hostname or "") in LOOPBACK  # no name that was bent to this machine
        except ValueError:  # no address at all
            return False
        kept = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        given = (shown, kept.value if kept else "")
        return any(hmac.compare_digest(one.encode(), self._token.encode()) for one in given)


async def _refuse(scope: Scope, receive: Receive, send: Send, status: int, sentence: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    body = sentence.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(body)).encode())]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
