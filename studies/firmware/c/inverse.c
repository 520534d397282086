
/* --- inverse: the f at which f + h is the reference, by Brent's method in a bracket ---------------------------------- */

#define SATURATION R(${saturation})     /* largest |h|, deg */

static real excess(const notchbend_state *state, real f, real target)
{
    return f + hysteresis(state->memory, state->f_deg, f, 0) - target;
}

static real path_to(const notchbend_state *state, real target)
{
    real at = state->f_deg, missing = target - at - hysteresis(state->memory, at, at, 0);
    /* |h| is within saturation at both ends, so this bracket contains the angle. */
    real reach = 2 * (1 + BEYOND) * SATURATION;
    real before = at, x = at + missing + (missing < 0 ? -reach : reach), other = 0;
    real f_before = excess(state, before, target), f_x = excess(state, x, target), f_other = 0;
    real step_before = 0, step = 0, tolerance = PRECISION * magnitude(x - at);
    int k;
    if (!(missing < 0) && !(missing > 0))
        return at;
    if ((f_before < 0) == (f_x < 0))    /* what is missing is below rounding */
        return magnitude(f_before) <= magnitude(f_x) ? before : x;
    for (k = 0; k < 100; k++) {
        real delta, half, tried;
        if ((f_before < 0 && f_x > 0) || (f_before > 0 && f_x < 0)) {
            other = before;
            f_other = f_before;
            step_before = step = x - before;
        }
        if (magnitude(f_other) < magnitude(f_x)) {
            before = x;
            x = other;
            other = before;
            f_before = f_x;
            f_x = f_other;
            f_other = f_before;
        }
        delta = R(0.5) * (tolerance + ROUNDING * magnitude(x));
        half = R(0.5) * (other - x);
        if (!(f_x < 0 || f_x > 0) || magnitude(half) < delta)
            return x;
        tried = LARGEST;
        if (magnitude(step_before) > delta && magnitude(f_x) < magnitude(f_before)) {
            if (!(before < other) && !(before > other)) {
                tried = -f_x * (x - before) / (f_x - f_before);
            } else {
                real a = (f_before - f_x) / (before - x), b = (f_other - f_x) / (other - x);
                real below = b * a * (f_other - f_before);
                if (below < 0 || below > 0)
                    tried = -f_x * (f_other * b - f_before * a) / below;
            }
        }
        if (2 * magnitude(tried) < smaller(magnitude(step_before), 3 * magnitude(half) - delta)) {
            step_before = step;
            step = tried;
        } else {
            step_before = step = half;
        }
        before = x;
        f_before = f_x;
        x += magnitude(step) > delta ? step : half > 0 ? delta : -delta;
        f_x = excess(state, x, target);
    }
    return x;
}
