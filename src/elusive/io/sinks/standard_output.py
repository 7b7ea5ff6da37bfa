"""Lines to standard output, which may be a pipe that nobody reads any more, or a file on a full disk."""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Callable


class StandardOutput:
    """Writes whole lines; those that the system refuses are lost and counted, and nothing waits for them.

    Parameters
    ----------
    say
        Told when the system refuses them, and when no more.
    """

    name = "standard output"

    def __init__(self, say: Callable[[str], None]) -> None:
        self.counts = Counter[str]()
        self.closed = False
        """Whether it is a pipe that nobody reads any more."""
        self._say, self._is_gone = say, False

    def send(self, message: bytes) -> None:
        """Write a line."""
        if self.closed:
            self.counts["dropped"] += 1
            return
        try:
            sys.stdout.write(message.decode())
            sys.stdout.flush()
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # or the interpreter complains as it ends
            self.counts["dropped"] += 1
            self.closed = True
        except OSError as error:
            self.counts["dropped"] += 1
            if not self._is_gone:
                self._say(f"{self.name}: lines are lost ({error.strerror or error}); it goes on.")
            self._is_gone = True
        else:
            self.counts["sent"] += 1
            if self._is_gone:
                self._say(f"{self.name}: is back; {self.counts['dropped']} lines were lost.")
            self._is_gone = False

    def close(self) -> None:
        """Leave it open: it is the program's."""
