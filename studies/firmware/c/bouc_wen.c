
/* --- Bouc-Wen, improved form: the sum of elements h, whose memory is h itself --------------------------------------- */

enum { ELEMENTS = ${count} };

struct element {
    real scale;                 /* saturation with the sign of A, deg */
    real per_deg;               /* |A| / saturation */
    real kappa, y_below;        /* (beta - gamma) / (beta + gamma), and the limit of a chart */
};

static const struct element LAW[ELEMENTS] = {
${elements}
};

/* Give h at f, on the straight way from f = at; ``after`` becomes the memory there, unless it is 0. */
static real hysteresis(const real *memory, real at, real f, real *after)
{
    real path = magnitude(f - at), sum = 0;
    int direction = f < at ? -1 : 1, i;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real y = memory[i] / e->scale, h;
        y = direction * (y > 1 ? 1 : y < -1 ? -1 : y);
        y = smaller(1, advance(y, path * e->per_deg, e->kappa, e->y_below, &FLOWS[i]));
        h = direction * e->scale * y;
        sum += h;
        if (after)
            after[i] = h;
    }
    return sum;
}
