"""Serves the workbench from this machine alone, unless told otherwise: pages, scripts, frames."""

from __future__ import annotations

import secrets
import socket
import sys
from collections.abc import Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path

from nicegui import app, ui
from starlette.responses import FileResponse, Response, StreamingResponse

from elusive.errors import DataError, ParameterError
from elusive.io.atomic import existing_folder
from elusive.report.page import LIVE_SCRIPTS
from elusive.workbench.asking import Recording
from elusive.workbench.blocks import HELD
from elusive.workbench.files import FOLDER, UPLOAD_MOST_BYTES
from elusive.workbench.guard import LOOPBACK, Guard
from elusive.workbench.jobs import POOL
from elusive.workbench.kept_runs import served_file
from elusive.workbench.live import LIVE
from elusive.workbench.own_page import PATH, TITLE, own_page
from elusive.workbench.session import is_asked_anew
from elusive.workbench.settings import SETTINGS
from elusive.workbench.shell import Page, pages
from elusive.workbench.start import start_page

STATIC = Path(__file__).parent / "static"
SWITCH_S = 0.0005  # that work holds the interpreter while a page waits to be answered; Python's own is ten times it
STYLES = ("drawing/drawing", "workbench/workbench")
RECONNECT_S = 60.0  # that a page outlives its connection


def serve(
    folder: Path,
    page_modules: Sequence[str],
    recordings: Sequence[Recording],
    *,
    host: str = "127.0.0.1",
    port: int = 8765,
    show: bool = True,
) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    folder
        The one folder that pages read from and write to; made if need be.
    page_modules
        Modules of the systems' pages, each with a ``PAGE``, in the order of the cards.
    recordings
        Kinds of recording and the commands that track them.
    host
        Address to listen at. Other than this machine's own, a token is asked for; it is printed.
    port
        Port to listen at.
    show
        Whether to open a browser.

    Raises
    ------
    ParameterError
        If the port is none.
    DataError
        If the folder cannot be made, or the port is taken.
    """
    if not 1 <= port <= 65535:
        raise ParameterError(f"--port: must be from 1 to 65535 (got {port}).")
    _check_free(host, port)
    SETTINGS.folder, SETTINGS.pages = existing_folder(folder).resolve(), tuple(page_modules)
    SETTINGS.recordings = tuple(recordings)
    token = None if host in LOOPBACK else secrets.token_urlsafe(24)
    sys.setswitchinterval(SWITCH_S)
    _build()
    app.add_middleware(Guard, token=token, most_bytes=UPLOAD_MOST_BYTES + 1024 * 1024)
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
    app.on_startup(lambda: print(f"The workbench is at {address} (Ctrl-C ends it)", flush=True))
    for page in pages():
        if page.warm_up is not None:
            app.on_startup(partial(POOL.submit, page.warm_up))
    ui.run(
        host=host, port=port, title="elusive workbench", show="/" if show and token is None else False, reload=False,
        reconnect_timeout=RECONNECT_S, show_welcome_message=False, uvicorn_logging_level="warning",
    )  # fmt: skip


def _check_free(host: str, port: int) -> None:
    try:
        with socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET):
            pass
    except OSError as error:
        raise DataError(
            f"--port {port}: cannot be listened at on {host} ({error.strerror}); end what uses it, or give another."
        ) from None


def _build() -> None:
    app.add_static_files("/workbench", STATIC)
    app.add_static_files("/drawing", str(files("elusive").joinpath("report", "static")))
    styles = "".join(f'<link rel="stylesheet" href="/{name}.css">' for name in STYLES)
    scripts = "".join(f'<script src="/drawing/{name}.js"></script>' for name in LIVE_SCRIPTS)
    ui.add_head_html(styles + scripts, shared=True)
    app.add_api_route("/blocks/{name}", _block, methods=["GET"], include_in_schema=False)
    app.add_api_route("/live/{key}", _live, methods=["GET"], include_in_schema=False)
    app.add_api_route(f"/{FOLDER}/{{run}}/{{name}}", _kept, methods=["GET"], include_in_schema=False)
    # a list that fades away takes the focus back when it is gone: what is typed elsewhere by then would be lost
    ui.select.default_props("transition-duration=0")
    ui.page("/")(start_page)
    ui.page(PATH, title=f"{TITLE} | elusive workbench", response_timeout=30.0)(own_page)
    for page in pages():
        _add(page)


def _add(page: Page) -> None:
    @ui.page(page.path, title=f"{page.title} | elusive workbench", response_timeout=30.0)
    async def build(example: str = "", file: str = "", token: str = "") -> None:
        anew = await is_asked_anew(page.path, example or token)
        await page.build(anew and bool(example), file if anew else "")


def _block(name: str) -> Response:
    held = HELD.get(name)
    if held is None:
        return Response("These frames are no longer held.", 404)
    return Response(held[0], media_type=held[1], headers={"Cache-Control": "private, max-age=3600"})


def _live(key: str) -> Response:
    live = LIVE.get(key)
    if live is None:
        return Response("This run is no longer live.", 404)
    return StreamingResponse(live.lines(), media_type="application/x-ndjson", headers={"Cache-Control": "no-store"})


def _kept(run: str, name: str) -> Response:
    path = served_file(SETTINGS.folder, run, name)
    if path is None:
        return Response("There is no such file of a run.", 404)
    # a run of this name may be another tomorrow; a report of somebody else's must not act as a page of ours
    headers = {"Cache-Control": "no-cache", "Content-Security-Policy": "sandbox allow-scripts allow-downloads"}
    return FileResponse(path, headers=headers)
