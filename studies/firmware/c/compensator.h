/* ${name}: made by notchbend ${version}. The drive that makes an angle follow a reference, on a microcontroller.
${about}
   How to use it: once notchbend_init(&state); at every tick drive = notchbend_step(&state, reference_deg) and move the
   motor to the drive. Where the motor was moved by something else, or did not arrive, tell where it stands:
   notchbend_observe(&state, drive) moves the model there and gives its angle. The state is plain: save it with memcpy
   before power goes off, and the history is kept.

   C99, no allocation, no recursion, no static state, ${libm}.
   Absolute values (fabs) are one instruction and no call.
   Memory: the state has ${reals} reals and one unsigned integer, ${state_double} bytes in double and ${state_float} in float on
   targets that align doubles to 8 bytes. Constants: about ${constants} reals. Stack of all calls together:
   at most ${stack} bytes (gcc 12, -O2, x86-64, beside that of the library's functions).
   Define NOTCHBEND_FLOAT for every file that includes this one, and reals are float in place of double.
   Do not compile with -ffast-math: references that are not finite would not be refused. */
#ifndef NOTCHBEND_H
#define NOTCHBEND_H

#ifdef __cplusplus
extern "C" {
#endif

#ifdef NOTCHBEND_FLOAT
typedef float notchbend_real;
#else
typedef double notchbend_real;
#endif

/* Largest change of the drive in one call of notchbend_step, ${unit}; 0 for none. It is copied into the state. */
#ifndef NOTCHBEND_LARGEST_STEP
#define NOTCHBEND_LARGEST_STEP 0
#endif

/* The angle lags the drive by so much, s: give notchbend_step the reference of so much later. */
#define NOTCHBEND_DELAY_S ${delay}

/* Bits of notchbend_state.limited: why the last call did not do what was asked; 0 where it did. */
#define NOTCHBEND_AT_LOWEST 1u      /* the drive is held at the lowest one of the records */
#define NOTCHBEND_AT_HIGHEST 2u     /* the drive is held at the highest one of the records */
#define NOTCHBEND_AT_RATE 4u        /* the drive moves by largest_step only */
#define NOTCHBEND_NOT_FINITE 8u     /* the number that was given is NaN or infinite: nothing has moved */

typedef struct {
    notchbend_real f_deg;           /* single-valued part of the angle, deg */
    notchbend_real h_deg;           /* hysteresis; the angle is zero_deg + gain * f_deg + h_deg */
    notchbend_real drive;           /* the last drive, ${unit} */
    notchbend_real largest_step;    /* largest change of the drive in one step, ${unit}; 0 for none */
    notchbend_real zero_deg, gain, width;   /* what has drifted: offset, factor on f, factor on the saturation of h */
    notchbend_real memory[${memory}];       /* ${memory_words}, deg */
    unsigned limited;               /* bits, see above */
} notchbend_state;

/* Bits of notchbend_estimator.flags; NOTCHBEND_NOT_FINITE is one of them. */
#define NOTCHBEND_NOT_EXCITED 1u    /* f has not moved by ${spacing_words} deg since the last sample: nothing is learnt */
#define NOTCHBEND_AT_BOUND 2u       /* zero, gain or width is held at its bound */
#define NOTCHBEND_OUTSIDE_FIT 4u    /* errors stay above ${outside_words} deg rms: the fit does not hold, identify again */

/* What re-identification remembers; plain, as the state. */
typedef struct {
    notchbend_real root[3][3];      /* square root of the covariance of zero, gain and width */
    notchbend_real memory[${memory}];       /* of a law that is a little wider, for the slope of h by width */
    notchbend_real f_deg, sampled_deg;      /* at the last call; at the last sample that counted */
    notchbend_real mean_square;     /* of the prediction errors, deg^2 */
    unsigned flags;                 /* bits, see above */
} notchbend_estimator;

/* Put the model at the first sample of the record, with its history; the largest step is that of the macro, and
   nothing has drifted. */
void notchbend_init(notchbend_state *state);

/* Put the model at the first sample of the record again; the largest step and what has drifted stay. */
void notchbend_reset(notchbend_state *state);

/* Give the drive, ${unit}, at which the angle is the reference, and move the model there. */
notchbend_real notchbend_step(notchbend_state *state, notchbend_real reference_deg);

/* Begin re-identification where the state is. */
void notchbend_estimator_init(notchbend_estimator *estimator, const notchbend_state *state);

/* After notchbend_step or notchbend_observe, at every tick: learn from the angle that was measured at the drive, deg, and
   change zero_deg, gain and width of the state. NaN is no reading, and is followed without learning. Gives the flags. */
unsigned notchbend_estimate(notchbend_estimator *estimator, notchbend_state *state, notchbend_real angle_deg);

/* Move the model to a drive, ${unit}, that was reached by other means, and give its angle, deg. */
notchbend_real notchbend_observe(notchbend_state *state, notchbend_real drive);

#ifdef __cplusplus
}
#endif

#endif
