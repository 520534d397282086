/* ${name}: made by notchbend ${version}; see ${name}.h. */
#include "${name}.h"
#include <math.h>

typedef notchbend_real real;

#define R(x) ((real)(x))
#ifdef NOTCHBEND_FLOAT
#define ABSOLUTE fabsf
#define BEYOND R(1e-4)          /* of a bracket, so that rounding does not close it */
#define PRECISION R(1e-7)       /* of a root, relative to its bracket */
#define ROUNDING R(4.8e-7)
#define CLOSE R(1e-7)           /* error of the angle over the saturation of h that Newton's method makes none */
#define NEWTON R(1e-4)          /* change after which the next one is below rounding */
#define LARGEST R(1e30)
#else
#define ABSOLUTE fabs
#define BEYOND R(1e-9)
#define PRECISION R(1e-12)
#define ROUNDING R(1e-15)
#define CLOSE R(1e-9)
#define NEWTON R(1e-8)
#define LARGEST R(1e300)
#endif

static real magnitude(real x)       /* one instruction, no call */
{
    return ABSOLUTE(x);
}
