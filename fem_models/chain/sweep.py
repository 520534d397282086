"""One Newton step of a chain without loads from outside: joints condensed, then blocks of both tendons' slips.

The balance of a joint has its angle and the slips at the guides on either side alone. It gives the angle by the slips
(static condensation), and the balances of the guides become a block tridiagonal system of two tendons, solved by one
sweep to the tip and one back (Thomas 1949). It is the elimination of :func:`fem_models.chain.newton.eliminate` in
another order, with a third of its operations.
"""

from __future__ import annotations

from fem_models.chain.compiled import chain_njit
from fem_models.chain.equations import (
    BY_WRAP,
    CROSS,
    HOLDS,
    OWN,
    SLIDES,
    STIFF,
    TURN,
    Balance,
    Work,
    half_sign,
)
from hysteresis.arrays import Floats


@chain_njit(forceinline=True, error_model="python")  # a zero pivot raises ZeroDivisionError
def sweep(x: Floats, work: Work, balance: Balance) -> None:
    """Solve the tangent at x for the residuals, in place."""
    b, rows, kept, n = work.residual, work.rows, work.swept, work.rows.shape[1]
    own_a, own_b, cross = balance.free[0], balance.free[1], 0.0  # of the span before the guide
    turn_a = turn_b = give_a = give_b = give = lean = 0.0  # slopes by the joint before, and that joint by its stretch
    xaa = xab = xba = xbb = ya = yb = 0.0  # of the guide before
    for i in range(n):
        u, row = 3 * i + 1, 3 * i + 3
        slides_a, slides_b = rows[SLIDES, i], rows[SLIDES + 1, i]
        into_a, into_b, out_a, out_b = 1.0 - slides_a, 1.0 - slides_b, 1.0 + slides_a, 1.0 + slides_b
        wrap_a, wrap_b = rows[BY_WRAP, i], rows[BY_WRAP + 1, i]
        # the span before, its joint condensed: both slopes by (slip at the guide before) - (slip here)
        bent_a, bent_b = into_a * turn_a - wrap_a * lean, into_b * turn_b - wrap_b * lean
        laa, lab = into_a * own_a - bent_a * give_a, into_a * cross - bent_a * give_b
        lba, lbb = into_b * cross - bent_b * give_a, into_b * own_b - bent_b * give_b
        ga, gb = b[u] - bent_a * give, b[u + 1] - bent_b * give
        daa, dab, dba, dbb = -laa - rows[HOLDS, i], -lab, -lba, -lbb - rows[HOLDS + 1, i]
        # the span beyond
        own_a, own_b, cross = rows[OWN, i], rows[OWN + 1, i], rows[CROSS, i]
        turn_a, turn_b, lean = rows[TURN, i], rows[TURN + 1, i], half_sign(x[row])
        soft = 1.0 / rows[STIFF, i]
        give_a, give_b, give = turn_a * soft, turn_b * soft, b[row] * soft
        bent_a, bent_b = -(out_a * turn_a + wrap_a * lean), -(out_b * turn_b + wrap_b * lean)
        uaa, uab = out_a * own_a + bent_a * give_a, out_a * cross + bent_a * give_b
        uba, ubb = out_b * cross + bent_b * give_a, out_b * own_b + bent_b * give_b
        ga, gb = ga - bent_a * give, gb - bent_b * give
        # forward elimination
        daa, dab = daa - uaa - (laa * xaa + lab * xba), dab - uab - (laa * xab + lab * xbb)
        dba, dbb = dba - uba - (lba * xaa + lbb * xba), dbb - ubb - (lba * xab + lbb * xbb)
        ga, gb = ga - (laa * ya + lab * yb), gb - (lba * ya + lbb * yb)
        inverse = 1.0 / (daa * dbb - dab * dba)
        xaa, xab = inverse * (dbb * uaa - dab * uba), inverse * (dbb * uab - dab * ubb)
        xba, xbb = inverse * (daa * uba - dba * uaa), inverse * (daa * ubb - dba * uab)
        ya, yb = inverse * (dbb * ga - dab * gb), inverse * (daa * gb - dba * ga)
        kept[i, 0], kept[i, 1], kept[i, 2], kept[i, 3] = xaa, xab, xba, xbb
        kept[i, 4], kept[i, 5] = ya, yb
        kept[i, 6], kept[i, 7], kept[i, 8] = give_a, give_b, give
    beyond_a = beyond_b = 0.0  # the tip
    for i in range(n - 1, -1, -1):
        a = kept[i, 4] - kept[i, 0] * beyond_a - kept[i, 1] * beyond_b
        c = kept[i, 5] - kept[i, 2] * beyond_a - kept[i, 3] * beyond_b
        b[3 * i + 3] = kept[i, 8] - kept[i, 6] * (a - beyond_a) - kept[i, 7] * (c - beyond_b)
        b[3 * i + 1], b[3 * i + 2] = a, c
        beyond_a, beyond_b = a, c
