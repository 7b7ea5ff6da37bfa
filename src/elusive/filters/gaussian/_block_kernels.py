"""Compiled kernels of a block-tridiagonal system: Cholesky's factor, solution, diagonal blocks of the inverse.

Golub and Van Loan (2013), Matrix computations, section 4.5; Takahashi, Fagan and Chen (1973) for the inverse. A stands
on the diagonal, B below it. Written out in loops: for blocks of 4 to 12 a call of LAPACK costs more than its work.
"""

from __future__ import annotations

import math

import numpy as np

from elusive._kernels import add_product, add_rows, copy_rows
from elusive._njit import njit
from elusive.contracts import Array


@njit(cache=True, nogil=True)
def cholesky(A: Array) -> bool:
    """Replace the lower half of a matrix by its Cholesky factor; False where it is not positive definite."""
    d = len(A)
    for j in range(d):
        for i in range(j, d):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                A[j, j] = math.sqrt(total)
            else:
                A[i, j] = total / A[j, j]
    return True


@njit(cache=True, nogil=True)
def forward(L: Array, b: Array) -> None:
    """Solve ``L x = b`` in place, b ``(d,)``, L lower triangular."""
    for i in range(len(L)):
        total = b[i]
        for k in range(i):
            total -= L[i, k] * b[k]
        b[i] = total / L[i, i]


@njit(cache=True, nogil=True)
def backward(L: Array, b: Array) -> None:
    """Solve ``L' x = b`` in place, b ``(d,)``, L lower triangular."""
    for i in range(len(L) - 1, -1, -1):
        total = b[i]
        for k in range(i + 1, len(L)):
            total -= L[k, i] * b[k]
        b[i] = total / L[i, i]


@njit(cache=True, nogil=True)
def inverse(L: Array) -> Array:
    """Inverse of ``L L'``."""
    out = np.eye(len(L))
    for column in range(len(L)):
        forward(L, out[column])
        backward(L, out[column])
    return out


@njit(cache=True, nogil=True)
def factorise(A: Array, B: Array, damping: float, L: Array, Y: Array) -> bool:
    """Cholesky of the block-tridiagonal matrix with its diagonal raised: blocks L, and Y = L^-1 B' above them."""
    d = A.shape[1]
    for k in range(len(A)):
        for i in range(d):
            for j in range(d):
                L[k, i, j] = A[k, i, j]
            L[k, i, i] *= 1.0 + damping
        if k:
            for i in range(d):
                for j in range(i + 1):
                    total = 0.0
                    for m in range(d):
                        total += Y[k - 1, m, i] * Y[k - 1, m, j]
                    L[k, i, j] -= total
        if not cholesky(L[k]):
            return False
        if k + 1 < len(A):
            for column in range(d):
                for i in range(d):
                    total = B[k, column, i]
                    for m in range(i):
                        total -= L[k, i, m] * Y[k, m, column]
                    Y[k, i, column] = total / L[k, i, i]
    return True


@njit(cache=True, nogil=True)
def solve(L: Array, Y: Array, g: Array) -> Array:
    """Solve the block-tridiagonal system for a step ``(K, d)``, from its Cholesky factor."""
    x = g.copy()
    for k in range(len(L)):
        if k:
            add_product(x[k], -1.0, Y[k - 1].T @ x[k - 1])
        forward(L[k], x[k])
    for k in range(len(L) - 1, -1, -1):
        if k + 1 < len(L):
            add_product(x[k], -1.0, Y[k] @ x[k + 1])
        backward(L[k], x[k])
    return x


@njit(cache=True, nogil=True)
def marginals(L: Array, Y: Array) -> Array:
    """Diagonal blocks of the inverse, ``(K, d, d)``: the covariance of each state (Takahashi's recursion)."""
    covariance = np.empty_like(L)
    for k in range(len(L) - 1, -1, -1):
        copy_rows(covariance[k], inverse(L[k]))
        if k + 1 < len(L):
            gain = Y[k].T.copy()
            for column in range(len(gain)):
                backward(L[k], gain[column])
            add_rows(covariance[k], gain.T @ covariance[k + 1] @ gain)
    return covariance
