
/* --- no hysteresis: the fit found none above the noise --------------------------------------------------------------- */

struct way {
    int none;
};

static void depart(struct way *way, const real *memory, real at, int direction, real width)
{
    (void)memory;
    (void)width;
    (void)at;
    way->none = direction;
}

static real arrive(struct way *way, real at, real f, int direction, real *slopes)
{
    (void)way;
    (void)at;
    (void)f;
    (void)direction;
    (void)slopes;
    return 0;
}

static real settle(const struct way *way, real last, real f, int direction, real *memory)
{
    (void)way;
    (void)last;
    (void)f;
    (void)direction;
    (void)memory;
    return 0;
}
