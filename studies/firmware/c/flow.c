
/* --- flow: dy/ds = 1 - y^n for y > 0, 1 + kappa |y|^n for y < 0, along a path s; y is positive with the motion ----
   Three charts: a series in |y|^n around zero, a series in exp(-n s) near saturation, Taylor steps elsewhere. */

#ifdef NOTCHBEND_FLOAT
#define EXP expf
#define POW powf
#define TOLERANCE R(1e-8)       /* of a Taylor step; y is of order 1 */
#define LAST_POWER R(1e-9)
#define SATURATED R(1e-9)       /* distance from saturation that is none */
#define NEWTON R(1e-4)          /* change after which the next one is below rounding */
#define OUTSIDE R(1e-6)         /* a place just outside a chart, so that it is not entered again */
#else
#define EXP exp
#define POW pow
#define TOLERANCE R(1e-13)
#define LAST_POWER R(1e-17)
#define SATURATED R(1e-17)
#define NEWTON R(1e-8)
#define OUTSIDE R(1e-12)
#endif

enum { ORDER = 24, TAYLOR_ORDER = 16 };
enum chart { FREE, ZERO, TOP };

struct flow {                   /* of one exponent n */
    real n, t_above, y_above, u_top, y_top, y_over;     /* limits of the charts */
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

/* Sum only the terms that count. */
static real series_near(const real *c, real x, real limit)
{
    real size = magnitude(x);
    return series(c, x, size > R(0.06) * limit ? ORDER : size > R(3e-4) * limit ? 10 : 4);
}

static real path_from_zero(real y, real n, real kappa)
{
    real x = POW(magnitude(y), n) * (y > 0 ? 1 : -kappa);
    real total = 0, power = 1, k = 1;
    while (magnitude(power) > LAST_POWER) {
        total += power / k;
        power *= x;
        k += n;
    }
    return y * total;
}

/* Invert the series near saturation by Newton's method; its slope is -(1 - y^n) / (n u). */
static real place_near_top(real y, real n, const real *c)
{
    real u = 1 - y;
    int k;
    for (k = 0; k < 12; k++) {
        real found = series(c, u, ORDER);
        real slope = magnitude(u) > R(1e-3) ? (1 - POW(found, n)) / (n * u) : 1 - (n - 1) * u;
        real change = (found - y) / slope;
        u += change;
        if (magnitude(change) <= NEWTON)
            break;
    }
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

/* Advance y by a path s >= 0; y_below is the limit of the chart around zero for y < 0. */
static real advance(real y, real s, real kappa, real y_below, const struct flow *flow)
{
    enum chart chart = FREE;
    real place = 0, n = flow->n;
    while (s > 0) {
        if (chart == TOP) {
            if (magnitude(place) < SATURATED)
                return 1;
            return series_near(flow->near_top, place * EXP(-n * s), flow->u_top);
        }
        if (chart == ZERO) {
            place += s;
            if (place <= flow->t_above) {
                real size = POW(magnitude(place), n);
                return place * series(flow->around_zero, place > 0 ? size : -kappa * size, ORDER);
            }
            chart = FREE;
            s = place - flow->t_above;
            y = flow->y_above * (1 + OUTSIDE);
        }
        if (flow->y_top <= y && y <= flow->y_over) {
            chart = TOP;
            place = place_near_top(y, n, flow->near_top);
        } else if (-y_below <= y && y <= flow->y_above) {
            chart = ZERO;
            place = path_from_zero(y, n, kappa);
        } else {
            /* |y| at most halves below 0, so that no step crosses it; above 0 no term may overflow a float. */
            real size = magnitude(y), power = POW(size, n);
            real most = y < 0 ? R(0.5) * size / (1 + kappa * power) : y > 1 ? size / (n * power) : 1;
            real step = smaller(s, most);
            int sign = y > 0 ? 1 : -1;
            y = sign * taylor(size, power, &step, n, y > 0 ? 1 : -kappa, sign);
            s -= step;
        }
    }
    return y;
}
