
/* --- flow: dy/ds = 1 - y^n for y > 0, 1 + kappa |y|^n for y < 0, along a path s; y is positive with the motion ----
   Three charts: a series in |y|^n around zero, a series in exp(-n s) near saturation, Taylor steps elsewhere. */

#ifdef NOTCHBEND_FLOAT
#define EXP expf
#define POW powf
#define TOLERANCE R(1e-8)       /* of a Taylor step; y is of order 1 */
#define LAST_POWER R(1e-9)
#define SATURATED R(1e-9)       /* distance from saturation that is none */
#define OUTSIDE R(1e-6)         /* a place just outside a chart, so that it is not entered again */
#else
#define EXP exp
#define POW pow
#define TOLERANCE R(1e-13)
#define LAST_POWER R(1e-17)
#define SATURATED R(1e-17)
#define OUTSIDE R(1e-12)
#endif

enum { ORDER = 24, TAYLOR_ORDER = 16 };
enum chart { FREE, ZERO, TOP };

struct flow {                   /* of one exponent n */
    real n, t_above, y_above, u_top, y_top, y_over;     /* limits of the charts */
    real most;                  /* largest argument of the series around zero */
    real around_zero[ORDER + 1], near_top[ORDER + 1];   /* coefficients of their series */
};

${flows}

static real series(const real *c, real x, int order)
{
    real square = x * x, even = c[order], odd = c[order - 1];
    int k;
    for (k = order - 2; k > 0; k -= 2) {
        even = even * square + c[k];
        odd = odd * square + c[k - 1];
    }
    return even * square + c[0] + odd * x;
}

/* A series and its slope by x. */
static real series_and_slope(const real *c, real x, int order, real *slope)
{
    real sum = c[order], rise = 0;
    int k;
    for (k = order - 1; k >= 0; k--) {
        rise = rise * x + sum;
        sum = sum * x + c[k];
    }
    *slope = rise;
    return sum;
}

/* How many terms count. */
static int terms_near(real x, real limit)
{
    real size = magnitude(x);
    if (size > R(0.25) * limit)
        return ORDER;
    return size > R(0.06) * limit ? 16 : size > R(3e-4) * limit ? 10 : 4;
}

/* The path from zero to y, with power = |y|^n. */
static real path_from_zero(real y, real power_of_y, real n, real kappa)
{
    real x = power_of_y * (y > 0 ? 1 : -kappa);
    real total = 0, power = 1, k = 1;
    while (magnitude(power) > LAST_POWER) {
        total += power / k;
        power *= x;
        k += n;
    }
    return y * total;
}

/* Invert the series near saturation by Newton's method; *power becomes y^n. */
static real place_near_top(real y, const struct flow *flow, real *power)
{
    real slope = -1, u = (1 - y) * (1 + flow->near_top[2] * (1 - y));
    int k;
    for (k = 0; k < 12; k++) {
        real found = series_and_slope(flow->near_top, u, terms_near(u, flow->u_top), &slope);
        real change = (found - y) / slope;
        u -= change;
        if (magnitude(change) <= NEWTON)
            break;
    }
    *power = 1 + flow->n * u * slope;       /* dy/ds = -n u dy/du */
    return u;
}

static real shrunk(real last, int order)
{
    return last > TOLERANCE ? POW(TOLERANCE / last, 1 / R(order)) : 1;
}

/* One Taylor step of dw/ds = sign (1 - g w^n), w > 0, of at most *step, which becomes its length; gives the new w.
   p = w^n obeys w p' = n p w'. */
static real taylor(real w0, real power, real *step, real n, real g, int sign)
{
    real w[TAYLOR_ORDER + 1], p[TAYLOR_ORDER + 1];
    real over = 1 / w0, scale = -sign * g * *step, total, shrink;
    int j, k;
    w[0] = w0;
    p[0] = power;
    w[1] = sign * (1 - g * power) * *step;
    total = w0 + w[1];
    for (k = 1; k < TAYLOR_ORDER; k++) {
        real term = 0;
        for (j = 1; j <= k; j++)
            term += ((n + 1) * R(j) - R(k)) * w[j] * p[k - j];
        p[k] = term * over / R(k);
        w[k + 1] = scale * p[k] / R(k + 1);
        total += w[k + 1];
        if (magnitude(w[k]) + magnitude(w[k + 1]) <= TOLERANCE)
            return total;
    }
    shrink = R(0.9) * smaller(shrunk(magnitude(w[TAYLOR_ORDER]), TAYLOR_ORDER),
                              shrunk(magnitude(w[TAYLOR_ORDER - 1]), TAYLOR_ORDER - 1));
    total = w[TAYLOR_ORDER];
    for (k = TAYLOR_ORDER - 1; k >= 0; k--)
        total = total * shrink + w[k];
    *step *= shrink;
    return total;
}

/* Where y stands: in a chart with its place there, or between the charts; power = |y|^n. */
struct place_of_y {
    enum chart chart;
    real y, place, power;
};

static struct place_of_y located(real y, real kappa, real y_below, const struct flow *flow)
{
    struct place_of_y found;
    found.y = y;
    found.place = 0;
    found.chart = FREE;
    if (flow->y_top <= y && y <= flow->y_over) {
        found.chart = TOP;
        found.place = place_near_top(y, flow, &found.power);
        return found;
    }
    found.power = POW(magnitude(y), flow->n);
    if (-y_below <= y && y <= flow->y_above) {
        found.chart = ZERO;
        found.place = path_from_zero(y, found.power, flow->n, kappa);
    }
    return found;
}

/* Advance y by a path s >= 0; y_below is the limit of the chart around zero for y < 0. *power becomes |y|^n there. */
static real advance(const struct place_of_y *from, real s, real kappa, real y_below, const struct flow *flow,
                    real *power)
{
    struct place_of_y at = *from;
    real n = flow->n;
    for (;;) {
        if (!(s > 0)) {
            *power = at.power;
            return at.y;
        }
        if (at.chart == TOP) {
            real rise, u = at.place * EXP(-n * s);
            real y = series_and_slope(flow->near_top, u, terms_near(u, flow->u_top), &rise);
            *power = 1 + n * u * rise;
            return magnitude(at.place) < SATURATED ? 1 : y;
        }
        if (at.chart == ZERO && at.place + s <= flow->t_above) {
            real place = at.place + s, size = POW(magnitude(place), n), y;
            size *= place > 0 ? 1 : -kappa;
            y = place * series(flow->around_zero, size, terms_near(size, flow->most));
            *power = POW(magnitude(y), n);
            return y;
        }
        if (at.chart == ZERO) {
            s -= flow->t_above - at.place;
            at.y = flow->y_above * (1 + OUTSIDE);
        } else {
            /* |y| at most halves below 0, so that no step crosses it; above 0 no term may overflow a float. */
            real size = magnitude(at.y), most, step;
            int sign = at.y > 0 ? 1 : -1;
            most = at.y < 0 ? R(0.5) * size / (1 + kappa * at.power) : at.y > 1 ? size / (n * at.power) : 1;
            step = smaller(s, most);
            at.y = sign * taylor(size, at.power, &step, n, at.y > 0 ? 1 : -kappa, sign);
            s -= step;
        }
        at = located(at.y, kappa, y_below, flow);
    }
}

/* Give dy/ds of power = |y|^n, and its own slope along s. */
static real rate(real y, real power, real n, real kappa, real *bend)
{
    real size = magnitude(y), found = y > 0 ? 1 - power : 1 + kappa * power;
    *bend = size > 0 ? -n * (y > 0 ? power : kappa * power) / size * found : 0;
    return found;
}
