
/* --- asymmetric Bouc-Wen: a limit of h for each side of a centre and each direction; the memory is h itself --------- */

enum { ELEMENTS = ${count} };

struct cell {
    real limit, kappa, y_below; /* largest |h| with the motion, deg; how much steeper against it; limit of a chart */
};

struct element {
    real slope, sign, centre;   /* |A|, sign of A, deg */
    struct cell cells[2][2];    /* below and above the centre, f falling and rising */
};

static const struct element LAW[ELEMENTS] = {
${elements}
};

/* Advance z = sign(A) h from f = a to b, both on one side of the centre. */
static real within_a_side(real z, real a, real b, const struct element *e, const struct flow *flow)
{
    const struct cell *c = &e->cells[a + b > 2 * e->centre][b > a];
    int direction = b > a ? 1 : -1;
    if (!(a < b) && !(a > b))
        return z;
    return direction * c->limit *
           advance(direction * z / c->limit, magnitude(b - a) * e->slope / c->limit, c->kappa, c->y_below, flow);
}

/* Give h at f, on the straight way from f = at; ``after`` becomes the memory there, unless it is 0. */
static real hysteresis(const real *memory, real at, real f, real *after)
{
    real sum = 0;
    int i;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real z = e->sign * memory[i], from = at;
        if ((at - e->centre) * (f - e->centre) < 0) {   /* a step across the centre is divided there */
            z = within_a_side(z, at, e->centre, e, &FLOWS[i]);
            from = e->centre;
        }
        z = within_a_side(z, from, f, e, &FLOWS[i]);
        sum += e->sign * z;
        if (after)
            after[i] = e->sign * z;
    }
    return sum;
}
