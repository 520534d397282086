/* ${name}: made by notchbend ${version}; see ${name}.h. */
#include "${name}.h"
${include_math}
typedef notchbend_real real;

#define R(x) ((real)(x))
#ifdef NOTCHBEND_FLOAT
#define BEYOND R(1e-4)          /* of a bracket, so that rounding does not close it */
#define PRECISION R(1e-7)       /* of a root, relative to its bracket */
#define ROUNDING R(4.8e-7)
#define LARGEST R(1e30)
#else
#define BEYOND R(1e-9)
#define PRECISION R(1e-12)
#define ROUNDING R(1e-15)
#define LARGEST R(1e300)
#endif

static real magnitude(real x)
{
    return x < 0 ? -x : x;
}

static real smaller(real a, real b)
{
    return b < a ? b : a;
}
