"""What kind of recording a file is, by its ending, its shape or its columns; a person may say otherwise."""

from __future__ import annotations

import re
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from elusive.workbench.files import SCENE, SCENES

ENDINGS = {
    ".mp4": "images", ".avi": "images", ".mov": "images", ".mkv": "images", ".tif": "images", ".tiff": "images",
    ".wav": "signal", ".sigmf-meta": "signal", ".sigmf-data": "signal", ".pcap": "video",
    ".ast": "radar",
}  # fmt: skip
LINK = re.compile(r",\s*\w+-\w+-\w+\s*(,|$)")  # a column of a radio network's log: transmitter-receiver-channel
COLUMNS = (("azimuth", "bearings"), ("arrival", "bearings"), ("rss", "links"), ("range_m", "radar"), ("tx", "links"))
HEAD_BYTES = 4096
SYSTEM = re.compile(rb"^system: *['\"]?(\w+)", re.MULTILINE)
SCENE_MOST_BYTES = 16 * 1024 * 1024


def system_of(path: Path) -> str:
    """Return the system of a scene, or of the one in a folder of results; nothing where it is none."""
    scene = path / SCENE if path.is_dir() else path
    try:
        if scene.suffix.lower() not in SCENES or scene.stat().st_size > SCENE_MOST_BYTES:
            return ""
        found = SYSTEM.search(scene.read_bytes())
    except OSError:
        return ""
    return found[1].decode() if found else ""


def kind_of(path: Path) -> str:
    """Return the noun of the command that tracks a file or a folder; nothing where that cannot be told."""
    ending = Path(path.stem).suffix.lower() if path.suffix.lower() == ".gz" else path.suffix.lower()
    if path.is_dir():
        return "images"
    if ending in ENDINGS:
        return ENDINGS[ending]
    try:
        if ending == ".npy":
            return "images" if np.load(path, mmap_mode="r").ndim == 3 else "signal"
        if ending == ".npz":
            with np.load(path) as arrays:
                return "video" if "azimuth_deg" in arrays else "images"
        if ending == ".nc":
            import h5py

            with h5py.File(path, "r") as arrays:
                return "video" if "azimuth_deg" in arrays else "images"
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES).split(b"\n")[0].decode("utf-8", "replace").lower()
    except (OSError, ValueError, EOFError, BadZipFile):  # cut off, or of another kind than its name says
        return ""
    return next((noun for word, noun in COLUMNS if word in head), "links" if LINK.search(head) else "")
