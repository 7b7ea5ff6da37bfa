"""Images: targets too faint to see in one frame, made or recorded, tracked and seen on one page.

Amrouche, Khenchaf and Berkani (2018).
"""

from __future__ import annotations

from elusive.systems.images.peaks import PeakImages
from elusive.systems.images.recurrent import RecurrentImages
from elusive.systems.images.scene import ImageScene
from elusive.workbench.forms import FieldPath
from elusive.workbench.run_inputs import Shown
from elusive.workbench.run_window import scenes_page
from elusive.workbench.shell import Page

TITLE = "Faint targets in images"
LEAD = (
    "Targets below the noise of every single frame are found by following all places at once. Make some, or open "
    "frames; see when each is there and how far off, change the SNR, and compare."
)
SCENE = "images scene"
FILTER = ("tracking", "filter")
# a scene's frames are counted in pixels, tracks begin and end alike for all filters, and what is recorded alone has a
# background to learn
NEVER: tuple[FieldPath, ...] = (
    ("sensor", "dx"), ("sensor", "dy"), (*FILTER, "sensor"), (*FILTER, "lifecycle"),
    *(("tracking", name) for name in ("background", "jitter_px", "clump_px")),
)  # fmt: skip
KNOWN = tuple(
    (*FILTER, *path) for path in (("motion",), ("birth", "snr_db"), ("birth", "snr_db_range"), ("target_snr_db",))
)


def without(scene: ImageScene) -> tuple[FieldPath, ...]:
    """Return the fields that the scene's frames set, or what the filter knows of its targets."""
    known = KNOWN if scene.filter_knows_target else ()
    own = (("tracking", "tracks"),) if isinstance(scene.tracking.filter, RecurrentImages) else ()
    idle = () if isinstance(scene.tracking.filter, PeakImages) else (("tracking", "show"),)
    return (*NEVER, *known, *own, *idle)


PAGE = Page(
    "images", "/images", "Images", TITLE,
    "Targets too faint to threshold that appear, move and disappear: frames, existence of each, error.",
    "30 frames of 20 x 20, a target of 6.7 dB in frames 5 to 23 (from 0) of Amrouche et al. (2018).",
    scenes_page("/images", TITLE, LEAD, {SCENE: "Make a scene", "images": "Open frames"}, {SCENE: Shown(without)}),
    keeps_runs=True,
)  # fmt: skip
