/* ${name}: made by notchbend ${version}; the compensator of ${name}.h as a unit of co-simulation, FMI 2.0. */
#include "${name}.h"
#include <stdlib.h>
#include <string.h>

${unit}
typedef int status;            /* as in fmi2FunctionTypes.h of the standard: fmi2OK 0, fmi2Discard 2, fmi2Error 3 */
enum { OK = 0, DISCARD = 2, FAILED = 3 };

EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

EXPORT status fmi2SetDebugLogging(void *unit, int on, size_t count, const char *const categories[])
{
    (void)unit, (void)on, (void)count, (void)categories;
    return OK;
}

EXPORT void *fmi2Instantiate(const char *name, int kind, const char *token, const char *place, const void *calls,
                             int visible, int logging)
{
    struct unit *unit;
    (void)name, (void)place, (void)calls, (void)visible, (void)logging;
    if (kind != 1 || !token || strcmp(token, "${token}") != 0)
        return 0;
    unit = malloc(sizeof *unit);
    if (unit)
        begun(unit);
    return unit;
}

EXPORT void fmi2FreeInstance(void *unit)
{
    free(unit);
}

EXPORT status fmi2SetupExperiment(void *unit, int has_tolerance, double tolerance, double start, int has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    ((struct unit *)unit)->time = start;
    return OK;
}

EXPORT status fmi2EnterInitializationMode(void *unit)
{
    (void)unit;
    return OK;
}

EXPORT status fmi2ExitInitializationMode(void *unit)
{
    (void)unit;
    return OK;
}

EXPORT status fmi2Terminate(void *unit)
{
    (void)unit;
    return OK;
}

EXPORT status fmi2Reset(void *unit)
{
    begun(unit);
    return OK;
}

EXPORT status fmi2GetReal(void *unit, const unsigned references[], size_t count, double values[])
{
    size_t k;
    for (k = 0; k < count; k++)
        if (!given(unit, references[k], &values[k]))
            return FAILED;
    return OK;
}

EXPORT status fmi2SetReal(void *unit, const unsigned references[], size_t count, const double values[])
{
    size_t k;
    for (k = 0; k < count; k++)
        if (!taken(unit, references[k], values[k]))
            return FAILED;
    return OK;
}

EXPORT status fmi2GetInteger(void *unit, const unsigned references[], size_t count, int values[])
{
    size_t k;
    for (k = 0; k < count; k++)
        if (!whole(unit, references[k], &values[k]))
            return FAILED;
    return OK;
}

EXPORT status fmi2SetInteger(void *unit, const unsigned references[], size_t count, const int values[])
{
    (void)unit, (void)references, (void)values;
    return count ? FAILED : OK;
}

EXPORT status fmi2GetBoolean(void *unit, const unsigned references[], size_t count, int values[])
{
    size_t k;
    for (k = 0; k < count; k++) {
        if (references[k] != REIDENTIFY)
            return FAILED;
        values[k] = ((struct unit *)unit)->reidentify;
    }
    return OK;
}

EXPORT status fmi2SetBoolean(void *unit, const unsigned references[], size_t count, const int values[])
{
    size_t k;
    for (k = 0; k < count; k++) {
        if (references[k] != REIDENTIFY)
            return FAILED;
        ((struct unit *)unit)->reidentify = values[k] != 0;
    }
    return OK;
}

EXPORT status fmi2GetString(void *unit, const unsigned references[], size_t count, const char *values[])
{
    (void)unit, (void)references, (void)values;
    return count ? FAILED : OK;
}

EXPORT status fmi2SetString(void *unit, const unsigned references[], size_t count, const char *const values[])
{
    (void)unit, (void)references, (void)values;
    return count ? FAILED : OK;
}

EXPORT status fmi2GetFMUstate(void *unit, void **kept)
{
    if (!*kept)
        *kept = malloc(sizeof(struct unit));
    if (!*kept)
        return FAILED;
    memcpy(*kept, unit, sizeof(struct unit));
    return OK;
}

EXPORT status fmi2SetFMUstate(void *unit, void *kept)
{
    memcpy(unit, kept, sizeof(struct unit));
    return OK;
}

EXPORT status fmi2FreeFMUstate(void *unit, void **kept)
{
    (void)unit;
    free(*kept);
    *kept = 0;
    return OK;
}

EXPORT status fmi2SerializedFMUstateSize(void *unit, void *kept, size_t *size)
{
    (void)unit, (void)kept;
    *size = sizeof(struct unit);
    return OK;
}

EXPORT status fmi2SerializeFMUstate(void *unit, void *kept, char bytes[], size_t size)
{
    (void)unit;
    if (size < sizeof(struct unit))
        return FAILED;
    memcpy(bytes, kept, sizeof(struct unit));
    return OK;
}

EXPORT status fmi2DeSerializeFMUstate(void *unit, const char bytes[], size_t size, void **kept)
{
    if (size < sizeof(struct unit) || fmi2GetFMUstate(unit, kept) != OK)
        return FAILED;
    memcpy(*kept, bytes, sizeof(struct unit));
    return OK;
}
EXPORT status fmi2GetDirectionalDerivative(void *unit, const unsigned unknowns[], size_t count, const unsigned knowns[],
                                           size_t known, const double seed[], double found[])
{
    (void)unit, (void)unknowns, (void)count, (void)knowns, (void)known, (void)seed, (void)found;
    return FAILED;
}

EXPORT status fmi2SetRealInputDerivatives(void *unit, const unsigned references[], size_t count, const int orders[],
                                          const double values[])
{
    (void)unit, (void)references, (void)count, (void)orders, (void)values;
    return FAILED;
}

EXPORT status fmi2GetRealOutputDerivatives(void *unit, const unsigned references[], size_t count, const int orders[],
                                           double values[])
{
    (void)unit, (void)references, (void)count, (void)orders, (void)values;
    return FAILED;
}

EXPORT status fmi2DoStep(void *unit, double time, double step, int no_return)
{
    (void)no_return;
    stepped(unit, time + step);
    return OK;
}

EXPORT status fmi2CancelStep(void *unit)
{
    (void)unit;
    return FAILED;
}

EXPORT status fmi2GetStatus(void *unit, int kind, int *value)
{
    (void)unit, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetRealStatus(void *unit, int kind, double *value)
{
    (void)unit, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetIntegerStatus(void *unit, int kind, int *value)
{
    (void)unit, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetBooleanStatus(void *unit, int kind, int *value)
{
    (void)unit, (void)kind, (void)value;
    return DISCARD;
}

EXPORT status fmi2GetStringStatus(void *unit, int kind, const char **value)
{
    (void)unit, (void)kind, (void)value;
    return DISCARD;
}
