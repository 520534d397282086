
/* --- Prandtl-Ishlinskii: stops, each of which follows f within +- its threshold -------------------------------------
   The memory is f minus each stop, the output of a play: it stands still while the stop moves, and gathers no rounding. */

enum { ELEMENTS = ${count}, STOPS = ${stops} };

struct element {
    real weight, more_of_last;  /* of each stop; of the last beside it */
    real thresholds[STOPS];     /* deg */
};

static const struct element LAW[ELEMENTS] = {
${elements}
};

${width_function}

struct way {
    real scale;                 /* factor on the thresholds */
    const real *memory;         /* the plays tell where f was */
    real h, slope;              /* where h was last computed */
${width_member}};

/* Begin a straight way of f. */
static void depart(struct way *way, const real *memory, real at, int direction, real width)
{
    (void)at;
    (void)direction;
    way->memory = memory;
    way->scale = width;
}

/* Give h at f on the way from f = at; its first and second slope there are added to ``slopes``. */
static real arrive(struct way *way, real at, real f, int direction, real *slopes)
{
    const real nudge = 8 * ROUNDING * direction * magnitude(f);     /* a stop at its limit is one that no longer moves */
    const real *plays = way->memory;
    real sum = 0;
    int i, k;
    (void)at;
    for (i = 0; i < ELEMENTS; i++, plays += STOPS) {
        const struct element *e = &LAW[i];
        real moving = 0, held = 0, stop = 0, of_last = 1${growth};
        int moves = 0;
        for (k = 0; k < STOPS; k++) {
            const real limit = ${width} * e->thresholds[k];
            stop = f + nudge - plays[k];
            if (stop >= limit) {
                held += stop = limit;
            } else if (stop <= -limit) {
                held += stop = -limit;
            } else {
                moving += stop;
                moves++;
                continue;
            }
            of_last = k < STOPS - 1;
        }
        sum += e->weight * (moving - nudge * moves + held) + e->more_of_last * (stop - nudge * of_last);
        slopes[0] += e->weight * ${moving} + e->more_of_last * ${moves};
${bends}${keeps_width}    }
    way->h = sum;
    way->slope = slopes[0];
    return sum;
}

/* Make the memory that of f, where h was last computed or nearer than counts; gives h. */
static real settle(const struct way *way, real last, real f, int direction, real *memory)
{
    real *play = memory;
    int i, k;
    (void)direction;
    for (i = 0; i < ELEMENTS; i++) {
        for (k = 0; k < STOPS; k++, play++) {
            const real limit = ${settled_width} * LAW[i].thresholds[k];
            if (*play < f - limit)
                *play = f - limit;
            else if (*play > f + limit)
                *play = f + limit;
        }
    }
    return way->h + way->slope * (f - last);
}
