"""A finding: what was expected, what was seen, whether it holds, what it means and what to do."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from elusive.contracts import Array

LEVEL = 1e-3  # probability that one test remarks on a right model: some dozens of tests make 1 in 20


class Finding(NamedTuple):
    """One thing that was checked."""

    name: str  # stable, a word for what is checked and another for how: "noise.scale", "plots.on-land"
    holds: bool  # whether all is well: kept in checks.json, silent elsewhere
    expected: float  # what the model claims; NaN where there is no number
    seen: float  # what came
    sentence: str  # what was expected, what was seen, what that means
    remedy: str  # what to do, naming the option
    grave: bool = True  # False: a remark, for which --strict does not exit with 3


class Looked(NamedTuple):
    """What a recording is, from a look at it before it is tracked."""

    said: str  # its size, as one says it
    findings: tuple[Finding, ...]
    picture: Array | None = None  # ``(rows, columns)``, of what may be shown of it


class Fact(NamedTuple):
    """What a test measured, before anybody says what it means."""

    expected: float
    seen: float
    holds: bool  # within what is tolerated, or too few samples to say
    samples: float  # independent ones that it rests on

    def finding(self, name: str, sentence: str, remedy: str, *, grave: bool = True) -> Finding:
        """Return the finding; ``sentence`` is said of both outcomes only in ``checks.json``, so write the failing one.

        Parameters
        ----------
        name
            Stable, see :class:`Finding`.
        sentence, remedy
            As they are told where the fact does not hold.
        grave
            Whether the numbers of the run are not to be believed then.
        """
        if self.holds:
            sentence, remedy = self._held(), ""
        return Finding(name, self.holds, self.expected, self.seen, sentence, remedy, grave)

    def _held(self) -> str:
        """Return what is said where it holds; there may be no number to say."""
        if math.isnan(self.seen):
            return "Nothing was seen that speaks against it."
        expected = "" if math.isnan(self.expected) else f" where {self.expected:.3g} is expected"
        return f"{self.seen:.3g} was seen{expected}: it holds."


def broken(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return those that do not hold, the grave ones first."""
    return tuple(sorted((one for one in findings if not one.holds), key=lambda one: not one.grave))


def doubted(rows: Sequence[tuple[str, str]], findings: Iterable[Finding]) -> list[tuple[str, str]]:
    """Return a table of names and values with what does not hold above all, where a finding that is grave does not."""
    names = ", ".join(one.name for one in broken(findings) if one.grave)
    return [*([("Not to be believed as it stands", f"{names}: see checks.json")] if names else []), *rows]


def grave(findings: Iterable[Finding]) -> bool:
    """Return whether one that is grave does not hold: what the run says of its own certainty is not to be believed."""
    return any(one.grave and not one.holds for one in findings)
