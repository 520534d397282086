/* ${name}: made by notchbend ${version}; the compensator of ${name}.h as a unit of co-simulation, FMI 3.0. */
#include "${name}.h"
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

${unit}
typedef int status;            /* as in fmi3FunctionTypes.h of the standard: fmi3OK 0, fmi3Error 3 */
enum { OK = 0, FAILED = 3 };

EXPORT const char *fmi3GetVersion(void)
{
    return "3.0";
}

EXPORT status fmi3SetDebugLogging(void *unit, bool on, size_t count, const char *const categories[])
{
    (void)unit, (void)on, (void)count, (void)categories;
    return OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *place, bool visible,
                                         bool logging, bool events, bool early, const uint32_t between[], size_t count,
                                         void *environment, void (*log)(void *, status, const char *, const char *),
                                         void (*update)(void *, double, bool, bool, bool, bool, bool *, double *))
{
    struct unit *unit;
    (void)name, (void)place, (void)visible, (void)logging, (void)events, (void)early, (void)between, (void)count;
    (void)environment, (void)log, (void)update;
    if (!token || strcmp(token, "${token}") != 0)
        return 0;
    unit = malloc(sizeof *unit);
    if (unit)
        begun(unit);
    return unit;
}

EXPORT void fmi3FreeInstance(void *unit)
{
    free(unit);
}

EXPORT status fmi3EnterInitializationMode(void *unit, bool has_tolerance, double tolerance, double start, bool has_stop,
                                          double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((struct unit *)unit)->time = start;
    return OK;
}

EXPORT status fmi3ExitInitializationMode(void *unit)
{
    (void)unit;
    return OK;
}

EXPORT status fmi3Terminate(void *unit)
{
    (void)unit;
    return OK;
}

EXPORT status fmi3Reset(void *unit)
{
    begun(unit);
    return OK;
}

EXPORT status fmi3GetFloat64(void *unit, const uint32_t references[], size_t count, double values[], size_t size)
{
    size_t k;
    (void)size;
    for (k = 0; k < count; k++)
        if (!given(unit, references[k], &values[k]))
            return FAILED;
    return OK;
}

EXPORT status fmi3SetFloat64(void *unit, const uint32_t references[], size_t count, const double values[], size_t size)
{
    size_t k;
    (void)size;
    for (k = 0; k < count; k++)
        if (!taken(unit, references[k], values[k]))
            return FAILED;
    return OK;
}

EXPORT status fmi3GetInt32(void *unit, const uint32_t references[], size_t count, int32_t values[], size_t size)
{
    size_t k;
    (void)size;
    for (k = 0; k < count; k++) {
        int value;
        if (!whole(unit, references[k], &value))
            return FAILED;
        values[k] = value;
    }
    return OK;
}

EXPORT status fmi3SetInt32(void *unit, const uint32_t references[], size_t count, const int32_t values[], size_t size)
{
    (void)unit, (void)references, (void)values, (void)size;
    return count ? FAILED : OK;
}

EXPORT status fmi3GetBoolean(void *unit, const uint32_t references[], size_t count, bool values[], size_t size)
{
    size_t k;
    (void)size;
    for (k = 0; k < count; k++) {
        if (references[k] != REIDENTIFY)
            return FAILED;
        values[k] = ((struct unit *)unit)->reidentify != 0;
    }
    return OK;
}

EXPORT status fmi3SetBoolean(void *unit, const uint32_t references[], size_t count, const bool values[], size_t size)
{
    size_t k;
    (void)size;
    for (k = 0; k < count; k++) {
        if (references[k] != REIDENTIFY)
            return FAILED;
        ((struct unit *)unit)->reidentify = values[k];
    }
    return OK;
}

EXPORT status fmi3GetFMUState(void *unit, void **kept)
{
    if (!*kept)
        *kept = malloc(sizeof(struct unit));
    if (!*kept)
        return FAILED;
    memcpy(*kept, unit, sizeof(struct unit));
    return OK;
}

EXPORT status fmi3SetFMUState(void *unit, void *kept)
{
    memcpy(unit, kept, sizeof(struct unit));
    return OK;
}

EXPORT status fmi3FreeFMUState(void *unit, void **kept)
{
    (void)unit;
    free(*kept);
    *kept = 0;
    return OK;
}

EXPORT status fmi3SerializedFMUStateSize(void *unit, void *kept, size_t *size)
{
    (void)unit, (void)kept;
    *size = sizeof(struct unit);
    return OK;
}

