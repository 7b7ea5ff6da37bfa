"""An MQTT broker of the distribution on loopback, started and ended by a test."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.processes import HUNG_S


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A port of loopback that nobody listens at."""
    with socket.socket(socket.AF_INET, kind) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@contextmanager
def broker(port: int) -> Iterator[None]:
    """Run mosquitto, which listens on loopback where nothing else is said."""
    program = shutil.which("mosquitto") or shutil.which("/usr/sbin/mosquitto")
    if program is None:
        pytest.skip("needs the MQTT broker mosquitto, of the distribution")
    process = subprocess.Popen([program, "-p", str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + HUNG_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except ConnectionRefusedError:
                assert process.poll() is None
                assert time.monotonic() < until
                time.sleep(0.02)
        yield
    finally:
        process.terminate()
        process.wait()
