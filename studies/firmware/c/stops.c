
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
    real sum = 0;
    int i, k;
    (void)at;
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        const real *plays = &way->memory[i * STOPS];
        real total = 0, stop = 0${growth};
        int moving = 0, moves = 0;
        for (k = 0; k < STOPS; k++) {
            const real limit = ${width} * e->thresholds[k];
            real ahead;
            stop = f - plays[k];
            ahead = stop + nudge;
            moves = ahead < limit && ahead > -limit;
            stop = stop < limit ? stop : limit;
            stop = stop > -limit ? stop : -limit;
            moving += moves;
            total += stop;${growing}
        }
        sum += e->weight * total + e->more_of_last * stop;
        slopes[0] += e->weight * ${moving} + e->more_of_last * ${moves};
${keeps_width}    }
    way->h = sum;
    way->slope = slopes[0];
    return sum;
}

/* Make the memory that of f, where h was last computed or nearer than counts; gives h. */
static real settle(const struct way *way, real last, real f, int direction, real *memory)
{
    int i, k;
    (void)direction;
    for (i = 0; i < ELEMENTS; i++) {
        for (k = 0; k < STOPS; k++) {
            const real limit = ${settled_width} * LAW[i].thresholds[k];
            real *play = &memory[i * STOPS + k];
            *play = *play > f - limit ? *play : f - limit;
            *play = *play < f + limit ? *play : f + limit;
        }
    }
    return way->h + way->slope * (f - last);
}