EXPORT status fmi3SerializeFMUState(void *unit, void *kept, uint8_t bytes[], size_t size)
{
    (void)unit;
    if (size < sizeof(struct unit))
        return FAILED;
    memcpy(bytes, kept, sizeof(struct unit));
    return OK;
}

EXPORT status fmi3DeserializeFMUState(void *unit, const uint8_t bytes[], size_t size, void **kept)
{
    if (size < sizeof(struct unit) || fmi3GetFMUState(unit, kept) != OK)
        return FAILED;
    memcpy(*kept, bytes, sizeof(struct unit));
    return OK;
}

EXPORT status fmi3DoStep(void *unit, double time, double step, bool no_return, bool *event, bool *end, bool *early,
                         double *reached)
{
    (void)no_return;
    stepped(unit, time + step);
    *event = *end = *early = false;
    *reached = time + step;
    return OK;
}

/* Types that the unit does not have. */
#define NO_VARIABLES(type, c_type) \
    EXPORT status fmi3Get##type(void *unit, const uint32_t references[], size_t count, c_type values[], size_t size) \
    { \
        (void)unit, (void)references, (void)values, (void)size; \
        return count ? FAILED : OK; \
    } \
    EXPORT status fmi3Set##type(void *unit, const uint32_t references[], size_t count, const c_type values[], size_t size) \
    { \
        (void)unit, (void)references, (void)values, (void)size; \
        return count ? FAILED : OK; \
    }
NO_VARIABLES(Float32, float)
NO_VARIABLES(Int8, int8_t)
NO_VARIABLES(UInt8, uint8_t)
NO_VARIABLES(Int16, int16_t)
NO_VARIABLES(UInt16, uint16_t)
NO_VARIABLES(UInt32, uint32_t)
NO_VARIABLES(Int64, int64_t)
NO_VARIABLES(UInt64, uint64_t)

/* What no master calls, because the model description does not offer it. */
#define NOT_OFFERED(name) \
    EXPORT status name() \
    { \
        return FAILED; \
    }
#define NOT_MADE(name) \
    EXPORT void *name() \
    { \
        return 0; \
    }
NOT_MADE(fmi3InstantiateModelExchange)
NOT_MADE(fmi3InstantiateScheduledExecution)
NOT_OFFERED(fmi3GetString)
NOT_OFFERED(fmi3SetString)
NOT_OFFERED(fmi3GetBinary)
NOT_OFFERED(fmi3SetBinary)
NOT_OFFERED(fmi3GetClock)
NOT_OFFERED(fmi3SetClock)
NOT_OFFERED(fmi3EnterEventMode)
NOT_OFFERED(fmi3GetNumberOfVariableDependencies)
NOT_OFFERED(fmi3GetVariableDependencies)
NOT_OFFERED(fmi3GetDirectionalDerivative)
NOT_OFFERED(fmi3GetAdjointDerivative)
NOT_OFFERED(fmi3EnterConfigurationMode)
NOT_OFFERED(fmi3ExitConfigurationMode)
NOT_OFFERED(fmi3GetIntervalDecimal)
NOT_OFFERED(fmi3GetIntervalFraction)
NOT_OFFERED(fmi3GetShiftDecimal)
NOT_OFFERED(fmi3GetShiftFraction)
NOT_OFFERED(fmi3SetIntervalDecimal)
NOT_OFFERED(fmi3SetIntervalFraction)
NOT_OFFERED(fmi3SetShiftDecimal)
NOT_OFFERED(fmi3SetShiftFraction)
NOT_OFFERED(fmi3EvaluateDiscreteStates)
NOT_OFFERED(fmi3UpdateDiscreteStates)
NOT_OFFERED(fmi3EnterContinuousTimeMode)
NOT_OFFERED(fmi3CompletedIntegratorStep)
NOT_OFFERED(fmi3SetTime)
NOT_OFFERED(fmi3SetContinuousStates)
NOT_OFFERED(fmi3GetContinuousStateDerivatives)
NOT_OFFERED(fmi3GetEventIndicators)
NOT_OFFERED(fmi3GetContinuousStates)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates)
NOT_OFFERED(fmi3GetNumberOfEventIndicators)
NOT_OFFERED(fmi3GetNumberOfContinuousStates)
NOT_OFFERED(fmi3EnterStepMode)
NOT_OFFERED(fmi3GetOutputDerivatives)
NOT_OFFERED(fmi3ActivateModelPartition)
