/* Variables: setting and reading them, what is allowed, and their words in the image. */
#include "shell.h"

#include <math.h>
#include <string.h>

static const double LEAST = -2147483648.0, MOST = 2147483647.0; /* whole numbers of FMI */

const char *type_word(uint32_t type) {
    return type == REAL ? "Real" : type == INTEGER ? "Integer"
           : type == BOOLEAN ? "Boolean" : "Enumeration";
}

bool is_value(const Variable *one, double value) {
    if (one->type == REAL) {
        return true;
    }
    double least = one->type == BOOLEAN ? 0.0 : LEAST, most = one->type == BOOLEAN ? 1.0 : MOST;
    return value >= least && value <= most && value == floor(value);
}

static const char *name_of(const Instance *one, uint32_t place) {
    return one->tables.text + place;
}

/* ---- the image -------------------------------------------------------------------- */

/* Place of a number among those that are allowed, -1 if it is not. */
static int64_t choice(const Tables *tables, const Variable *one, double value) {
    const int64_t *choices = tables->choices + one->first_choice;
    for (uint32_t k = 0; k < one->choice_count; k++) {
        if ((double)choices[k] == value) {
            return (int64_t)k;
        }
    }
    return -1;
}

void write_word(const Tables *tables, const Variable *one, double value, int64_t *image) {
    int64_t whole = 0;
    if (one->conversion == AS_NUMBER_OR_NAN && one->has_left_out && value == one->left_out) {
        value = NAN;
    }
    if (one->conversion == AS_WHOLE) {
        whole = (int64_t)value;
    } else if (one->conversion == AS_CHOICE) {
        whole = choice(tables, one, value);
    } else {
        memcpy(&whole, &value, sizeof whole);
    }
    image[one->place] = whole;
}

void write_image(const Tables *tables, const double *values, int64_t *image) {
    for (uint32_t k = 0; k < tables->variable_count; k++) {
        const Variable *one = &tables->variables[k];
        if (one->conversion != NOWHERE) {
            write_word(tables, one, values[k], image);
        }
    }
}

/* ---- what is allowed -------------------------------------------------------------- */

static bool is_allowed(const Tables *tables, const Variable *one, double value) {
    return (value >= one->lower && value <= one->upper) || one->type == BOOLEAN ||
           (one->has_left_out && value == one->left_out) ||
           (one->type == ENUMERATION && choice(tables, one, value) >= 0);
}

static Status refuse_value(Instance *one, const char *name, double value, bool is_real,
                           const char *unit, const char *allowed) {
    return is_real ? refuse(one, "%s = %r%s: must be %s", name, value, unit, allowed)
                   : refuse(one, "%s = %d%s: must be %s", name, (int64_t)value, unit, allowed);
}

Status check_values(Instance *one, const double *values, uint32_t first, uint32_t count) {
    for (uint32_t k = first; k < first + count; k++) {
        const Variable *found = &one->tables.variables[k];
        if (found->causality != OUTPUT && !is_allowed(&one->tables, found, values[k])) {
            return refuse_value(one, name_of(one, found->name), values[k], found->type == REAL,
                                name_of(one, found->unit), name_of(one, found->allowed));
        }
    }
    return DONE;
}

Status check_drive(Instance *one, const double *values) {
    const Drive *drive = NULL;
    for (size_t k = 0; k < one->tables.drive_count; k++) {
        const Drive *other = one->tables.drives + k;
        drive = k == 0 || values[other->kind] == other->choice ? other : drive;
    }
    if (drive == NULL) {
        return DONE;
    }
    double value = values[drive->on] != 0.0 ? values[drive->pressure] : 0.0;
    value *= drive->choice == 0 ? values[drive->area] : 1.0;
    if (value >= drive->lower && value <= drive->upper) {
        return DONE;
    }
    return refuse_value(one, name_of(one, drive->name), value, true, name_of(one, drive->unit),
                        name_of(one, drive->allowed));
}

/* ---- lists of references ---------------------------------------------------------- */

