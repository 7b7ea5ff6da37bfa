"""What holds of versions of recorded infrared that nothing was tuned on: other cameras, recorders and units."""

from __future__ import annotations

from functools import cache

import pytest

from tests import infrared
from tests.recorded_versions import VERSIONS, Means, documented, measured, row

pytestmark = [
    pytest.mark.validate,
    pytest.mark.skipif(
        not infrared.DATA.is_dir(), reason=f"no recordings: {infrared.DATA}; point ELUSIVE_DATA at them"
    ),
]


@cache
def means(version: str) -> Means:
    return measured(version)


@pytest.mark.parametrize("version", VERSIONS)
def test_the_documentation_says_what_is_measured(version):
    """A row that differs is written anew by ``python -m tests.recorded_versions``."""
    assert row(version, means(version)) == documented(version)


@pytest.mark.parametrize("version", VERSIONS)
def test_targets_are_followed_in_every_version(version):
    assert means(version).followed >= 0.9


@pytest.mark.parametrize(("version", "rounding"), [("negative", 0.01), ("radiance", 0.05)])
def test_units_and_polarity_make_no_difference(version, rounding):
    """Rounding alone differs: the floating point numbers of ``radiance`` have a pedestal of 10 000 grey levels.

    It decides when a target as faint as clutter begins to be shown, of 15 frames in which one recording's is due.
    """
    ours, theirs = means("unchanged"), means(version)
    assert theirs.followed == pytest.approx(ours.followed, abs=0.01)
    assert theirs.shown == pytest.approx(ours.shown, abs=rounding)
    assert theirs.others == pytest.approx(ours.others, abs=0.02)
