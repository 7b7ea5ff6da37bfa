"""A workbench on a free port, and a browser that notes every request and every error."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest

from elusive.workbench.kept_runs import forget, kept_runs
from tests.processes import HUNG_S

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ARGUMENTS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
    "--disable-site-isolation-trials",  # a report's sandboxed frame is no process of its own, to start and wait for
]  # fmt: skip
LOCAL = ("127.0.0.1", "localhost", "")  # the last: data: and blob:


class Served(NamedTuple):
    address: str
    folder: Path


class Tab(NamedTuple):
    page: Any
    strangers: list[str]  # requests to anywhere but this machine
    errors: list[str]
    said: list[str]  # lines of the console


TABS = pytest.StashKey[list[Tab]]()
SEEN_MOST = 12_000  # letters of a page that a failure's report holds


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, Any]:
    """Add to the report of a failure what its pages show: address, what can be read and set, console."""
    report = yield
    if report.failed and call.when == "call":
        for tab in item.stash.get(TABS, []):
            report.sections += [(f"Page at {page.url}", seen_on(page)) for page in tab.page.context.pages]
            report.sections.append(("Its console", "\n".join(tab.said) or "nothing"))
    return report


def seen_on(page: Any) -> str:
    """Return what can be read on a page, field by field with what stands in it, and in the reports on it."""
    told = []
    for frame in page.frames:
        try:
            told.append(frame.locator("body").aria_snapshot(timeout=5000)[:SEEN_MOST])
        except Exception as error:  # of any kind: the failure itself is what must be told
            told.append(f"cannot be read: {error}")
    return "\n--- a report on it\n".join(told)


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def started(folder: Path, *more: str) -> tuple[subprocess.Popen[str], str]:
    """Start a workbench; return it and the address it prints."""
    port = free_port()
    command = [sys.executable, "-m", "elusive", "workbench", "--folder", str(folder), "--port", str(port)]
    # or NiceGUI takes itself for a part of the test
    plain = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    server = subprocess.Popen([*command, "--no-browser", *more], stdout=subprocess.PIPE, text=True, env=plain)
    assert server.stdout is not None
    words = server.stdout.readline().split()
    address = next((word for word in words if word.startswith("http://")), "")
    if not address:
        ended(server)
        pytest.fail(f"the workbench did not start: {words}")
    return server, address


def ended(server: subprocess.Popen[str]) -> None:
    server.terminate()
    try:
        server.wait(10)
    except subprocess.TimeoutExpired:
        server.kill()
        server.wait()
    assert server.stdout is not None
    server.stdout.close()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    if find_spec("nicegui") is None:
        pytest.skip("NiceGUI is not installed: pip install 'elusive[workbench]'")
    folder = tmp_path_factory.mktemp("workbench") / "folder"
    server, address = started(folder)
    for _ in range(100):
        try:
            urlopen(address, timeout=5).close()
            break
        except OSError:
            time.sleep(0.1)
    yield Served(address.rstrip("/"), folder)
    ended(server)


@pytest.fixture
def served(server: Served) -> Served:
    """Give the workbench, in whose folder no run of another test is left."""
    for run in kept_runs(server.folder):
        forget(run)
    return server


@pytest.fixture(scope="module")  # no longer: its event loop would stand in the way of tests that run one
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("there is no chromium on this machine")
    if find_spec("playwright") is None:
        pytest.skip("Playwright is not installed: pip install playwright")
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=1000 * HUNG_S)
    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


def expect(what: Any) -> Any:
    """What a page shows follows what was done: wait until it does."""
    from playwright.sync_api import expect

    return expect(what)


def heard(page: Any, load: Callable[..., Any]) -> Callable[..., Any]:
    """Wait, after a page is loaded, until the server hears it: what is done before that is lost."""

    def loaded(*given: Any, **named: Any) -> Any:
        answer = load(*given, **named)
        page.wait_for_function("window.did_handshake !== false")  # of NiceGUI's pages; others have none
        return answer

    return loaded


@pytest.fixture
def open_tab(browser: Any, request: pytest.FixtureRequest) -> Iterator[Callable[..., Tab]]:
    """Give what opens a tab; at the end no request has left the machine and no script has failed."""
    contexts: list[Any] = []
    tabs: list[Tab] = []
    request.node.stash[TABS] = tabs

    def opened(width: int = 1280, scheme: str = "light", *, moves: bool = False) -> Tab:
        context = browser.new_context(
            viewport={"width": width, "height": 900}, color_scheme=scheme, accept_downloads=True,
            # a button that still slides is pressed where it was: the press is nobody's
            reduced_motion="no-preference" if moves else "reduce",
        )  # fmt: skip
        contexts.append(context)
        tab = Tab(context.new_page(), [], [], [])
        tab.page.on(
            "request",
            lambda request: (
                tab.strangers.append(request.url) if (urlsplit(request.url).hostname or "") not in LOCAL else None
            ),
        )
        tab.page.on("console", lambda said: tab.said.append(f"{said.type}: {said.text}"))
        tab.page.on("console", lambda said: tab.errors.append(said.text) if said.type == "error" else None)
        tab.page.on("pageerror", lambda error: tab.errors.append(str(error)))
        tab.page.set_default_timeout(1000 * HUNG_S)
        tab.page.goto, tab.page.reload = heard(tab.page, tab.page.goto), heard(tab.page, tab.page.reload)
        tabs.append(tab)
        return tab

    yield opened
    told = [(tab.strangers, tab.errors) for tab in tabs]
    for context in contexts:
        context.close()
    assert told == [([], [])] * len(told)
