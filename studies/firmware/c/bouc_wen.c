
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

struct way {
    real width;                 /* factor on the saturation */
    struct place_of_y from[ELEMENTS];
    real y[ELEMENTS], rate[ELEMENTS], bend[ELEMENTS];   /* where h was last computed, and slopes along the path there */
};

/* Begin a straight way of f in a direction, 1 or -1. */
static void depart(struct way *way, const real *memory, real at, int direction, real width)
{
    int i;
    (void)at;
    way->width = width;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real y = memory[i] / (e->scale * width);
        way->from[i] = located(direction * (y > 1 ? 1 : y < -1 ? -1 : y), e->kappa, e->y_below, &FLOWS[i]);
    }
}

/* Give h at f on the way from f = at; its first and second slope there are added to ``slopes``. */
static real arrive(struct way *way, real at, real f, int direction, real *slopes)
{
    real path = magnitude(f - at), sum = 0;
    int i;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real power, per_deg = e->per_deg / way->width, slope = e->scale * e->per_deg;
        way->y[i] = advance(&way->from[i], path * per_deg, e->kappa, e->y_below, &FLOWS[i], &power);
        way->rate[i] = rate(way->y[i], power, FLOWS[i].n, e->kappa, &way->bend[i]);
        sum += direction * e->scale * way->width * smaller(1, way->y[i]);
        slopes[0] += slope * way->rate[i];
        slopes[1] += direction * slope * per_deg * way->bend[i];
    }
    return sum;
}

/* Make the memory that of f, where h was last computed or so near that h bends little; gives h. */
static real settle(const struct way *way, real last, real f, int direction, real *memory)
{
    real path = direction * (f - last), sum = 0;
    int i;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real s = path * e->per_deg / way->width, y = way->y[i] + s * (way->rate[i] + R(0.5) * s * way->bend[i]);
        memory[i] = direction * e->scale * way->width * smaller(1, y);
        sum += memory[i];
    }
    return sum;
}
