
/* --- Prandtl-Ishlinskii: stops, each of which follows f within +- its threshold -------------------------------------
   The memory is f minus each stop, the output of a play: it stands still while the stop moves, and gathers no rounding. */

enum { ELEMENTS = ${count}, STOPS = ${stops} };

struct element {
    real weight, weight_of_last;
    real thresholds[STOPS];     /* deg */
};

static const struct element LAW[ELEMENTS] = {
${elements}
};

${width}

/* Give h at f, on the straight way from f = at; ``after`` becomes the memory there, unless it is 0. */
static real hysteresis(const real *memory, real at, real f, real *after)
{
    real sum = 0;
    int i, k;
    (void)at;                   /* the plays tell where f was */
    for (i = 0; i < ELEMENTS; i++) {
        const struct element *e = &LAW[i];
        real total = 0, stop = 0, width = ${width_at};
        for (k = 0; k < STOPS; k++) {
            real limit = width * e->thresholds[k];
            total += stop;      /* of the ones before: the last has a weight of its own */
            stop = f - memory[i * STOPS + k];
            stop = stop < -limit ? -limit : smaller(stop, limit);
            if (after)
                after[i * STOPS + k] = f - stop;
        }
        sum += e->weight * total + e->weight_of_last * stop;
    }
    return sum;
}
