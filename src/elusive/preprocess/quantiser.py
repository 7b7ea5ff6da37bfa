"""What a link's change is after it was quantised and sent over a channel that turns bits.

Mendieta (2017), sections 3.5-3.6, eq. 3.12. The number of wrong bits is drawn from the binomial distribution that
eq. 3.12 gives the mean of: rounded, 1e-6 of a frame's 13 120 bits would always be none.
"""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from elusive.contracts import Array
from elusive.errors import DataError, ParameterError
from elusive.model import Model, Probability


class Quantiser(Model):
    """Uniform quantisation over a fixed range, and bit errors.

    The range is the same in every frame, or a strong change would coarsen all others. What lies beyond it is sent as
    its end.
    """

    bits: int = Field(16, ge=2, le=32, description="Bits a value, 'Quantization bits' (table 4.2)")
    lowest_db: float = Field(-32.0, description="Low end of the range [dB]")
    highest_db: float = Field(224.0, description="High end of the range [dB]")
    bit_error_rate: Probability = Field(1e-6, description="Probability that a bit is turned, 'Channel BER' (table 4.2)")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.lowest_db < self.highest_db:
            raise ParameterError(
                f"Quantiser.highest_db: {self.highest_db:g} is not above lowest_db={self.lowest_db:g}; give a range."
            )
        return self

    @property
    def step_db(self) -> float:
        """Width of a quantisation level [dB]; values in range are off by half of it at most."""
        return (self.highest_db - self.lowest_db) / 2.0**self.bits

    def send(self, changes: ArrayLike, rng: Generator) -> Array:
        """Return the changes as the centre receives them.

        Parameters
        ----------
        changes
            Of any shape [dB]; NaN is not sent, and stays missing.
        rng
            Source of the bit errors.

        Raises
        ------
        DataError
            If a change is infinite.
        """
        values = np.asarray(changes, dtype=np.float64)
        if np.isinf(values).any():
            raise DataError("changes: hold infinity; give finite changes, NaN where a link has none.")
        sent = np.isfinite(values)
        level = np.floor((values[sent] - self.lowest_db) / self.step_db)
        codes = np.clip(level, 0, 2.0**self.bits - 1).astype(np.uint64)
        total = codes.size * self.bits
        wrong = rng.choice(max(total, 1), int(rng.binomial(total, self.bit_error_rate)), replace=False)
        place, bit = np.divmod(wrong, self.bits)
        np.bitwise_xor.at(codes, place, np.left_shift(np.uint64(1), bit.astype(np.uint64)))
        received = np.full(values.shape, np.nan)
        received[sent] = self.lowest_db + (codes + 0.5) * self.step_db
        return received