/* Check a list; the number of its values, and the flags that a reading of its outputs needs. */
static Status check_list(Instance *one, const char *verb, const Access *access,
                         const uint32_t *references, size_t count, const void *values,
                         size_t value_count, int64_t *needs) {
    size_t found = 0;
    if (count > 0 && (references == NULL || values == NULL)) {
        return refuse(one, "fmi%u%s%s: a list is NULL", (uint64_t)one->fmi, verb, access->word);
    }
    for (size_t k = 0; k < count; k++) {
        const Entry *entry = find_entry(&one->tables, references[k]);
        if (entry == NULL || (entry->type & access->types) == 0) {
            return refuse(one, "there is no %s variable of reference %u", access->word,
                          (uint64_t)references[k]);
        }
        found += entry->causality == INDEPENDENT ? 1 : entry->member_count;
        if (entry->causality == OUTPUT) {
            const uint32_t *member = one->tables.members + entry->first_member;
            *needs |= IS_READ | one->tables.variables[*member].needs;
        }
    }
    if (found != value_count) {
        return refuse(one, "fmi%u%s%s: there are %u values where %u belong", (uint64_t)one->fmi,
                      verb, access->word, (uint64_t)value_count, (uint64_t)found);
    }
    return DONE;
}

/* Have the outputs in `outputs`; zeros where there are none yet. */
static Status fill_outputs(Instance *one, int64_t needs) {
    if ((needs & ~one->filled) == 0) {
        return DONE;
    }
    if (one->motion == NULL) {
        if (one->place.phase != INITIALISING) {
            memset(one->outputs, 0, one->tables.output_count * sizeof *one->outputs);
            return DONE;
        }
        Status status = need_motion(one);
        if (status != DONE) {
            return status;
        }
    }
    needs |= one->filled;
    int64_t fault = one->kernels.read(one->motion, needs & ~(int64_t)IS_READ, one->outputs);
    if (fault != 0) {
        one->filled = 0;
        return refuse_fault(one, fault);
    }
    one->filled = needs;
    return DONE;
}

static void give(Form form, void *values, size_t at, double value) {
    switch (form) {
    case DOUBLES:
        ((double *)values)[at] = value;
        break;
    case INTS:
        ((int32_t *)values)[at] =
            value >= MOST ? INT32_MAX : value >= LEAST ? (int32_t)value : value < 0 ? INT32_MIN : 0;
        break;
    case LONGS:
        ((int64_t *)values)[at] = value >= LEAST && value <= MOST ? (int64_t)value : 0;
        break;
    case BOOLS:
        ((bool *)values)[at] = value != 0.0;
        break;
    case NO_FORM:
        break;
    }
}

static double take(Form form, const void *values, size_t at) {
    switch (form) {
    case DOUBLES:
        return ((const double *)values)[at];
    case INTS:
        return ((const int32_t *)values)[at];
    case LONGS:
        return (double)((const int64_t *)values)[at];
    case BOOLS:
        return ((const bool *)values)[at];
    case NO_FORM:
        break;
    }
    return 0.0;
}

Status get_values(Instance *one, const Access *access, const uint32_t *references, size_t count,
                  void *values, size_t value_count) {
    const Tables *tables = &one->tables;
    int64_t needs = 0;
    size_t at = 0;
    Status status = check_list(one, "Get", access, references, count, values, value_count, &needs);
    if (status == DONE && needs != 0) {
        status = fill_outputs(one, needs);
    }
    for (size_t k = 0; status == DONE && k < count; k++) {
        const Entry *entry = find_entry(tables, references[k]);
        if (entry->causality == INDEPENDENT) {
            give(access->form, values, at++, one->place.now);
        }
        for (uint32_t m = 0; m < entry->member_count; m++) {
            uint32_t member = tables->members[entry->first_member + m];
            give(access->form, values, at++,
                 entry->causality == OUTPUT ? one->outputs[tables->variables[member].place]
                                            : one->values[member]);
        }
    }
    return status;
}

