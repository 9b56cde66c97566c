/* FMI 2.0 for co-simulation: a thin layer on the core. */
#include "shell.h"

#include "fmi2Functions.h"

/* A status of the core is one of FMI. */
static fmi2Status as2(Status status) { return (fmi2Status)status; }

/* What the core says, where there is an instance. */
#define CORE(call) (c == NULL ? fmi2Error : as2(call))

/* A host takes the text for a printf format. Some print it as it is, so it is no argument. */
static void send(Instance *one, Status status, const char *category, const char *text) {
    char format[2 * TEXT_SIZE], *to = format;
    for (; *text != 0; text++) {
        *to++ = *text;
        if (*text == '%') {
            *to++ = '%';
        }
    }
    *to = 0;
    ((fmi2CallbackLogger)one->logger)(one->host, one->name, as2(status), category, format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean loggingOn, size_t nCategories,
                               const fmi2String categories[]) {
    return CORE(choose_logging(c, loggingOn, nCategories, categories));
}

fmi2Component fmi2Instantiate(fmi2String instanceName, fmi2Type fmuType, fmi2String fmuGUID,
                              fmi2String fmuResourceLocation,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean loggingOn) {
    (void)visible;
    if (functions == NULL) { /* nobody can be told */
        return NULL;
    }
    Instance *one = new_instance(2, instanceName == NULL ? "NULL" : instanceName);
    if (one == NULL) {
        return NULL;
    }
    one->send = send;
    one->logger = (void (*)(void))functions->logger;
    one->host = functions->componentEnvironment;
    one->is_logged[EVENTS] = loggingOn;
    Status status;
    if (instanceName == NULL) {
        status = refuse(one, "no instance: its name is NULL");
    } else if (fmuType != fmi2CoSimulation) {
        status = refuse(one, "no instance: this FMU is for co-simulation only");
    } else {
        status = open_instance(one, fmuGUID, fmuResourceLocation, IS_URI);
    }
    if (status == DONE) {
        return one;
    }
    free_instance(one);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) {
    if (c != NULL) {
        free_instance(c);
    }
}

/* ---- phases ----------------------------------------------------------------------- */

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance,
                               fmi2Real startTime, fmi2Boolean stopTimeDefined,
                               fmi2Real stopTime) {
    (void)toleranceDefined, (void)tolerance; /* the scene has its own accuracy */
    if (c == NULL || !is_phase(c, "fmi2SetupExperiment", INSTANTIATED)) {
        return fmi2Error;
    }
    return as2(set_up(c, startTime, stopTimeDefined, stopTime));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Instance *one = c;
    if (one == NULL || !is_phase(one, "fmi2EnterInitializationMode", INSTANTIATED)) {
        return fmi2Error;
    }
    if (!one->place.is_set_up) { /* FMI 2.0.4, section 2.1.6: otherwise there is no start time */
        return as2(refuse(one, "call out of order: fmi2EnterInitializationMode needs "
                               "fmi2SetupExperiment before it"));
    }
    return as2(enter_initialisation(one));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    if (c == NULL || !is_phase(c, "fmi2ExitInitializationMode", INITIALISING)) {
        return fmi2Error;
    }
    return as2(exit_initialisation(c));
}

fmi2Status fmi2Terminate(fmi2Component c) {
    return CORE(terminate(c, "fmi2Terminate"));
}

fmi2Status fmi2Reset(fmi2Component c) { return CORE(reset(c)); }

/* ---- variables -------------------------------------------------------------------- */

/* Getter and setter of a type; variables of type 0 there are none. */
#define ACCESS(Word, types, form)                                                              \
    static const Access OF_##Word = {types, form, #Word};                                      \
    fmi2Status fmi2Get##Word(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,       \
                             fmi2##Word value[]) {                                             \
        return CORE(get_values(c, &OF_##Word, vr, nvr, (void *)value, nvr));                   \
    }                                                                                          \
    fmi2Status fmi2Set##Word(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,       \
                             const fmi2##Word value[]) {                                       \
        return CORE(set_values(c, &OF_##Word, vr, nvr, (const void *)value, nvr));             \
    }

ACCESS(Real, REAL, DOUBLES)
ACCESS(Integer, INTEGER | ENUMERATION, INTS)
ACCESS(Boolean, BOOLEAN, INTS)
ACCESS(String, 0, NO_FORM)

/* ---- states ----------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return CORE(get_state(c, FMUstate));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate FMUstate) {
    return CORE(set_state(c, FMUstate));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *FMUstate) {
    return CORE(free_state(c, FMUstate));
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate FMUstate, size_t *size) {
    return CORE(state_size(c, FMUstate, size));
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate FMUstate,
                                 fmi2Byte serializedState[], size_t size) {
    return CORE(state_to_bytes(c, FMUstate, (uint8_t *)serializedState, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte serializedState[], size_t size,
                                   fmi2FMUstate *FMUstate) {
    return CORE(state_from_bytes(c, (const uint8_t *)serializedState, size, FMUstate));
}

/* ---- steps ------------------------------------------------------------------------ */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real currentCommunicationPoint,
                      fmi2Real communicationStepSize,
                      fmi2Boolean noSetFMUStatePriorToCurrentPoint) {
    (void)noSetFMUStatePriorToCurrentPoint;
    return CORE(do_step(c, "fmi2DoStep", currentCommunicationPoint, communicationStepSize));
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    return CORE(refuse(c, "fmi2CancelStep: a step ends before its call does"));
}

/* Steps are never pending: there is little to ask for. */
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind s, fmi2Status *value) {
    Instance *one = c;
    if (one == NULL || value == NULL) {
        return fmi2Error;
    }
    *value = as2(one->last_step);
    return s == fmi2DoStepStatus ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s, fmi2Real *value) {
    Instance *one = c;
    if (one == NULL || value == NULL) {
        return fmi2Error;
    }
    *value = one->place.now;
    return s == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind s, fmi2Integer *value) {
    (void)s;
    return c == NULL || value == NULL ? fmi2Error : fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind s, fmi2Boolean *value) {
    if (c == NULL || value == NULL) {
        return fmi2Error;
    }
    *value = fmi2False;
    return s == fmi2Terminated ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind s, fmi2String *value) {
    if (c == NULL || value == NULL) {
        return fmi2Error;
    }
    *value = "";
    return s == fmi2PendingStatus ? fmi2OK : fmi2Discard;
}

/* ---- what this FMU does not have -------------------------------------------------- */

#pragma GCC diagnostic ignored "-Wunused-parameter"

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    return CORE(refuse(c, "fmi2SetRealInputDerivatives: inputs are not interpolated"));
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[],
                                        size_t nvr, const fmi2Integer order[], fmi2Real value[]) {
    return CORE(refuse(c, "fmi2GetRealOutputDerivatives: outputs have none"));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference vUnknown_ref[],
                                        size_t nUnknown, const fmi2ValueReference vKnown_ref[],
                                        size_t nKnown, const fmi2Real dvKnown[],
                                        fmi2Real dvUnknown[]) {
    return CORE(refuse(c, "fmi2GetDirectionalDerivative: there are none"));
}
