
/* --- f: the single-valued part of the angle, a monotone cubic between the places of identify.json -------------------- */

enum { PLACES_OF_F = ${places_of_f} };

static const real DRIVE[PLACES_OF_F] = {
${drive}
};

static const real ANGLE[PLACES_OF_F] = {
${angle}
};

static const real SLOPE[PLACES_OF_F] = {  /* deg for each ${unit} */
${slope}
};

/* Find the interval of x, 0 to PLACES_OF_F - 2, in a table that rises (sign 1) or falls (-1). */
static int interval(const real *table, real x, int sign)
{
    int low = 0, high = PLACES_OF_F - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (sign * table[middle] <= sign * x)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* The cubic of interval i at u from 0 to 1, and its slope there. */
static real cubic(int i, real u, real *slope)
{
    real size = DRIVE[i + 1] - DRIVE[i], rise = ANGLE[i + 1] - ANGLE[i];
    real a = SLOPE[i] * size, b = SLOPE[i + 1] * size;
    real second = 3 * rise - 2 * a - b, third = a + b - 2 * rise;
    *slope = a + u * (2 * second + 3 * u * third);
    return ANGLE[i] + u * (a + u * (second + u * third));
}

static real curve(real drive)
{
    int i = interval(DRIVE, drive, 1);
    real slope;
    return cubic(i, (drive - DRIVE[i]) / (DRIVE[i + 1] - DRIVE[i]), &slope);
}

/* Give the drive at which f is an angle, which lies between the ends of f: Newton's method, and halving where it
   leaves the bracket. */
static real drive_at(real f)
{
    const int sign = ANGLE[PLACES_OF_F - 1] > ANGLE[0] ? 1 : -1;
    int i = interval(ANGLE, f, sign), k;
    real low = 0, high = 1, u = (f - ANGLE[i]) / (ANGLE[i + 1] - ANGLE[i]);
    for (k = 0; k < 60; k++) {
        real slope, over = sign * (cubic(i, u, &slope) - f), next, near;
        if (over > 0)
            high = u;
        else
            low = u;
        slope *= sign;
        next = slope > 0 ? u - over / slope : -1;
        near = NEWTON;
        if (!(next >= low && next <= high)) {
            next = R(0.5) * (low + high);
            near = ROUNDING;
        }
        if (magnitude(next - u) <= near)
            return DRIVE[i] + next * (DRIVE[i + 1] - DRIVE[i]);
        u = next;
    }
    return DRIVE[i] + u * (DRIVE[i + 1] - DRIVE[i]);
}
