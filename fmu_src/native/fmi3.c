/* FMI 3.0 for co-simulation: event mode at the end of blows, early return, intermediate update. */
#include "fmi3.h"

#include <string.h>

fmi3Status as3(Status status) { return (fmi3Status)status; }

/* What the core says, where there is an instance. */
#define CORE(call) (instance == NULL ? fmi3Error : as3(call))

static void send(Instance *one, Status status, const char *category, const char *text) {
    ((fmi3LogMessageCallback)one->logger)(one->host, as3(status), category, text);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[]) {
    return CORE(choose_logging(instance, loggingOn, nCategories, categories));
}

/* ---- making and freeing ----------------------------------------------------------- */

static Instance *begin(fmi3String name, fmi3Boolean logs, fmi3InstanceEnvironment host,
                       fmi3LogMessageCallback logger) {
    Instance *one = new_instance(3, name == NULL ? "NULL" : name);
    if (one != NULL) {
        one->send = send;
        one->logger = (void (*)(void))logger;
        one->host = host;
        one->is_logged[EVENTS] = logs;
    }
    return one;
}

/* Values that a host wants to see within a step are inputs or outputs. */
static Status check_required(Instance *one, const fmi3ValueReference references[], size_t count) {
    if (count > 0 && references == NULL) {
        return refuse(one, "no instance: the list of intermediate variables is NULL");
    }
    for (size_t k = 0; k < count; k++) {
        const Entry *entry = find_entry(&one->tables, references[k]);
        if (entry == NULL || entry->causality == PARAMETER) {
            return refuse(one, "no instance: there is no input or output of reference %u",
                          (uint64_t)references[k]);
        }
    }
    return DONE;
}

fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
    fmi3Boolean earlyReturnAllowed, const fmi3ValueReference requiredIntermediateVariables[],
    size_t nRequiredIntermediateVariables, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3IntermediateUpdateCallback intermediateUpdate) {
    (void)visible;
    Status status;
    Instance *one = begin(instanceName, loggingOn, instanceEnvironment, logMessage);
    if (one == NULL) {
        return NULL;
    }
    if (instanceName == NULL) {
        status = refuse(one, "no instance: its name is NULL");
    } else {
        status = open_instance(one, instantiationToken, resourcePath, IS_PATH);
    }
    if (status == DONE) {
        status = check_required(one, requiredIntermediateVariables,
                                nRequiredIntermediateVariables);
    }
    if (status != DONE) {
        free_instance(one);
        return NULL;
    }
    one->has_events = eventModeUsed;
    one->returns_early = earlyReturnAllowed;
    /* a host that wants no values may still want to end a step early */
    if (nRequiredIntermediateVariables > 0 || earlyReturnAllowed) {
        one->update = (void (*)(void))intermediateUpdate;
    }
    return one;
}

static fmi3Instance refuse_kind(fmi3String name, fmi3Boolean logs, fmi3InstanceEnvironment host,
                                fmi3LogMessageCallback logger, const char *kind) {
    Instance *one = begin(name, logs, host, logger);
    if (one != NULL) {
        refuse(one, "no instance: this FMU is for co-simulation, not for %s", kind);
        free_instance(one);
    }
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String instanceName, fmi3String instantiationToken,
                                          fmi3String resourcePath, fmi3Boolean visible,
                                          fmi3Boolean loggingOn,
                                          fmi3InstanceEnvironment instanceEnvironment,
                                          fmi3LogMessageCallback logMessage) {
    (void)instantiationToken, (void)resourcePath, (void)visible;
    return refuse_kind(instanceName, loggingOn, instanceEnvironment, logMessage,
                       "model exchange");
}

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
    fmi3Boolean visible, fmi3Boolean loggingOn, fmi3InstanceEnvironment instanceEnvironment,
    fmi3LogMessageCallback logMessage, fmi3ClockUpdateCallback clockUpdate,
    fmi3LockPreemptionCallback lockPreemption, fmi3UnlockPreemptionCallback unlockPreemption) {
    (void)instantiationToken, (void)resourcePath, (void)visible;
    (void)clockUpdate, (void)lockPreemption, (void)unlockPreemption;
    return refuse_kind(instanceName, loggingOn, instanceEnvironment, logMessage,
                       "scheduled execution");
}

void fmi3FreeInstance(fmi3Instance instance) {
    Instance *one = instance;
    if (one != NULL && one->place.phase == UPDATING) {
        refuse(one, "call out of order: no fmi3FreeInstance within a step");
    } else if (one != NULL) {
        free_instance(one);
    }
}

