"""Standard input as a stream of bytes that a thread may wait on while the program ends."""

from __future__ import annotations

import io
import os
import sys
from typing import cast

STANDARD_INPUT = "-"


def standard_input() -> io.BufferedReader:
    """Return a reader of its own on standard input, which can look ahead.

    The interpreter closes ``sys.stdin`` as it ends and aborts where a thread still reads from that.
    """
    try:
        return os.fdopen(os.dup(sys.stdin.fileno()), "rb")
    except (io.UnsupportedOperation, AttributeError):
        return io.BufferedReader(cast(io.RawIOBase, sys.stdin.buffer))
