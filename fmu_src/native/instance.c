/* An instance: its phases, its steps, what it logs. */
#include "shell.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Communication points may differ from the present time by rounding: this share of a step,
 * and some units in the last place of the time. */
static const double SHARE_OF_STEP = 1e-3, LAST_PLACES = 8.0 * DBL_EPSILON;
/* The longest step [s], as the longest run of the package: an error at once, instead of a call
 * that does not come back. */
static const double LONGEST_STEP = 1e6;
/* Beyond, a host's times are more than 2e-6 s apart, and its steps no longer what they seem [s]. */
static const double LATEST_START = 1e10;
/* Of hosts [s]. */
static const double USUAL_STEP = 1e-3;

static const char *const PHASE_WORDS[PHASES] = {
    "instantiated", "initialising", "stepping", "terminated", "failed", "in event mode",
    "within a step",
};
static const char *const CATEGORY_WORDS[CATEGORIES] = {"logEvents", "logStatusWarning",
                                                       "logStatusError"};

/* ---- messages --------------------------------------------------------------------- */

static void send(Instance *one, Status status, Category which, const Text *text) {
    if (one->logger != NULL && one->is_logged[which]) {
        one->send(one, status, CATEGORY_WORDS[which], text->text);
    }
}

/* Begin a message with the name of the instance. */
static void begin(Instance *one, Text *text) {
    text->used = 0;
    text->text[0] = 0;
    text_print(text, "%s: ", one->name);
    if (text->used > TEXT_SIZE / 4) { /* leave room for the message behind a long name */
        text->used = TEXT_SIZE / 4;
        while (((unsigned char)text->text[text->used] & 0xc0u) == 0x80) {
            text->used--;
        }
        text->text[text->used] = 0;
        text_print(text, "...: ");
    }
}

static void log_list(Instance *one, Status status, Category category, const char *format,
                     va_list rest) {
    Text text;
    begin(one, &text);
    text_print_list(&text, format, rest);
    send(one, status, category, &text);
}

Status refuse(Instance *one, const char *format, ...) {
    va_list rest;
    va_start(rest, format);
    log_list(one, REFUSED, ERRORS, format, rest);
    va_end(rest);
    return REFUSED;
}

void warn(Instance *one, const char *format, ...) {
    va_list rest;
    va_start(rest, format);
    log_list(one, WARNED, WARNINGS, format, rest);
    va_end(rest);
}

Status out_of_memory(Instance *one) {
    refuse(one, "memory is exhausted");
    return NO_MEMORY;
}

/* Fill a template with a row of notes. */
static void fill(Instance *one, Text *text, const uint32_t *templates, size_t count,
                 int64_t number, const int64_t *row) {
    double facts[FACTS];
    memcpy(facts, row + 1, sizeof facts);
    if (number > 0 && (uint64_t)number < count) {
        text_fill(text, one->tables.text + templates[number], facts, FACTS);
    } else {
        text_print(text, "message %d of the model, which has no words here", number);
    }
}

Status refuse_fault(Instance *one, int64_t number) {
    Text text;
    begin(one, &text);
    fill(one, &text, one->tables.faults, one->tables.fault_count, number, one->notes + 1);
    send(one, REFUSED, ERRORS, &text);
    memset(one->notes, 0, sizeof one->notes);
    return number == MEMORY_FAULT ? NO_MEMORY : REFUSED;
}

/* Log what a kernel has noted, and empty the list. */
static void tell_notes(Instance *one) {
    int64_t count = one->notes[0] < NOTE_ROWS ? one->notes[0] : NOTE_ROWS;
    one->notes[0] = 0;
    for (int64_t k = 1; k < count; k++) {
        int64_t *row = one->notes + 1 + k * NOTE_WORDS;
        if (row[0] != 0) {
            Text text;
            begin(one, &text);
            fill(one, &text, one->tables.notes, one->tables.note_count, row[0], row);
            send(one, WARNED, WARNINGS, &text);
            row[0] = 0;
        }
    }
}

