"""Numba's ``njit`` as the kernels take it: without an entry for callers in C, of which they have none.

Such an entry is a tenth and more of what a kernel costs to compile.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def njit(**options: Any) -> Callable[[Kernel], Kernel]:
    """Return what compiles a function; ``options`` are Numba's."""
    compiler: Any = numba.njit  # noqa: TID251, its annotations leave this option out
    compiled: Callable[[Kernel], Kernel] = compiler(no_cfunc_wrapper=True, **options)
    return compiled
