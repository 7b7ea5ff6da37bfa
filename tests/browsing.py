"""Pages of reports as a browser sees them: what they ask for, hold, draw and log."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
import zlib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

OUTSIDE = re.compile(
    r"https?:|url\(|@import|\bimport\b|fetch\(|XMLHttpRequest|WebSocket|EventSource|sendBeacon|//\w+\.\w"
)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")


class Loads(HTMLParser):
    """What a page asks for: every attribute that loads something, and its tags."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[tuple[str, str, str | None]] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href", "srcset", "action", "data", "poster", "background", "xlink:href"):
                self.asked.append((tag, name, value))


def data_in(page: Path) -> dict[str, Any]:
    """Return the drawing that a report holds."""
    found = re.search(r"^const D = (\{.*\});$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None
    data: dict[str, Any] = json.loads(found.group(1))
    return data


def stands_alone(page: Path) -> None:
    """The page asks nothing of the network, and takes no text for HTML."""
    text = page.read_text(encoding="utf-8")
    parser = Loads()
    parser.feed(text)
    assert parser.asked == []
    assert not {"link", "iframe", "object", "embed", "base", "img"} & set(parser.tags)
    assert OUTSIDE.search(re.sub(r"^const D = \{.*\};$", "", text, flags=re.MULTILINE)) is None
    assert OUTSIDE.search(json.dumps({**data_in(page), "blocks": ""})) is None
    assert "<title>A &lt;b&gt;&amp; title&lt;/b&gt; &lt;/script&gt;</title>" in text
    assert text.count("</script>") == 1


def layers(drawn: dict[str, Any], **wanted: Any) -> list[dict[str, Any]]:
    """Return the layers of a drawing that have such keys."""
    every = [layer for panel in drawn["panels"] for layer in panel["layers"]]
    return [layer for layer in every if all(layer.get(name) == value for name, value in wanted.items())]


def titles(drawn: dict[str, Any]) -> list[str]:
    return [panel["title"].partition("?")[0] for panel in drawn["panels"]]


def names(drawn: dict[str, Any]) -> set[str]:
    return {layer["name"] for layer in layers(drawn) if "name" in layer}


def pixels(drawn: dict[str, Any], layer: dict[str, Any]) -> NDArray[np.uint8]:
    """Return the bytes of an image, ``(T, rows, columns)``."""
    block = drawn["blocks"][layer["block"]]["deflate"]
    return np.frombuffer(zlib.decompress(base64.b64decode(block)), np.uint8).reshape(
        layer["frames"], layer["rows"], layer["columns"]
    )


def numbers(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def browse(page: Path, width: int = 1280, actions: str = "") -> tuple[str, str]:
    """Open a page in a headless browser, do ``actions`` once it is drawn: its document then, and what it logged."""
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        pytest.skip("no Chromium here")
    if actions:
        waits = 'document.getElementById("drawing").made.drawnOnce.then(async (made) => {'
        text = page.read_text(encoding="utf-8")
        page = page.with_name("acted.html")
        page.write_text(text.replace("</script>", waits + actions + "});</script>"), encoding="utf-8")
    quiet = ["--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update"]
    command = [browser, "--headless", "--no-sandbox", *quiet, f"--user-data-dir={page.parent / 'profile'}"]
    command += ["--enable-logging=stderr", f"--window-size={width},1000", "--virtual-time-budget=3000", "--dump-dom"]
    ran = subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=90, check=True)
    return ran.stdout, "\n".join(line for line in ran.stderr.splitlines() if ":CONSOLE" in line)


def is_drawn(page: Path, width: int = 1280) -> None:
    """A browser draws every panel without complaint."""
    document, console = browse(page, width)
    assert console == ""
    assert 'data-ready="yes"' in document
    canvases = re.findall(r"<canvas[^>]*>", document)
    assert len(canvases) == len(data_in(page)["panels"])
    assert all(re.search(r'width="\d{3,}"', canvas) for canvas in canvases)  # the script set it, having come so far
