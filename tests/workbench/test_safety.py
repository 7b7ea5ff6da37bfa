"""What a stranger may not do: leave the folder, send too much or the wrong kind, ask without the token."""

from __future__ import annotations

import asyncio
import json
import shutil
import socket
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from elusive.errors import DataError
from elusive.io.placed_files import read_nodes
from elusive.report import drawing as draw
from elusive.workbench import files
from elusive.workbench.blocks import HELD, Blocks, told_of
from elusive.workbench.files import inside, read_upload
from elusive.workbench.guard import Guard
from tests.workbench.conftest import Served
from tests.workbench.test_links_page import OpenTab, choose, told


@pytest.mark.parametrize(
    "name",
    [
        "../a.csv",
        "/etc/passwd.csv",
        "..",
        "",
        "a/b.csv",
        "a\\b.csv",
        ".hidden.csv",
        "x" * 200 + ".csv",
        "a\0.csv",
        "~/a.csv",
    ],
)
def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(DataError, match="no plain file name"):
        inside(tmp_path, name, (".csv",))


def test_a_link_out_of_the_folder_and_another_kind_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "out.csv").symlink_to(tmp_path / "secret.csv")
    with pytest.raises(DataError, match="leads out of"):
        inside(folder, "out.csv", (".csv",))
    with pytest.raises(DataError, match=r"has no ending of \.csv"):
        inside(folder, "a.py", (".csv",))
    assert inside(folder, "a b-1.csv", (".csv",)) == folder / "a b-1.csv"


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("a.exe", b"", r"a\.exe: is of no kind that is read here; send \.csv\."),
        ("../../a.csv", b"node,x_m,y_m\n1,a,2\n", r"^a\.csv, line 2, column x_m: 'a' is no number"),
        ("a.csv", b"\xff\xfe\x00", r"^a\.csv"),
        ("a.csv", b"", r"^a\.csv: holds 0 nodes"),
    ],
)
def test_a_broken_upload_is_refused_with_what_is_wrong(name: str, data: bytes, sentence: str) -> None:
    with pytest.raises(DataError, match=sentence):
        read_upload(name, data, (".csv",), read_nodes)


def test_an_upload_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "UPLOAD_MOST_BYTES", 10)
    with pytest.raises(DataError, match="holds 11 bytes, more than 10"):
        read_upload("a.csv", b"x" * 11, (".csv",), read_nodes)
    assert read_upload("a.csv", b"0 0\n1 1\n", (".csv",), read_nodes).names == ("0", "1")


def done(work: Coroutine[Any, Any, None]) -> None:
    """Run work on an event loop of its own thread: the browser's tests may hold this one's."""
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, work).result()


def asked(
    token: str | None, *, host: str = "127.0.0.1:80", query: str = "", sent: bytes = b"", **more: str
) -> tuple[int, dict[str, str]]:
    """Ask a guarded application over HTTP; return status and headers."""
    answers: list[Any] = []

    async def application(scope: Any, receive: Any, send: Any) -> None:
        await receive()
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def receive() -> Any:
        return {"type": "http.request", "body": sent}

    async def send(message: Any) -> None:
        answers.append(message)

    headers = [
        (b"host", host.encode()),
        *((name.replace("_", "-").encode(), value.encode("latin-1")) for name, value in more.items()),
    ]
    scope = {"type": "http", "headers": headers, "query_string": query.encode()}
    done(Guard(application, token, 1000)(scope, receive, send))
    given = {name.decode(): value.decode() for name, value in answers[0]["headers"]}
    return answers[0]["status"], given


def test_this_machine_alone_is_served_without_a_token() -> None:
    assert asked(None)[0] == 200
    assert asked(None, host="localhost:1")[0] == 200
    assert asked(None, host="[::1]:1")[0] == 200
    assert asked(None, host="evil.example:80")[0] == 403  # a name bent to this machine
    assert asked(None, origin="http://evil.example")[0] == 403
    assert asked(None, origin="http://127.0.0.1:80")[0] == 200
    assert asked(None, origin="null")[0] == 403  # of a report, which is sandboxed
    assert asked(None, host="[::1")[0] == 403
    assert asked(None, origin="http://[")[0] == 403


def test_elsewhere_the_token_is_asked_for_once() -> None:
    assert asked("secret", host="10.0.0.1:80")[0] == 403
    assert asked("secret", host="10.0.0.1:80", query="token=wrong")[0] == 403
    assert asked("secret", host="10.0.0.1:80", cookie="elusive_token=wröng")[0] == 403
    status, given = asked("secret", host="10.0.0.1:80", query="token=secret")
    assert status == 200
    assert given["set-cookie"] == "elusive_token=secret; HttpOnly; SameSite=Strict; Path=/"
    status, given = asked("secret", host="10.0.0.1:80", cookie="a=b; elusive_token=secret")
    assert status == 200
    assert "set-cookie" not in given
    assert given["x-content-type-options"] == "nosniff"


def test_a_body_is_counted_whatever_its_header_says() -> None:
    assert asked(None, content_length="1001")[0] == 413
    assert asked(None, content_length="many")[0] == 413
    assert asked(None, content_length="\u00b2")[0] == 413  # a digit, and no number
    assert asked(None, sent=b"x" * 1001)[0] == 413
    assert asked(None, sent=b"x" * 1000)[0] == 200


