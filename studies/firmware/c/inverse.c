
/* --- inverse: the f at which the angle is the reference, by Halley's method in a bracket that is halved where it fails ---- */

#define SATURATION R(${saturation})     /* largest |h|, deg */
#define SMOOTH R(${smooth})     /* a part of f, deg, over which h bends little, so that the error is its third power */

/* The angle of an f and an h. */
static real angle_at(const notchbend_state *state, real f, real h)
{
    return state->zero_deg + state->gain * f + h;
}

/* Find f; ``way`` becomes the way there from state->f_deg, and *computed the f at which h was last computed. */
static real path_to(const notchbend_state *state, real target, struct way *way, int *direction, real *computed)
{
    real at = state->f_deg, missing = target - angle_at(state, at, state->h_deg);
    /* |h| is within saturation at both ends, so a path of this length is beyond the angle. */
    real low = 0, high = (magnitude(missing) + 2 * (1 + BEYOND) * SATURATION * state->width) / state->gain;
    real x = 0, over = -magnitude(missing), tolerance = R(0.5) * (PRECISION * high + ROUNDING * magnitude(at)), last;
    int k;
    *computed = at;
    *direction = missing < 0 ? -1 : 1;
    depart(way, state->memory, at, *direction, state->width);
    if (!(over < 0))
        return at;
    last = 4 * over;
#ifdef CORNER                           /* h may drop there, and the reference be reached twice: the first one counts */
    if (*direction * (CORNER - at) > 0 && *direction * (CORNER - at) < high) {
        real slopes[2] = {0, 0};
        x = *direction * (CORNER - at);
        if (*direction * (angle_at(state, CORNER, arrive(way, at, CORNER, *direction, slopes)) - target) < 0) {
            low = x;
        } else {
            high = x;
            x = 0;
        }
    }
#endif
    for (k = 0; k < 100; k++) {
        real slopes[2] = {0, 0}, slope, below, next, change;
        int close;
        real h = arrive(way, at, *computed = at + *direction * x, *direction, slopes);
        if (x > 0)
            over = *direction * (angle_at(state, *computed, h) - target);
        if (magnitude(over) <= ROUNDING * magnitude(target))
            break;
        if (over < 0)
            low = x;
        else
            high = x;
        slope = state->gain + slopes[0];
        below = slope * slope - R(0.5) * over * *direction * slopes[1];
        next = slope > 0 && below > R(0.5) * slope * slope ? x - over * slope / below : x - over / slope;
        /* one more change of x needs no look at h */
        close = magnitude(over) <= CLOSE * SATURATION && slope > R(0.1) && next >= low && next <= high;
        if (k == 0 && !(slope > R(0.1)))
            next = high;            /* h first moves against f */
        else if (!close && !(slope > 0 && next >= low && next <= high && magnitude(over) <= R(0.5) * magnitude(last)))
            next = R(0.5) * (low + high);
        last = over;
        change = magnitude(next - x);
        x = next;
        if (change <= tolerance || change <= SMOOTH || close || high - low <= tolerance)
            break;
    }
    return at + *direction * x;
}
