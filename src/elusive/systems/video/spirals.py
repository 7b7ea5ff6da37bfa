"""Another radar's pulses, one in a spoke: spirals, since that radar's rate is not this one's.

They are told from clutter, and taken for what was not received, by :mod:`elusive.preprocess.lone_samples`, or where
they are nearly in one place from spoke to spoke by :mod:`elusive.preprocess.sliding_pulses`.
"""

from __future__ import annotations

from elusive.checks import Finding


def spirals(taken: int, left: int, sliding: int, samples: int) -> Finding:
    """Whether samples were another radar's pulses: how many were taken out, left, and taken out on lines, of all."""
    share = (taken + left + sliding) / max(samples, 1)
    where = "on a line that goes on beyond any beam" if sliding > taken + left else "in one spoke alone"
    told = f"{100 * share:.2g} % of the samples stand {where}, more than clutter does: pulses of another radar."
    if left:
        return Finding(
            "video.spirals", False, 0.0, share,
            f"{told} How wide the beam is is not known, so that they are left: among them ships are found less.",
            "Give --beam-deg; turn the radar's interference rejection on.", grave=False,
        )  # fmt: skip
    return Finding(
        "video.spirals", not taken + sliding, 0.0, share, f"{told} They are taken as not received.",
        "Turn the radar's interference rejection on.", grave=False,
    )  # fmt: skip