def test_a_socket_of_another_site_is_closed() -> None:
    answers: list[Any] = []

    async def nothing(*_: Any) -> Any:
        return {"type": "websocket.connect"}

    async def send(message: Any) -> None:
        answers.append(message)

    scope = {"type": "websocket", "headers": [(b"host", b"127.0.0.1:80"), (b"origin", b"http://evil.example")]}
    done(Guard(nothing, None, 10)(scope, nothing, send))
    assert answers == [{"type": "websocket.close", "code": 1008}]


def test_images_are_fetched_by_name_and_the_drawing_too_where_it_is_long() -> None:
    values = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    image = draw.image({"block": values, "low": 0.0, "high": 255.0}, (0.0, 4.0, 0.0, 3.0), times=[0.0, 1.0])
    drawn = draw.drawing("x", [0.0, 1.0], [draw.plane("x", (0, 4, 0, 3), [image])])
    told = told_of(drawn)
    held = HELD.get(told["blocks"][0]["url"].rpartition("/")[2])
    assert held == (values.tobytes(), "application/octet-stream")
    assert told_of(drawn) == told  # equal data has one name
    long = draw.drawing("x", np.arange(20_000.0), [])
    data, kind = HELD.get(told_of(long)["url"].rpartition("/")[2]) or (b"", "")
    assert (kind, json.loads(data)["times"]) == ("application/json", list(range(20_000)))


def test_the_longest_unused_makes_room() -> None:
    held = Blocks(most_bytes=10)
    first, second = held.hold(b"x" * 4), held.hold(b"y" * 4)
    assert len({first, second, Blocks().hold(b"x" * 4)}) == 3  # a name says nothing of another process's
    assert held.hold(b"x" * 4) == first
    third = held.hold(b"z" * 4)
    assert held.get(second) is None
    assert held.get(first) == (b"x" * 4, "application/octet-stream")
    assert held.get(third) is not None


def answer(served: Served, path: str, *, method: str = "GET", **headers: str) -> tuple[int, dict[str, str]]:
    """Ask the workbench itself, by a path that nothing has tidied."""
    asking = HTTPConnection(urlsplit(served.address).netloc, timeout=60)
    asking.request(method, path, headers={name.replace("_", "-"): value for name, value in headers.items()})
    found = asking.getresponse()
    found.read()
    asking.close()
    return found.status, {name.lower(): value for name, value in found.getheaders()}


def test_the_workbench_listens_on_its_own_address_alone(served: Served) -> None:
    port = urlsplit(served.address).port
    assert port is not None
    with pytest.raises(OSError), socket.create_connection(("127.0.0.2", port), timeout=5):  # so not on all of them
        pass
    assert answer(served, "/", Origin="http://evil.example")[0] == 403
    assert answer(served, "/", Host="evil.example")[0] == 403
    assert answer(served, "/_nicegui/x", method="POST", Content_Length=str(1 << 40))[0] == 413


def test_no_path_leads_out_of_a_run(served: Served) -> None:
    home = served.folder / "result"
    home.mkdir()
    for name in ("config.yaml", "run.json", "report.html"):
        (home / name).write_text("x")
    (served.folder.parent / "secret.txt").write_text("x")
    (home / "out.txt").symlink_to(served.folder.parent / "secret.txt")
    status, headers = answer(served, "/runs/result/report.html")
    assert status == 200
    assert headers["content-security-policy"].startswith("sandbox")  # or it could act as a page of ours
    for path in (
        "run.json", "out.txt", "..%2f..%2fsecret.txt", "%2e%2e/%2e%2e/secret.txt", "../../secret.txt", "..\\secret.txt",
        "%00", "report.html%00.txt",
    ):  # fmt: skip
        assert answer(served, f"/runs/result/{path}")[0] == 404, path
    for path in ("/runs/../secret.txt", "/runs/%2e%2e/secret.txt", "/workbench/..%2fserver.py", "/drawing/../page.py"):
        assert answer(served, path)[0] == 404, path
    shutil.rmtree(home)


def test_what_files_are_called_and_hold_is_shown_and_never_done(
    served: Served, open_tab: OpenTab, tmp_path: Path
) -> None:
    evil = "<img src=x onerror=window.hit=1>"
    (served.folder / f"{evil}.csv").write_text("x")
    (served.folder / "evil.csv").write_text(f"time_s,sensor,{evil}\n0,a,1\n")
    (tmp_path / f"{evil}.csv").write_text("x")
    page = open_tab().page
    page.goto(f"{served.address}/own")
    choose(page, "kind", "Bearings from a few places")
    choose(page, "bearings", "evil.csv")
    told(page, f"1 line: time_s 0, sensor, {evil}")
    assert page.get_by_role("option", name="img").count() == 0
    page.locator("input[type=file]").set_input_files(tmp_path / f"{evil}.csv")
    told(page, "is no plain file name")
    assert page.evaluate("window.hit") is None
    for name in (f"{evil}.csv", "evil.csv"):
        (served.folder / name).unlink()
