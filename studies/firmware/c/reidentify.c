
/* --- re-identification: recursive least squares of zero, gain and width, with directional forgetting ------------------
   root is a square root S of the covariance, in units of SCALE. With f = S' phi and seen = f' f, both over the noise, S
   becomes S (I - m f f'), m seen = 1 - 1 / sqrt(lambda (1 + seen)); the estimate moves by S f e / (1 + seen). */

#ifdef NOTCHBEND_FLOAT
#define SQRT sqrtf
#else
#define SQRT sqrt
#endif

#define WIDER R(${wider})           /* width of the second law over that of the first one, for the slope of h by width */
#define NOISE R(${noise})
#define SPACING R(${spacing})         /* change of f between samples that count, deg */
#define FORGETTING R(${forgetting})
#define ALIKE R(${alike})             /* samples in a row whose errors are one */
#define OF_ONE R(${of_one})            /* noise of a sample as one of so many, deg */
#define OUTSIDE_SQUARE R(${outside_square})  /* mean square of the errors beyond which the fit does not hold, deg^2 */
#define CLIPPED R(${clipped})

static const real SCALE[3] = {${scale}};
static const real LOWEST[3] = {${lowest}};
static const real HIGHEST[3] = {${highest}};

/* Shrink the root along a direction; 0 where a variance would pass its first one. */
static int shrunk_root(const real (*root)[3], const real *direction, const real *along, real seen, real kept, real (*found)[3])
{
    real shrink = (1 - 1 / SQRT(kept * (1 + seen))) / seen;
    int i, j, fits = 1;
    for (i = 0; i < 3; i++) {
        real square = 0;
        for (j = 0; j < 3; j++) {
            found[i][j] = root[i][j] - shrink * along[i] * direction[j];
            square += found[i][j] * found[i][j];
        }
        fits = fits && square <= 1;
    }
    return fits;
}

/* Put both memories where they would be with a width times a ratio all along, to first order. */
static void with_width(real *wider, real *memory, real ratio)
{
    int i;
    for (i = 0; i < ${memory}; i++) {
        const real by_width = wider[i] - memory[i];
        memory[i] += (ratio - 1) / (WIDER - 1) * by_width;
        wider[i] = memory[i] + ratio * by_width;
    }
}

void notchbend_estimator_init(notchbend_estimator *estimator, const notchbend_state *state)
{
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            estimator->root[i][j] = i == j;
    for (i = 0; i < ${memory}; i++)
        estimator->memory[i] = state->memory[i];
    estimator->f_deg = estimator->sampled_deg = state->f_deg;
    estimator->mean_square = NOISE * NOISE;
    estimator->flags = 0;
    follow(estimator->memory, state->f_deg, state->f_deg, WIDER * state->width);
}

unsigned notchbend_estimate(notchbend_estimator *estimator, notchbend_state *state, notchbend_real angle_deg)
{
    real *drift[3], phi[3], along[3], direction[3], found[3][3], error, seen = 0, most, width = state->width;
    real at = estimator->f_deg, f = state->f_deg, h = follow(estimator->memory, at, f, WIDER * width);
    int i, j;
    estimator->f_deg = f;
    estimator->flags &= NOTCHBEND_OUTSIDE_FIT;
    if (!is_finite(angle_deg))
        return estimator->flags |= NOTCHBEND_NOT_FINITE;
    if (magnitude(f - estimator->sampled_deg) < SPACING)
        return estimator->flags |= NOTCHBEND_NOT_EXCITED;
    drift[0] = &state->zero_deg;
    drift[1] = &state->gain;
    drift[2] = &state->width;
    phi[0] = SCALE[0] / OF_ONE;
    phi[1] = SCALE[1] * f / OF_ONE;
    phi[2] = SCALE[2] * ((h - state->h_deg) / ((WIDER - 1) * width)) / OF_ONE;
    for (j = 0; j < 3; j++) {
        direction[j] = 0;
        for (i = 0; i < 3; i++)
            direction[j] += phi[i] * estimator->root[i][j];
        seen += direction[j] * direction[j];
    }
    error = angle_deg - angle_at(state, f, state->h_deg);
    most = CLIPPED * NOISE * SQRT(1 + ALIKE * seen);
    error = error < -most ? -most : error > most ? most : error;
    estimator->mean_square = FORGETTING * estimator->mean_square + (1 - FORGETTING) * (error * error);
    estimator->flags = estimator->mean_square > OUTSIDE_SQUARE ? NOTCHBEND_OUTSIDE_FIT : 0u;
    for (i = 0; i < 3; i++) {
        real wanted;
        along[i] = 0;
        for (j = 0; j < 3; j++)
            along[i] += estimator->root[i][j] * direction[j];
        wanted = *drift[i] + SCALE[i] * (along[i] * (error / (OF_ONE * (1 + seen))));
        if (wanted < LOWEST[i] || wanted > HIGHEST[i])
            estimator->flags |= NOTCHBEND_AT_BOUND;
        *drift[i] = wanted < LOWEST[i] ? LOWEST[i] : wanted > HIGHEST[i] ? HIGHEST[i] : wanted;
    }
    if (!shrunk_root((const real (*)[3])estimator->root, direction, along, seen, FORGETTING, found))
        shrunk_root((const real (*)[3])estimator->root, direction, along, seen, 1, found);
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            estimator->root[i][j] = found[i][j];
    with_width(estimator->memory, state->memory, state->width / width);
    follow(estimator->memory, f, f, WIDER * state->width);
    state->h_deg = follow(state->memory, f, f, state->width);
    estimator->sampled_deg = f;
    return estimator->flags;
}
