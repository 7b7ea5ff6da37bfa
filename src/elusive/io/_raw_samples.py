"""Samples without a header, as recorders and receivers write them: little-endian numbers, or I and Q in turn."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np

from elusive.contracts import Array

RawForm = Literal["u8", "s8", "s16", "s32", "f32", "f64", "cu8", "cs8", "cs16", "cf32", "cf64"]
KINDS = {"u": "u", "s": "i", "f": "f"}


class Raw(NamedTuple):
    """How samples stand in a file without a header."""

    kind: str  # u, i, f as NumPy has them
    width: int  # of a number [octets]
    paired: bool  # I and Q

    @classmethod
    def of(cls, form: RawForm) -> Raw:
        """Return what a name means: ``s16`` is of 16 bits with a sign, ``cf32`` of I and Q, floats of 32 bits each."""
        part = form.removeprefix("c")
        return cls(KINDS[part[0]], int(part[1:]) // 8, part != form)

    @property
    def block(self) -> int:
        """Octets of a sample."""
        return self.width * (2 if self.paired else 1)

    def decoded(self, data: bytes) -> Array:
        """Return the samples in so many octets, which are whole samples; integers are scaled to -1 ... 1."""
        numbers = np.frombuffer(data, f"<{self.kind}{self.width}").astype(np.float64)
        if self.kind != "f":
            half = 2.0 ** (8 * self.width - 1)
            numbers = (numbers - half * (self.kind == "u")) / half
        joined: Array = numbers[0::2] + 1j * numbers[1::2] if self.paired else numbers
        return joined