/* ---- setting ---------------------------------------------------------------------- */

/* Refuse what cannot be set now. */
static Status check_settable(Instance *one, const Entry *entry) {
    const char *name = name_of(one, entry->name);
    if (entry->causality == OUTPUT) {
        return refuse(one, "%s is an output: it cannot be set", name);
    }
    if (entry->causality == INDEPENDENT) {
        return refuse(one, "%s follows from the steps: it cannot be set", name);
    }
    if (entry->causality == PARAMETER && one->place.phase > INITIALISING) {
        return refuse(one, "%s is fixed: it can be set before the first step only", name);
    }
    return DONE;
}

static Status check_phase(Instance *one, const Access *access) {
    uint64_t fmi = (uint64_t)one->fmi;
    switch (one->place.phase) {
    case TERMINATED:
        return refuse(one, "call out of order: no fmi%uSet%s after fmi%uTerminate", fmi,
                      access->word, fmi);
    case FAILED:
        return refuse(one, "call out of order: no fmi%uSet%s after a step that failed", fmi,
                      access->word);
    case UPDATING:
        return refuse(one, "call out of order: no fmi%uSet%s within a step", fmi, access->word);
    default:
        return DONE;
    }
}

/* FMI 3.0 sets discrete inputs in event mode. Hosts that set them before a step, as fmpy does, are
 * understood: the value acts from the step on. */
static void tell_of_step_mode(Instance *one, const Entry *entry) {
    if (one->has_events && one->place.phase == STEPPING && entry->type != REAL &&
        !one->is_step_mode_told) {
        one->is_step_mode_told = true;
        warn(one, "%s is discrete: with event mode, FMI 3.0 sets it in event mode; set in step "
                  "mode, it acts from the next step on", one->tables.text + entry->name);
    }
}

static void set_value(Instance *one, uint32_t member, double value) {
    const Variable *variable = &one->tables.variables[member];
    if (one->values[member] == value) {
        return;
    }
    one->values[member] = value;
    write_word(&one->tables, variable, value, one->image);
    if (one->place.phase >= STEPPING) {
        one->has_new = true;
        one->is_doubtful |= !(value >= variable->lower && value <= variable->upper);
    } else { /* what was made of the old value is made anew when it is needed */
        one->is_checked = one->has_fingerprint = false;
        one->filled = 0;
        free_motion(one->motion);
        one->motion = NULL;
    }
}

/* Refuse whole numbers that no variable can have. */
static Status check_wholes(Instance *one, const Access *access, const void *values,
                           size_t count) {
    for (size_t k = 0; access->form == LONGS && k < count; k++) {
        int64_t value = ((const int64_t *)values)[k];
        if (value < INT32_MIN || value > INT32_MAX) {
            return refuse(one, "fmi%uSet%s: %d is no number of an enumeration",
                          (uint64_t)one->fmi, access->word, value);
        }
    }
    return DONE;
}

Status set_values(Instance *one, const Access *access, const uint32_t *references, size_t count,
                  const void *values, size_t value_count) {
    const Tables *tables = &one->tables;
    int64_t needs = 0;
    size_t at = 0;
    Status status = check_phase(one, access);
    if (status == DONE) {
        status = check_list(one, "Set", access, references, count, values, value_count, &needs);
    }
    if (status == DONE) {
        status = check_wholes(one, access, values, value_count);
    }
    for (size_t k = 0; status == DONE && k < count; k++) {
        status = check_settable(one, find_entry(tables, references[k]));
    }
    for (size_t k = 0; status == DONE && k < count; k++) {
        const Entry *entry = find_entry(tables, references[k]);
        tell_of_step_mode(one, entry);
        for (uint32_t m = 0; m < entry->member_count; m++) {
            double value = take(access->form, values, at++);
            if (entry->type == BOOLEAN) {
                value = value != 0.0;
            }
            set_value(one, tables->members[entry->first_member + m], value);
        }
    }
    return status;
}
