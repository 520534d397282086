
/* --- the calls of the header ------------------------------------------------------------------------------------------ */

static const real START[${memory}] = {
${start}
};

static int is_finite(real x)
{
    return x >= -LARGEST && x <= LARGEST;
}

/* Hold a drive within those of the records. */
static real within(notchbend_state *state, real drive)
{
    if (drive < DRIVE[0]) {
        state->limited |= NOTCHBEND_AT_LOWEST;
        return DRIVE[0];
    }
    if (drive > DRIVE[PLACES_OF_F - 1]) {
        state->limited |= NOTCHBEND_AT_HIGHEST;
        return DRIVE[PLACES_OF_F - 1];
    }
    return drive;
}

/* Give the drive of an f; one beyond the ends of f is held there. */
static real held_drive_at(notchbend_state *state, real f)
{
    const int last = PLACES_OF_F - 1;
    const int sign = ANGLE[last] > ANGLE[0] ? 1 : -1;
    const real slack = R(1e-9) * magnitude(ANGLE[last] - ANGLE[0]);
    if (sign * f <= sign * ANGLE[0]) {
        state->limited |= sign * (ANGLE[0] - f) > slack ? NOTCHBEND_AT_LOWEST : 0u;
        return DRIVE[0];
    }
    if (sign * f >= sign * ANGLE[last]) {
        state->limited |= sign * (f - ANGLE[last]) > slack ? NOTCHBEND_AT_HIGHEST : 0u;
        return DRIVE[last];
    }
    return drive_at(f);
}

/* Move a memory from f = at to another f; gives h there. */
static real follow(real *memory, real at, real f, real width)
{
    struct way way;
    real slopes[2] = {0, 0};
    int direction = f < at ? -1 : 1;
    depart(&way, memory, at, direction, width);
    arrive(&way, at, f, direction, slopes);
    return settle(&way, f, f, direction, memory);
}

static void moved(notchbend_state *state, real drive, real f)
{
    state->h_deg = follow(state->memory, state->f_deg, f, state->width);
    state->f_deg = f;
    state->drive = drive;
}

void notchbend_reset(notchbend_state *state)
{
    int i;
    for (i = 0; i < ${memory}; i++)
        state->memory[i] = START[i];
    state->drive = R(${first_drive});
    state->f_deg = curve(state->drive);
    moved(state, state->drive, state->f_deg);
    state->limited = 0;
}

void notchbend_init(notchbend_state *state)
{
    state->largest_step = R(NOTCHBEND_LARGEST_STEP);
    state->zero_deg = 0;
    state->gain = 1;
    state->width = 1;
    notchbend_reset(state);
}

/* Hold a reference not far beyond what the ends of f give, lest the search of a huge one ends where it starts. */
static real held_reference(const notchbend_state *state, real reference)
{
    const int last = PLACES_OF_F - 1;
    real extent = magnitude(ANGLE[0]) + magnitude(ANGLE[last]) + magnitude(ANGLE[last] - ANGLE[0]);
    real most = state->gain * extent + 4 * SATURATION * state->width, off = reference - state->zero_deg;
    return state->zero_deg + (off > most ? most : off < -most ? -most : off);
}

notchbend_real notchbend_step(notchbend_state *state, notchbend_real reference_deg)
{
    struct way way;
    int direction;
    real f, computed, drive, most = state->largest_step;
    state->limited = 0;
    if (!is_finite(reference_deg)) {
        state->limited = NOTCHBEND_NOT_FINITE;
        return state->drive;
    }
    f = path_to(state, held_reference(state, reference_deg), &way, &direction, &computed);
    if (!(f < state->f_deg) && !(f > state->f_deg))
        return state->drive;
    drive = held_drive_at(state, f);
    if (most > 0 && magnitude(drive - state->drive) > most) {
        state->limited |= NOTCHBEND_AT_RATE;
        drive = drive < state->drive ? state->drive - most : state->drive + most;
    }
    if (state->limited) {       /* the model stays where the motor is */
        moved(state, drive, curve(drive));
        return drive;
    }
    state->h_deg = settle(&way, computed, f, direction, state->memory);
    state->f_deg = f;
    state->drive = drive;
    return drive;
}

notchbend_real notchbend_observe(notchbend_state *state, notchbend_real drive)
{
    state->limited = 0;
    if (!is_finite(drive)) {
        state->limited = NOTCHBEND_NOT_FINITE;
        drive = state->drive;
    }
    drive = within(state, drive);
    if (drive < state->drive || drive > state->drive)
        moved(state, drive, curve(drive));
    return angle_at(state, state->f_deg, state->h_deg);
}
