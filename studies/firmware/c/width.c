#ifdef NOTCHBEND_FLOAT
#define EXP expf
#else
#define EXP exp
#endif

struct place {
    real skew, bow, centre, half;       /* of the width exp(skew x + bow x^2), x = (f - centre) / half */
};

static const struct place PLACES[ELEMENTS] = {
${places}
};

/* Give the width at f; *growth becomes its slope over the width, *bend its second slope over the width. */
static real width_at(real f, const struct place *p, real *growth, real *bend)
{
    real x = (f - p->centre) / p->half;
    if (x > -R(${farthest}) && x < R(${farthest})) {
        *growth = (p->skew + 2 * p->bow * x) / p->half;
        *bend = *growth * *growth + 2 * p->bow / (p->half * p->half);
    }
    x = x < -R(${farthest}) ? -R(${farthest}) : smaller(x, R(${farthest}));
    return EXP((p->skew + p->bow * x) * x);
}