/* ---- phases ----------------------------------------------------------------------- */

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined,
                                       fmi3Float64 tolerance, fmi3Float64 startTime,
                                       fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    (void)toleranceDefined, (void)tolerance; /* the scene has its own accuracy */
    Instance *one = instance;
    if (one == NULL || !is_phase(one, "fmi3EnterInitializationMode", INSTANTIATED)) {
        return fmi3Error;
    }
    Status status = set_up(one, startTime, stopTimeDefined, stopTime);
    return as3(status == DONE ? enter_initialisation(one) : status);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance) {
    if (instance == NULL || !is_phase(instance, "fmi3ExitInitializationMode", INITIALISING)) {
        return fmi3Error;
    }
    return as3(exit_initialisation(instance));
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance) {
    Instance *one = instance;
    if (one == NULL || !is_phase(one, "fmi3EnterEventMode", STEPPING)) {
        return fmi3Error;
    }
    if (!one->has_events) {
        return as3(refuse(one, "call out of order: fmi3EnterEventMode needs eventModeUsed when "
                               "the instance is made"));
    }
    one->place.phase = IN_EVENT;
    return fmi3OK;
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance) {
    Instance *one = instance;
    if (one == NULL || !is_phase(one, "fmi3EnterStepMode", IN_EVENT)) {
        return fmi3Error;
    }
    one->place.phase = STEPPING;
    return fmi3OK;
}

/* Nothing is left to be done at an event, and none is known beforehand. */
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *discreteStatesNeedUpdate,
                                    fmi3Boolean *terminateSimulation,
                                    fmi3Boolean *nominalsOfContinuousStatesChanged,
                                    fmi3Boolean *valuesOfContinuousStatesChanged,
                                    fmi3Boolean *nextEventTimeDefined,
                                    fmi3Float64 *nextEventTime) {
    if (instance == NULL || !is_phase(instance, "fmi3UpdateDiscreteStates", IN_EVENT)) {
        return fmi3Error;
    }
    fmi3Boolean *flags[] = {discreteStatesNeedUpdate, terminateSimulation,
                            nominalsOfContinuousStatesChanged, valuesOfContinuousStatesChanged,
                            nextEventTimeDefined};
    for (size_t k = 0; k < sizeof flags / sizeof *flags; k++) {
        if (flags[k] == NULL) {
            return as3(refuse(instance, "fmi3UpdateDiscreteStates: an argument is NULL"));
        }
    }
    for (size_t k = 0; k < sizeof flags / sizeof *flags; k++) {
        *flags[k] = fmi3False;
    }
    if (nextEventTime != NULL) {
        *nextEventTime = 0.0;
    }
    return fmi3OK;
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance) {
    if (instance == NULL || !is_phase(instance, "fmi3EvaluateDiscreteStates", IN_EVENT)) {
        return fmi3Error;
    }
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance) {
    return CORE(terminate(instance, "fmi3Terminate"));
}

fmi3Status fmi3Reset(fmi3Instance instance) {
    return CORE(reset(instance));
}

/* ---- steps ------------------------------------------------------------------------ */

/* After so many blows at the same time one goes on without a stop. */
enum { MOST_IDLE = 100 };

/* Where a step is, and whether the host wants it to end before its end. */
typedef struct {
    double end, size; /* of the communication step */
    double to;        /* to here it goes: the end, or where the host wants to stop */
    double reached;
} Stretch;

/* Let the host look at intermediate values, and choose where to stop. */
static void let_update(Instance *one, Stretch *stretch) {
    fmi3Boolean wants_stop = fmi3False;
    fmi3Float64 stop_at = stretch->end;
    bool may_stop = one->returns_early && stretch->reached < stretch->end;
    Phase phase = one->place.phase;
    one->place.phase = UPDATING;
    ((fmi3IntermediateUpdateCallback)one->update)(one->host, stretch->reached, fmi3False,
                                                  fmi3True, fmi3True, may_stop, &wants_stop,
                                                  &stop_at);
    one->place.phase = phase;
    if (may_stop && wants_stop && stop_at < stretch->to) {
        stretch->to = stop_at > stretch->reached ? stop_at : stretch->reached;
    }
}

/* Advance by stretches, each to the end of a blow. */
static Status step_by_blows(Instance *one, Stretch *stretch, bool stops_at_blow, bool *is_event) {
    int64_t flags = STOP_AT_BLOW;
    int idle = 0; /* stretches without a length: blows may end at the same time */
    while (stretch->reached < stretch->to) {
        double before = stretch->reached;
        Reached now;
        Status status = advance(one, stretch->to, stretch->size - (stretch->end - stretch->to),
                                flags, &now);
        if (status != DONE) {
            return status;
        }
        stretch->reached = now.time;
        *is_event |= now.is_blow;
        idle = now.time > before ? 0 : idle + 1;
        flags = SAME_STEP | (idle < MOST_IDLE ? STOP_AT_BLOW : 0);
        if (one->update != NULL && idle == 0) {
            let_update(one, stretch);
        }
        if (now.is_blow && stops_at_blow) {
            break;
        }
    }
    return DONE;
}

