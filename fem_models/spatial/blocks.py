"""Linear equations of neighbours, compiled: block tridiagonal, solved by one sweep to the tip and one back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem_models.spatial.compiled import spatial_njit
from hysteresis.arrays import Floats


class Blocks(NamedTuple):
    """Rows of blocks: lower x[k - 1] + diagonal x[k] + upper x[k + 1] = right; shapes (count, size, size)."""

    lower: Floats
    diagonal: Floats
    upper: Floats
    right: Floats  # (count, size)


@spatial_njit(allocates=True)
def blocks_space(count: int, size: int) -> Blocks:
    """Arrays of zeros."""
    shape = (count, size, size)
    return Blocks(np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros((count, size)))


@spatial_njit(error_model="python")  # a zero pivot raises ZeroDivisionError
def solve_blocks(blocks: Blocks) -> None:
    """Solve in place (Thomas 1949, by blocks, without pivoting); the solution is in ``right``, the rest is lost."""
    count, size = blocks.right.shape
    lower, diagonal, upper, right = blocks.lower, blocks.diagonal, blocks.upper, blocks.right
    for k in range(count):
        if k > 0:
            for i in range(size):
                for l in range(size):
                    factor = lower[k, i, l]
                    if factor != 0.0:
                        for c in range(size):
                            diagonal[k, i, c] -= factor * upper[k - 1, l, c]
                        right[k, i] -= factor * right[k - 1, l]
        for p in range(size):
            by = 1.0 / diagonal[k, p, p]
            for i in range(p + 1, size):
                factor = diagonal[k, i, p] * by
                if factor != 0.0:
                    for c in range(p + 1, size):
                        diagonal[k, i, c] -= factor * diagonal[k, p, c]
                    for c in range(size):
                        upper[k, i, c] -= factor * upper[k, p, c]
                    right[k, i] -= factor * right[k, p]
        for p in range(size - 1, -1, -1):
            by = 1.0 / diagonal[k, p, p]
            for i in range(p + 1, size):
                factor = diagonal[k, p, i]
                for c in range(size):
                    upper[k, p, c] -= factor * upper[k, i, c]
                right[k, p] -= factor * right[k, i]
            for c in range(size):
                upper[k, p, c] *= by
            right[k, p] *= by
    for k in range(count - 2, -1, -1):
        for i in range(size):
            total = right[k, i]
            for c in range(size):
                total -= upper[k, i, c] * right[k + 1, c]
            right[k, i] = total
