"""Another radar's pulses, one in a spoke: spirals, since that radar's rate is not this one's.

They are told from clutter, and taken for what was not received, by :mod:`elusive.preprocess.lone_samples`.
"""

from __future__ import annotations

from elusive.checks import Finding


def spirals(taken: int, left: int, samples: int) -> Finding:
    """Whether samples were another radar's pulses: how many were taken out, and left, of all."""
    share = (taken + left) / max(samples, 1)
    told = (
        f"{100 * share:.2g} % of the samples stand in one spoke alone, more than clutter does: pulses of another radar."
    )
    if left:
        return Finding(
            "video.spirals", False, 0.0, share,
            f"{told} How wide the beam is is not known, so that they are left: among them ships are found less.",
            "Give --beam-deg; turn the radar's interference rejection on.", grave=False,
        )  # fmt: skip
    return Finding(
        "video.spirals", not taken, 0.0, share, f"{told} They are taken as not received.",
        "Turn the radar's interference rejection on.", grave=False,
    )  # fmt: skip
