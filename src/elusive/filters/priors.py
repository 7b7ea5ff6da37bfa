"""The belief before the first measurement: what a prior must offer, and a Gaussian one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal, Protocol, Self, TypeAlias, runtime_checkable

import numpy as np
from numpy.random import Generator
from pydantic import Field, SerializeAsAny, model_validator

from elusive.contracts import Array
from elusive.model import Model, or_own
from elusive.motion import square_root


@runtime_checkable
class Prior(Protocol):
    """Where the target is before the first measurement."""

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states, ``(n, d)``."""


class GaussianPrior(Model):
    """A Gaussian belief before the first measurement."""

    kind: Literal["gaussian"] = "gaussian"
    mean: tuple[float, ...] = Field(description="Mean of each component")
    covariance: tuple[tuple[float, ...], ...] = Field(description="Covariance, row by row")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        d = len(self.mean)
        if len(self.covariance) != d or any(len(row) != d for row in self.covariance):
            raise ValueError(f"covariance must have {d} rows of {d} numbers, as the mean has {d} components")
        covariance = np.array(self.covariance)
        if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance).min() < -1e-9:
            raise ValueError("covariance must be symmetric and have no negative eigenvalue")
        return self

    def sample(self, n: int, rng: Generator) -> Array:
        """Draw ``n`` states, ``(n, d)``."""
        root = square_root(np.array(self.covariance))
        return np.asarray(self.mean + rng.standard_normal((n, len(self.mean))) @ root.T)


if TYPE_CHECKING:
    AnyPrior: TypeAlias = Prior
else:
    AnyPrior = Annotated[SerializeAsAny[GaussianPrior], or_own(Prior)]