static Status step3(Instance *one, double from, double size, bool *is_event, Stretch *stretch) {
    bool stops_at_blow = one->has_events && one->returns_early;
    Status status = check_step(one, "fmi3DoStep", from, size);
    *stretch = (Stretch){.end = from + size, .size = size, .to = from + size,
                         .reached = one->place.now};
    *is_event = false;
    if (status != DONE) {
        return status;
    }
    if (stops_at_blow || one->update != NULL) {
        return step_by_blows(one, stretch, stops_at_blow, is_event);
    }
    Reached now;
    status = advance(one, stretch->end, size, 0, &now);
    stretch->reached = stretch->end;
    *is_event = status == DONE && now.is_blow;
    return status;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint,
                      fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint,
                      fmi3Boolean *eventHandlingNeeded, fmi3Boolean *terminateSimulation,
                      fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime) {
    (void)noSetFMUStatePriorToCurrentPoint;
    Instance *one = instance;
    Stretch stretch;
    bool is_event;
    if (one == NULL) {
        return fmi3Error;
    }
    if (eventHandlingNeeded == NULL || terminateSimulation == NULL || earlyReturn == NULL ||
        lastSuccessfulTime == NULL) {
        return as3(refuse(one, "fmi3DoStep: an argument is NULL"));
    }
    Status status = step3(one, currentCommunicationPoint, communicationStepSize, &is_event,
                          &stretch);
    one->last_step = status;
    *eventHandlingNeeded = status == DONE && is_event && one->has_events;
    *terminateSimulation = fmi3False;
    *earlyReturn = status == DONE && stretch.reached < stretch.end;
    *lastSuccessfulTime = one->place.now;
    return as3(status);
}

/* ---- states ----------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return CORE(get_state(instance, FMUState));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState) {
    return CORE(set_state(instance, FMUState));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState) {
    return CORE(free_state(instance, FMUState));
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size) {
    return CORE(state_size(instance, FMUState, size));
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState,
                                 fmi3Byte serializedState[], size_t size) {
    return CORE(state_to_bytes(instance, FMUState, serializedState, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[],
                                   size_t size, fmi3FMUState *FMUState) {
    return CORE(state_from_bytes(instance, serializedState, size, FMUState));
}

/* ---- dependencies ----------------------------------------------------------------- */

/* At the start outputs depend on parameters and inputs; later none does at once. */
static Status find_known(Instance *one, fmi3ValueReference reference, const Entry **entry,
                         size_t *count) {
    *entry = find_entry(&one->tables, reference);
    if (*entry == NULL) {
        return refuse(one, "there is no variable of reference %u", (uint64_t)reference);
    }
    *count = one->place.phase <= INITIALISING ? (*entry)->known_count : 0;
    return DONE;
}

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance instance,
                                               fmi3ValueReference valueReference,
                                               size_t *nDependencies) {
    const Entry *entry;
    size_t count = 0;
    if (instance == NULL || find_known(instance, valueReference, &entry, &count) != DONE) {
        return fmi3Error;
    }
    if (nDependencies == NULL) {
        return as3(refuse(instance, "fmi3GetNumberOfVariableDependencies: an argument is NULL"));
    }
    *nDependencies = count;
    return fmi3OK;
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance instance, fmi3ValueReference dependent,
                                       size_t elementIndicesOfDependent[],
                                       fmi3ValueReference independents[],
                                       size_t elementIndicesOfIndependents[],
                                       fmi3DependencyKind dependencyKinds[],
                                       size_t nDependencies) {
    Instance *one = instance;
    const Entry *entry;
    size_t count = 0;
    if (one == NULL || find_known(one, dependent, &entry, &count) != DONE) {
        return fmi3Error;
    }
    if (nDependencies != count) {
        return as3(refuse(one, "fmi3GetVariableDependencies: there are %u, not %u",
                          (uint64_t)count, (uint64_t)nDependencies));
    }
    if (count > 0 && (elementIndicesOfDependent == NULL || independents == NULL ||
                      elementIndicesOfIndependents == NULL || dependencyKinds == NULL)) {
        return as3(refuse(one, "fmi3GetVariableDependencies: a list is NULL"));
    }
    for (size_t k = 0; k < count; k++) {
        uint32_t known = one->tables.known[entry->first_known + k];
        independents[k] = one->tables.entries[known].reference;
        elementIndicesOfDependent[k] = elementIndicesOfIndependents[k] = 0; /* all elements */
        dependencyKinds[k] = fmi3Dependent;
    }
    return fmi3OK;
}