Status choose_logging(Instance *one, bool on, size_t count, const char *const categories[]) {
    Status status = DONE;
    if (count > 0 && categories == NULL) {
        return refuse(one, "fmi%uSetDebugLogging: a list is NULL", (uint64_t)one->fmi);
    }
    if (count == 0) { /* errors are no debug messages: they are told in any case */
        one->is_logged[EVENTS] = one->is_logged[WARNINGS] = on;
        one->is_logged[ERRORS] = true;
        return DONE;
    }
    bool found[CATEGORIES] = {false};
    for (size_t k = 0; k < count; k++) {
        bool is_known = false;
        for (int which = 0; categories[k] != NULL && which < CATEGORIES; which++) {
            if (strcmp(categories[k], "logAll") == 0 ||
                strcmp(categories[k], CATEGORY_WORDS[which]) == 0) {
                found[which] = is_known = true;
            }
        }
        if (!is_known) {
            warn(one, "there is no log category %s: there are logEvents, logStatusWarning and "
                      "logStatusError", categories[k] == NULL ? "NULL" : categories[k]);
            status = WARNED;
        }
    }
    for (int which = 0; which < CATEGORIES; which++) {
        one->is_logged[which] = on ? found[which] : one->is_logged[which] && !found[which];
    }
    return status;
}

/* ---- making and freeing ----------------------------------------------------------- */

Instance *new_instance(int fmi, const char *name) {
    Instance *one = calloc(1, sizeof *one);
    if (one == NULL) {
        return NULL;
    }
    one->fmi = fmi;
    one->name = clean_copy(name);
    one->is_logged[WARNINGS] = one->is_logged[ERRORS] = true;
    if (one->name == NULL) {
        free(one);
        return NULL;
    }
    return one;
}

void free_instance(Instance *one) {
    free_motion(one->motion);
    free_states(one);
    close_tables(&one->tables);
    free(one->name);
    free(one->values);
    free(one->image);
    free(one->given);
    free(one->outputs);
    free(one);
}

/* Take the values and the phase of the beginning. */
static void begin_anew(Instance *one) {
    const Tables *tables = &one->tables;
    for (uint32_t k = 0; k < tables->variable_count; k++) {
        one->values[k] = tables->variables[k].start;
    }
    memcpy(one->image, tables->image, tables->image_count * sizeof *one->image);
    write_image(tables, one->values, one->image);
    free_motion(one->motion);
    one->motion = NULL;
    one->filled = 0;
    one->is_checked = one->is_doubtful = one->has_new = one->has_fingerprint = false;
    one->place = (Place){.phase = INSTANTIATED};
    one->last_step = DONE;
}

Status open_instance(Instance *one, const char *guid, const char *location, Location kind) {
    Text fault = {.used = 0};
    size_t size = 0;
    const char *word = one->fmi == 2 ? "guid" : "instantiationToken";
    if (guid == NULL || location == NULL) {
        return refuse(one, "no instance: the %s is NULL",
                      guid == NULL ? word : "place of the resources");
    }
    uint8_t *file = read_resource(location, kind, "model.bin", &size, &fault);
    if (file == NULL || !open_tables(&one->tables, file, size, one->fmi, &fault)) {
        return refuse(one, "no instance: %s", fault.text);
    }
    if (strcmp(guid, one->tables.guid) != 0) {
        return refuse(one, "no instance: the %s is %s, but this FMU is %s", word, guid,
                      one->tables.guid);
    }
    const Tables *tables = &one->tables;
    one->kernels = kernels_of_machine();
    one->values = calloc(tables->variable_count + 1, sizeof *one->values);
    one->given = calloc(tables->input_count + 1, sizeof *one->given);
    one->outputs = calloc(tables->output_count + 1, sizeof *one->outputs);
    one->image = calloc(tables->image_count, sizeof *one->image);
    if (one->values == NULL || one->given == NULL || one->outputs == NULL || one->image == NULL) {
        return out_of_memory(one);
    }
    begin_anew(one);
    return DONE;
}

