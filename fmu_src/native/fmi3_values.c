/* FMI 3.0: getters and setters of all types. */
#include "fmi3.h"

static fmi3Status get3(Instance *one, const Access *access, const fmi3ValueReference references[],
                       size_t count, void *values, size_t value_count) {
    return one == NULL ? fmi3Error
                       : as3(get_values(one, access, references, count, values, value_count));
}

static fmi3Status set3(Instance *one, const Access *access, const fmi3ValueReference references[],
                       size_t count, const void *values, size_t value_count) {
    return one == NULL ? fmi3Error
                       : as3(set_values(one, access, references, count, values, value_count));
}

/* Getter and setter of a type; variables of type 0 there are none. */
#define ACCESS(Word, types, form)                                                              \
    static const Access OF_##Word = {types, form, #Word};                                      \
    fmi3Status fmi3Get##Word(fmi3Instance instance,                                            \
                             const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, fmi3##Word values[], size_t nValues) {   \
        return get3(instance, &OF_##Word, valueReferences, nValueReferences, (void *)values,   \
                    nValues);                                                                  \
    }                                                                                          \
    fmi3Status fmi3Set##Word(fmi3Instance instance,                                            \
                             const fmi3ValueReference valueReferences[],                       \
                             size_t nValueReferences, const fmi3##Word values[],               \
                             size_t nValues) {                                                 \
        return set3(instance, &OF_##Word, valueReferences, nValueReferences,                   \
                    (const void *)values, nValues);                                            \
    }

ACCESS(Float64, REAL, DOUBLES)
ACCESS(Int32, INTEGER, INTS)
ACCESS(Int64, ENUMERATION, LONGS)
ACCESS(Boolean, BOOLEAN, BOOLS)
ACCESS(Float32, 0, NO_FORM)
ACCESS(Int8, 0, NO_FORM)
ACCESS(UInt8, 0, NO_FORM)
ACCESS(Int16, 0, NO_FORM)
ACCESS(UInt16, 0, NO_FORM)
ACCESS(UInt32, 0, NO_FORM)
ACCESS(UInt64, 0, NO_FORM)
ACCESS(String, 0, NO_FORM)

static const Access BINARIES = {0, NO_FORM, "Binary"};
static const Access CLOCKS = {0, NO_FORM, "Clock"};

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, size_t valueSizes[], fmi3Binary values[],
                         size_t nValues) {
    (void)valueSizes;
    return get3(instance, &BINARIES, valueReferences, nValueReferences, (void *)values, nValues);
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                         size_t nValueReferences, const size_t valueSizes[],
                         const fmi3Binary values[], size_t nValues) {
    (void)valueSizes;
    return set3(instance, &BINARIES, valueReferences, nValueReferences, (const void *)values,
                nValues);
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, fmi3Clock values[]) {
    return get3(instance, &CLOCKS, valueReferences, nValueReferences, values, nValueReferences);
}

fmi3Status fmi3SetClock(fmi3Instance instance, const fmi3ValueReference valueReferences[],
                        size_t nValueReferences, const fmi3Clock values[]) {
    return set3(instance, &CLOCKS, valueReferences, nValueReferences, values, nValueReferences);
}
