
/* --- asymmetric Bouc-Wen: a limit of h for each side of a centre and each direction; the memory is h itself --------- */

enum { ELEMENTS = ${count} };

struct cell {
    real limit, kappa, y_below; /* largest |h| with the motion, deg; how much steeper against it; limit of a chart */
};

struct element {
    real slope, sign, centre, most;     /* |A|, sign of A, deg, largest limit */
    struct cell cells[2][2];    /* below and above the centre, f falling and rising */
};

static const struct element LAW[ELEMENTS] = {
${elements}
};

#define CORNER LAW[0].centre    /* the same of all elements */

/* From the start of the way to the centre if it lies ahead, and from there on. */
struct way {
    real width;                 /* factor on the limits */
    struct side {
        const struct cell *cell;
        real limit;             /* of h, deg */
        real begin;             /* f, deg */
        struct place_of_y from; /* z in its direction over the limit of the cell */
    } sides[ELEMENTS][2];
    int ahead[ELEMENTS];        /* whether the centre lies ahead */
    int beyond[ELEMENTS];       /* whether the second side is known */
    real h[ELEMENTS], slope[ELEMENTS];      /* where it was last computed */
};

static void begin(struct side *side, const struct element *e, const struct flow *flow, int above, int direction,
                  real width, real f, real z)
{
    side->cell = &e->cells[above][direction > 0];
    side->limit = side->cell->limit * width;
    side->begin = f;
    side->from = located(direction * z / side->limit, side->cell->kappa, side->cell->y_below, flow);
}

/* Begin a straight way of f in a direction, 1 or -1; z = sign(A) h. */
static void depart(struct way *way, const real *memory, real at, int direction, real width)
{
    int i;
    way->width = width;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real most = e->most * width, z = e->sign * memory[i];
        way->ahead[i] = direction * (e->centre - at) > 0;
        way->beyond[i] = 0;
        begin(&way->sides[i][0], e, &FLOWS[i], (direction > 0) != way->ahead[i], direction, width, at,
              z < -most ? -most : smaller(z, most));
    }
}

static real within_a_side(const struct side *side, real f, const struct element *e, const struct flow *flow, real *power)
{
    const struct cell *c = side->cell;
    return advance(&side->from, magnitude(f - side->begin) * e->slope / side->limit, c->kappa, c->y_below, flow, power);
}

/* Give h at f on the way from f = at; its first and second slope there are added to ``slopes``. */
static real arrive(struct way *way, real at, real f, int direction, real *slopes)
{
    real sum = 0;
    int i;
    (void)at;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        struct side *sides = way->sides[i], *side = &sides[0];
        real y, power, bend;
        if (way->ahead[i] && direction * (f - e->centre) > 0) {     /* a step across the centre is divided there */
            if (!way->beyond[i])
                begin(&sides[1], e, &FLOWS[i], direction > 0, direction, way->width, e->centre,
                      direction * side->limit * within_a_side(side, e->centre, e, &FLOWS[i], &power));
            way->beyond[i] = 1;
            side = &sides[1];
        }
        y = within_a_side(side, f, e, &FLOWS[i], &power);
        way->h[i] = e->sign * direction * side->limit * y;
        way->slope[i] = e->sign * e->slope * rate(y, power, FLOWS[i].n, side->cell->kappa, &bend);
        sum += way->h[i];
        slopes[0] += way->slope[i];
        slopes[1] += e->sign * direction * e->slope * e->slope / side->limit * bend;
    }
    return sum;
}

/* Make the memory that of f, where h was last computed or nearer than counts; gives h. */
static real settle(const struct way *way, real last, real f, int direction, real *memory)
{
    real sum = 0;
    int i;
    (void)direction;
    for (i = 0; i < ELEMENTS; i++) {
        memory[i] = way->h[i] + way->slope[i] * (f - last);
        sum += memory[i];
    }
    return sum;
}
