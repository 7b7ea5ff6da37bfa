"""Draw three targets that cross in frames, as `elusive track images` reports them.

Run from the project's root: ``PYTHONPATH=. python docs/figures/several_images.py docs/_static/several-images.png``
"""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from elusive.io import Truth
from elusive.systems.images.run import track_recording
from elusive.systems.images.scene import held_frames
from elusive.systems.images.simulate import draw_images
from tests.systems.images import several_runs


def main(path: Path) -> None:
    """Write the figure."""
    drawn = draw_images(several_runs.scene(3, "crossing", 9.0, 1))
    source = held_frames("Three targets of 9 dB", drawn.frames)
    with TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        track_recording(source, several_runs.tracking(1), out, truth=Truth.of_frames(drawn.truth))
        shutil.copy(out / "report.png", path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
