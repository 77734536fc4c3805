/* FMI 3.0 co-simulation of one machine (modelDescription.xml); what it has no use for is an error.

   Of the standard's interface only the parts that are called have their arguments; the types are
   those of fmi3PlatformTypes.h. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "plant.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define OK 0
#define ERROR 3

/* value references; those up to LOAD_START can be set */
enum { TIME, COMMAND, LOAD_TORQUE_IN, MOTOR_START, LOAD_START, MOTOR_ANGLE, MOTOR_SPEED,
       LOAD_ANGLE, LOAD_SPEED, CURRENT_OUT, TORQUE };
typedef struct {
    rsea_plant plant;
    double time, motor_start, load_start;
} unit;

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *path,
    bool visible, bool logging, bool events, bool early, const uint32_t *between, size_t n,
    void *environment, void *log, void *update) {
    (void)name, (void)path, (void)visible, (void)logging, (void)early, (void)between, (void)n;
    (void)environment, (void)log, (void)update;
    if (events || token == NULL || strcmp(token, TOKEN) != 0) return NULL;
    return calloc(1, sizeof(unit));
}
EXPORT void fmi3FreeInstance(void *u) { free(u); }
EXPORT int fmi3SetDebugLogging(void *u, bool on, size_t n, const char *const *categories) {
    (void)u, (void)on, (void)n, (void)categories;
    return OK;
}
EXPORT int fmi3EnterInitializationMode(void *instance, bool with_tolerance, double tolerance,
    double start, bool with_stop, double stop) {
    unit *u = instance;
    (void)with_tolerance, (void)tolerance, (void)with_stop, (void)stop;
    u->time = start;
    return OK;
}
static void begin(unit *u) {
    u->plant.x[WHEEL_x] = u->motor_start / GEAR_RATIO;
    u->plant.x[LOAD_x] = u->load_start;
    rsea_plant_start(&u->plant);
}
EXPORT int fmi3ExitInitializationMode(void *u) { begin(u); return OK; }
EXPORT int fmi3EnterStepMode(void *u) { (void)u; return OK; }
EXPORT int fmi3Terminate(void *u) { (void)u; return OK; }
EXPORT int fmi3Reset(void *u) { memset(u, 0, sizeof(unit)); return OK; }

static double *set_here(unit *u, uint32_t reference) {
    switch (reference) {
    case COMMAND: return &u->plant.command;
    case LOAD_TORQUE_IN: return &u->plant.load_torque_Nm;
    case MOTOR_START: return &u->motor_start;
    case LOAD_START: return &u->load_start;
    default: return NULL;
    }
}
EXPORT int fmi3SetFloat64(void *u, const uint32_t *references, size_t n, const double *values,
    size_t given) {
    size_t j;
    if (given != n) return ERROR;
    for (j = 0; j < n; ++j) {
        double *place = set_here(u, references[j]);
        if (place == NULL || !isfinite(values[j])) return ERROR;
        *place = values[j];
        if (references[j] == MOTOR_START || references[j] == LOAD_START) begin(u);
    }
    return OK;
}
EXPORT int fmi3GetFloat64(void *instance, const uint32_t *references, size_t n, double *values,
    size_t room) {
    unit *u = instance;
    const double *x = u->plant.x;
    size_t j;
    if (room != n) return ERROR;
    for (j = 0; j < n; ++j) {
        const double *place = set_here(u, references[j]);
        if (place != NULL) values[j] = *place;
        else switch (references[j]) {
        case TIME: values[j] = u->time; break;
        case MOTOR_ANGLE: values[j] = x[WHEEL_x] * GEAR_RATIO; break;
        case MOTOR_SPEED: values[j] = x[WHEEL_RATE_x] * GEAR_RATIO; break;
        case LOAD_ANGLE: values[j] = x[LOAD_x]; break;
        case LOAD_SPEED: values[j] = x[LOAD_RATE_x]; break;
        case CURRENT_OUT: values[j] = rsea_plant_current(&u->plant, x); break;
        case TORQUE: values[j] = rsea_plant_torque(x); break;
        default: return ERROR;
        }
    }
    return OK;
}
EXPORT int fmi3DoStep(void *instance, double point, double length, bool no_return, bool *events,
    bool *terminate, bool *early, double *last) {
    unit *u = instance;
    (void)no_return;
    *events = *terminate = *early = false;
    if (!(length > 0.0) || rsea_plant_advance(&u->plant, length) != 0) return ERROR;
    u->time = point + length;
    *last = u->time;
    return OK;
}
EXPORT int fmi3GetFMUState(void *u, void **state) {
    if (*state == NULL && (*state = malloc(sizeof(unit))) == NULL) return ERROR;
    memcpy(*state, u, sizeof(unit));
    return OK;
}
EXPORT int fmi3SetFMUState(void *u, void *state) { memcpy(u, state, sizeof(unit)); return OK; }
EXPORT int fmi3FreeFMUState(void *u, void **state) {
    (void)u;
    free(*state);
    *state = NULL;
    return OK;
}
EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }
#define NONE(name) EXPORT int fmi3##name(void) { return ERROR; }
#define BOTH(type) NONE(Get##type) NONE(Set##type)
BOTH(Float32) BOTH(Int8) BOTH(UInt8) BOTH(Int16) BOTH(UInt16) BOTH(Int32) BOTH(UInt32) BOTH(Int64)
BOTH(UInt64) BOTH(Boolean) BOTH(String) BOTH(Binary) BOTH(Clock) BOTH(IntervalDecimal)
BOTH(IntervalFraction) BOTH(ShiftDecimal) BOTH(ShiftFraction) BOTH(ContinuousStates)
NONE(EnterEventMode) NONE(GetNumberOfVariableDependencies) NONE(GetVariableDependencies)
NONE(SerializedFMUStateSize) NONE(SerializeFMUState) NONE(DeserializeFMUState)
NONE(GetDirectionalDerivative) NONE(GetAdjointDerivative) NONE(EnterConfigurationMode)
NONE(ExitConfigurationMode) NONE(EvaluateDiscreteStates) NONE(UpdateDiscreteStates)
NONE(EnterContinuousTimeMode) NONE(CompletedIntegratorStep) NONE(SetTime)
NONE(GetContinuousStateDerivatives) NONE(GetEventIndicators)
NONE(GetNominalsOfContinuousStates) NONE(GetNumberOfEventIndicators)
NONE(GetNumberOfContinuousStates) NONE(GetOutputDerivatives) NONE(ActivateModelPartition)
