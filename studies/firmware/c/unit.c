#if defined _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { TIME, REFERENCE, MEASURED, LARGEST_STEP, DRIVE, ANGLE, ZERO, GAIN, WIDTH, LIMITED, FLAGS, REIDENTIFY };

struct unit {
    notchbend_state state;
    notchbend_estimator estimator;
    double time, reference, measured;
    int reidentify;
};

static void begun(struct unit *unit)
{
    memset(unit, 0, sizeof *unit);
    notchbend_init(&unit->state);
    notchbend_estimator_init(&unit->estimator, &unit->state);
    unit->reference = unit->measured = notchbend_observe(&unit->state, unit->state.drive);
}

static int given(struct unit *unit, unsigned reference, double *value)
{
    switch (reference) {
    case TIME: *value = unit->time; return 1;
    case REFERENCE: *value = unit->reference; return 1;
    case MEASURED: *value = unit->measured; return 1;
    case LARGEST_STEP: *value = unit->state.largest_step; return 1;
    case DRIVE: *value = unit->state.drive; return 1;
    case ANGLE: *value = unit->state.zero_deg + unit->state.gain * unit->state.f_deg + unit->state.h_deg; return 1;
    case ZERO: *value = unit->state.zero_deg; return 1;
    case GAIN: *value = unit->state.gain; return 1;
    case WIDTH: *value = unit->state.width; return 1;
    default: return 0;
    }
}

static int taken(struct unit *unit, unsigned reference, double value)
{
    switch (reference) {
    case REFERENCE: unit->reference = value; return 1;
    case MEASURED: unit->measured = value; return 1;
    case LARGEST_STEP: unit->state.largest_step = value; return 1;
    default: return 0;
    }
}

static int whole(const struct unit *unit, unsigned reference, int *value)
{
    if (reference != LIMITED && reference != FLAGS)
        return 0;
    *value = (int)(reference == LIMITED ? unit->state.limited : unit->estimator.flags);
    return 1;
}

/* One step: learn from the angle at the drive of the last step, then find the drive for the reference. */
static void stepped(struct unit *unit, double time)
{
    if (unit->reidentify)
        notchbend_estimate(&unit->estimator, &unit->state, unit->measured);
    notchbend_step(&unit->state, unit->reference);
    unit->time = time;
}
