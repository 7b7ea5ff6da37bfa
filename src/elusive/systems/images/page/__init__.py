"""Images: targets too faint to see in one frame, made, run, played and measured on one page.

Amrouche, Khenchaf and Berkani (2018).
"""

from __future__ import annotations

from elusive.systems.images.page.inputs import ImageInputs
from elusive.systems.images.page.run import run_scene
from elusive.systems.images.scene import ImageScene
from elusive.workbench.bench import Bench
from elusive.workbench.opener import open_scene
from elusive.workbench.runs import BenchState
from elusive.workbench.session import state_of
from elusive.workbench.shell import Page, head, main

TITLE = "Faint targets in images"
LEAD = (
    "Targets below the noise of every single frame are found by following all places at once. Make some, "
    "run the filter, and see when each is there and how far off; keep a run and change the SNR to see both."
)
BESIDE_DB = 10.0  # SNR of the run that the example keeps beside the paper's


async def build(example: bool, file: str = "") -> None:
    """Build the page; ``example``: run the paper's scenario at once, and with a brighter target to compare.

    ``file``: a scene that is opened.
    """
    head("/images")
    state = await state_of("images", lambda: BenchState(ImageScene().settled))
    with main(TITLE, LEAD):
        if example:
            state.scene = ImageScene().settled
        open_scene(file, lambda path: state.take(ImageScene.from_yaml(path).settled))
        bench = Bench(state, lambda: ImageInputs(state).forms, run_scene, ("Is it there?", "probability"))
    if example:
        weak = state.scene
        state.scene = weak.replace(snr_db=BESIDE_DB).settled
        brighter = await bench.run()
        state.scene = weak
        if brighter:
            bench.keep()
            await bench.run()


PAGE = Page(
    "images", "/images", TITLE,
    "Targets too faint to threshold that appear, move and disappear: frames, particles, existence of each, error.",
    "30 frames of 20 x 20, a target of 6.7 dB in frames 5 to 23 (from 0) of Amrouche et al. (2018), and one of 10 dB.",
    build,
)  # fmt: skip