Status reset(Instance *one) {
    if (one->place.phase == UPDATING) {
        return refuse(one, "call out of order: no fmi%uReset within a step", (uint64_t)one->fmi);
    }
    begin_anew(one);
    return DONE;
}

/* ---- phases ----------------------------------------------------------------------- */

bool is_phase(Instance *one, const char *call, Phase phase) {
    if (one->place.phase == phase) {
        return true;
    }
    if (one->place.phase == FAILED) {
        refuse(one, "call out of order: %s is allowed while %s, but the instance has failed in a "
                    "step: reset it, or restore a state", call, PHASE_WORDS[phase]);
    } else {
        refuse(one, "call out of order: %s is allowed while %s, but the instance is %s", call,
               PHASE_WORDS[phase], PHASE_WORDS[one->place.phase]);
    }
    return false;
}

Status set_up(Instance *one, double start, bool has_stop, double stop) {
    if (!(fabs(start) <= LATEST_START)) {
        return refuse(one, "startTime = %r: must be a time within 1e10 s of 0", start);
    }
    if (has_stop && !(stop >= start)) {
        return refuse(one, "stopTime = %r: must not lie before startTime = %r s", stop, start);
    }
    one->place.start = one->place.now = start;
    one->place.has_stop = has_stop;
    one->place.stop = has_stop ? stop : 0.0;
    one->place.is_set_up = true;
    return DONE;
}

/* Check all values, and that they go together. */
static Status check_all(Instance *one, const double *values, const int64_t *image) {
    const Tables *tables = &one->tables;
    Status status = check_values(one, values, 0, tables->variable_count);
    if (status == DONE) {
        status = check_drive(one, values);
    }
    if (status == DONE) {
        int64_t fault = one->kernels.check(image, one->notes);
        status = fault == 0 ? DONE : refuse_fault(one, fault);
    }
    return status;
}

static Status check_once(Instance *one) {
    Status status = one->is_checked ? DONE : check_all(one, one->values, one->image);
    one->is_checked = status == DONE;
    return status;
}

Status enter_initialisation(Instance *one) {
    Status status = check_once(one);
    if (status == DONE) {
        one->place.phase = INITIALISING;
    }
    return status;
}

/* Do a step and take it back: the first one would cost ten times as much as others, since the
 * code comes into memory with it. What it refuses the first one will. */
static void rehearse(Instance *one) {
    size_t size = (size_t)one->motion[SHARED_BEGIN];
    int64_t *kept = malloc(size);
    double found[2];
    if (kept != NULL) {
        memcpy(kept, one->motion, size);
        one->kernels.step(one->motion, one->image, NEW_INPUTS, USUAL_STEP, USUAL_STEP, found,
                          one->notes);
        memcpy(one->motion, kept, size);
        one->notes[0] = 0;
        one->filled = 0;
        free(kept);
    }
}

Status exit_initialisation(Instance *one) {
    Status status = need_motion(one);
    if (status == DONE) {
        rehearse(one);
        one->place.phase = one->has_events ? IN_EVENT : STEPPING;
        one->is_doubtful = false;
    }
    return status;
}

Status terminate(Instance *one, const char *call) {
    if (one->place.phase != IN_EVENT && !is_phase(one, call, STEPPING)) {
        return REFUSED;
    }
    one->place.phase = TERMINATED;
    return DONE;
}

/* ---- the motion ------------------------------------------------------------------- */

static bool is_motion_good(const int64_t *motion) {
    int64_t all = motion[MOTION_BYTES], begin_of = motion[STATE_BEGIN];
    int64_t size = motion[STATE_BYTES];
    return all > 0 && begin_of >= 0 && size >= 0 && begin_of <= all && size <= all - begin_of &&
           begin_of % 8 == 0 && motion[SHARED_BEGIN] >= begin_of + size &&
           motion[SHARED_BEGIN] <= all;
}

/* Hash of all that a motion is made of. */
static void hash_image(const Tables *tables, const int64_t *image, uint8_t digest[DIGEST]) {
    Hash hash;
    hash_begin(&hash);
    hash_add(&hash, image, tables->image_count * sizeof *image);
    hash_end(&hash, digest);
}

