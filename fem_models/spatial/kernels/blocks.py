"""Linear equations of neighbours, compiled: block tridiagonal, solved by one sweep to the tip and one back."""

from __future__ import annotations

from fem_models.spatial.kernels.compiled import spatial_njit
from hysteresis.arrays import Floats


@spatial_njit()
def solve_blocks(blocks: Floats, size: int) -> None:
    """Solve lower x[k - 1] + diagonal x[k] + upper x[k + 1] = right in place (Thomas 1949, by blocks).

    ``blocks`` has shape (count, size, 3 size + 1): lower, diagonal and upper block, then the right-hand side, where
    the solution is written. The rest is lost. No pivoting: stiffnesses stand on the diagonal.

    The sizes of two and four tendons, with dead loads and without, are compiled as numbers: a third of the time.
    """
    if size == 4:
        sweep_blocks(blocks, 4)
    elif size == 2:
        sweep_blocks(blocks, 2)
    elif size == 7:
        sweep_blocks(blocks, 7)
    elif size == 5:
        sweep_blocks(blocks, 5)
    else:
        sweep_blocks(blocks, size)


@spatial_njit(forceinline=True)
def sweep_blocks(blocks: Floats, size: int) -> None:
    """Do what :func:`solve_blocks` says."""
    count, end = blocks.shape[0], 3 * size + 1
    for k in range(count):
        if k > 0:
            for i in range(size):
                for col in range(size):
                    factor = blocks[k, i, col]
                    for c in range(size):
                        blocks[k, i, size + c] -= factor * blocks[k - 1, col, 2 * size + c]
                    blocks[k, i, end - 1] -= factor * blocks[k - 1, col, end - 1]
        for p in range(size):
            by = 1.0 / blocks[k, p, size + p]
            for i in range(p + 1, size):
                factor = blocks[k, i, size + p] * by
                for c in range(size + p + 1, end):
                    blocks[k, i, c] -= factor * blocks[k, p, c]
        for p in range(size - 1, -1, -1):
            for i in range(p + 1, size):
                factor = blocks[k, p, size + i]
                for c in range(2 * size, end):
                    blocks[k, p, c] -= factor * blocks[k, i, c]
            by = 1.0 / blocks[k, p, size + p]
            for c in range(2 * size, end):
                blocks[k, p, c] *= by
    for k in range(count - 2, -1, -1):
        for i in range(size):
            for c in range(size):
                blocks[k, i, end - 1] -= blocks[k, i, 2 * size + c] * blocks[k + 1, c, end - 1]
