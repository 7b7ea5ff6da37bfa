"""Where the real recordings are: beside the project, or where ``ELUSIVE_DATA`` points."""

from __future__ import annotations

import os
from pathlib import Path

DATA = Path(os.environ.get("ELUSIVE_DATA", Path(__file__).parents[2] / "shared" / "data"))