Status make_motion(Instance *one, const double *values, const int64_t *image, int64_t **motion) {
    const Tables *tables = &one->tables;
    Status status = check_all(one, values, image);
    uint8_t digest[DIGEST];
    *motion = NULL;
    if (status != DONE) {
        return status;
    }
    hash_image(tables, image, digest);
    if ((*motion = equal_motion(digest)) != NULL) {
        return DONE;
    }
    int64_t fault = one->kernels.create(image, motion, one->notes);
    if (fault != 0) {
        free_motion(*motion);
        *motion = NULL;
        return refuse_fault(one, fault);
    }
    if (*motion == NULL) {
        return out_of_memory(one);
    }
    if (!is_motion_good(*motion)) {
        free_motion(*motion);
        *motion = NULL;
        return refuse(one, "the model has no good place for its state");
    }
    if ((*motion = share_motion(*motion, digest)) == NULL) {
        return out_of_memory(one);
    }
    tell_notes(one);
    return DONE;
}

Status need_motion(Instance *one) {
    if (one->motion != NULL) {
        return check_once(one);
    }
    Status status = make_motion(one, one->values, one->image, &one->motion);
    if (status == DONE) {
        one->is_checked = true;
        one->has_new = false;
        memcpy(one->given, one->values, one->tables.input_count * sizeof *one->given);
    }
    return status;
}

/* ---- steps ------------------------------------------------------------------------ */

/* Refuse a step that does not begin where the last one has ended. */
static Status check_time(Instance *one, double from, double slack) {
    double now = one->place.now;
    if (fabs(from - now) <= slack) {
        return DONE;
    }
    return refuse(one, "currentCommunicationPoint = %r s lies %s the present time of %r s: steps "
                       "must follow each other; to go back, restore a state",
                  from, from < now ? "before" : "after", now);
}

Status check_step(Instance *one, const char *call, double from, double size) {
    Place *place = &one->place;
    double to = from + size, slack = SHARE_OF_STEP * size + LAST_PLACES * fabs(place->now);
    if (place->phase != STEPPING && !is_phase(one, call, STEPPING)) {
        return REFUSED;
    }
    if (!(size > 0.0 && size < INFINITY)) {
        return refuse(one, "communicationStepSize = %r: must be above 0 s", size);
    }
    if (from != place->now && check_time(one, from, slack) != DONE) {
        return REFUSED;
    }
    if (!(to - place->now <= LONGEST_STEP)) { /* the slack may be long at a great time */
        return refuse(one, "communicationStepSize = %r: must be at most %r s", size,
                      LONGEST_STEP);
    }
    if (place->has_stop && to > place->stop + slack) {
        return refuse(one, "the step ends at %r s, beyond stopTime = %r s", to, place->stop);
    }
    if (one->is_doubtful) {
        if (check_values(one, one->values, 0, one->tables.input_count) != DONE) {
            return REFUSED;
        }
        one->is_doubtful = false;
    }
    return one->has_new ? check_drive(one, one->values) : DONE;
}

Status advance(Instance *one, double to, double size, int64_t flags, Reached *reached) {
    double start = one->place.start, end = to - start, found[2] = {end, 0.0};
    flags |= one->has_new ? NEW_INPUTS : 0;
    one->filled = 0;
    int64_t fault = one->kernels.step(one->motion, one->image, flags, end, size, found,
                                      one->notes);
    if (fault != 0) {
        one->place.phase = FAILED;
        return refuse_fault(one, fault);
    }
    one->has_new = false;
    reached->time = found[0] < end ? start + found[0] : to;
    reached->is_blow = found[1] > 0.0;
    one->place.now = reached->time;
    if (one->notes[0] != 0) {
        tell_notes(one);
    }
    return DONE;
}

Status do_step(Instance *one, const char *call, double from, double size) {
    Reached reached;
    Status status = check_step(one, call, from, size);
    if (status == DONE) {
        status = advance(one, from + size, size, 0, &reached);
    }
    return one->last_step = status;
}
