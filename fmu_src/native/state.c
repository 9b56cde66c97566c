/* Saved states: all that moves, in memory or as bytes.
 *
 * Blocks that are given back stay with their instance until it is freed, to be used again.
 * So a state that is used after it was freed is recognised, not read from memory of others.
 * As bytes a state has a head with a hash; nothing is taken over before all of it is checked.
 */
#include "shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* At the beginning of a block. */
static const uint64_t LIVE = UINT64_C(0x314554415453484d), FREED = UINT64_C(0x304545524653484d);

struct State {
    uint64_t mark;
    Instance *owner;
    State *next;
    State *next_spare; /* of those that were freed */
    size_t capacity;   /* of `words` [bytes] */
    bool is_own;     /* made from an instance: needs no second look */
    Place place;
    uint8_t belongs_to[DIGEST];
    size_t motion_size; /* [bytes] */
    double words[];     /* values, inputs that the motion was made with, motion */
};

/* Head of the bytes: magic, version, what it belongs to, length of the body, hash. */
static const uint8_t MAGIC[8] = {'P', 'H', 'A', 'M', 'M', 'E', 'R', 0};
enum {
    FORMAT = 3, /* 1 and 2 are those of FMUs in Python */
    VERSION_AT = 8, OWNER_AT = 12, LENGTH_AT = OWNER_AT + DIGEST, HASH_AT = LENGTH_AT + 8,
    BODY_AT = HASH_AT + DIGEST
};
enum { IS_SET_UP = 1, HAS_STOP = 2 };

/* The body begins with the place. Numbers lie in the bytes as in memory: only little endian
 * processors run this. */
typedef struct {
    uint8_t phase, flags, unused[6];
    double start, now, stop;
} SavedPlace;
_Static_assert(sizeof(SavedPlace) == 32, "the place has no gaps");

static size_t value_count(const Instance *one) {
    return (size_t)one->tables.variable_count + one->tables.input_count;
}

static double *given_of(const Instance *one, State *state) {
    return state->words + one->tables.variable_count;
}

static int64_t *motion_of(const Instance *one, State *state) {
    return (int64_t *)(state->words + value_count(one));
}

/* ---- blocks ----------------------------------------------------------------------- */

/* A block for a motion of some bytes; NULL where memory ends. */
static State *new_block(Instance *one, size_t motion_size) {
    size_t needed = value_count(one) * sizeof(double) + motion_size;
    State **link = &one->spare;
    if (motion_size > SIZE_MAX / 2) {
        return NULL;
    }
    while (*link != NULL && (*link)->capacity < needed) {
        link = &(*link)->next_spare;
    }
    State *state = *link;
    if (state != NULL) {
        *link = state->next_spare;
    } else {
        state = malloc(sizeof *state + needed + sizeof(double));
        if (state == NULL) {
            return NULL;
        }
        state->capacity = needed;
        state->owner = one;
        state->next = one->states;
        one->states = state;
    }
    state->mark = LIVE;
    state->motion_size = motion_size;
    return state;
}

static void spare(Instance *one, State *state) {
    state->mark = FREED;
    state->next_spare = one->spare;
    one->spare = state;
}

/* Whether a block is one of the instance's; does not look into it. */
static bool is_mine(const Instance *one, const void *block) {
    const State *state = one->states;
    while (state != NULL && (const void *)state != block) {
        state = state->next;
    }
    return state != NULL;
}

void free_states(Instance *one) {
    while (one->states != NULL) {
        State *state = one->states;
        one->states = state->next;
        state->mark = 0;
        free(state);
    }
}

/* A state that is to be read; one of another instance that lives is as good. */
static State *readable(Instance *one, void *block) {
    uint64_t mark = 0;
    if (block == NULL) {
        refuse(one, "the saved state is NULL");
        return NULL;
    }
    memcpy(&mark, block, sizeof mark);
    if (mark != LIVE) {
        refuse(one, mark == FREED ? "the saved state was freed"
                                  : "the saved state belongs to another FMU");
        return NULL;
    }
    return block;
}

Status free_state(Instance *one, void **block) {
    void *itself = block; /* fmusim gives the state, not the place of it */
    if (is_mine(one, itself)) {
        block = &itself;
    }
    if (block == NULL || *block == NULL) {
        return DONE;
    }
    if (!is_mine(one, *block)) {
        return refuse(one, "the saved state belongs to another instance, which may free it");
    }
    State *state = readable(one, *block);
    if (state == NULL) {
        return REFUSED;
    }
    spare(one, state);
    *block = NULL;
    return DONE;
}

/* ---- what a state belongs to ------------------------------------------------------ */

/* Hash of the tables and, later, of the parameters, which are fixed then. */
static void find_owner(Instance *one, Phase phase, uint8_t digest[DIGEST]) {
    const Tables *tables = &one->tables;
    uint32_t first = tables->input_count + tables->output_count;
    Hash hash;
    if (phase < STEPPING) {
        memcpy(digest, tables->digest, DIGEST);
        return;
    }
    if (!one->has_fingerprint) {
        hash_begin(&hash);
        hash_add(&hash, tables->digest, DIGEST);
        hash_add(&hash, one->values + first,
                 (tables->variable_count - first) * sizeof *one->values);
        hash_end(&hash, one->fingerprint);
        one->has_fingerprint = true;
    }
    memcpy(digest, one->fingerprint, DIGEST);
}

static bool belongs_here(Instance *one, const State *state) {
    uint8_t owner[DIGEST];
    find_owner(one, state->place.phase, owner);
    if (memcmp(owner, state->belongs_to, DIGEST) != 0) {
        refuse(one, "the saved state belongs to other parameters or to another FMU");
        return false;
    }
    return true;
}

/* What was read of a state is no part of it. */
static void forget_reading(int64_t *motion, size_t size) {
    if (size >= sizeof *motion) {
        motion[0] = 0;
    }
}

/* ---- saving and restoring in memory ----------------------------------------------- */

Status get_state(Instance *one, void **block) {
    const Tables *tables = &one->tables;
    bool has_motion = one->place.phase >= STEPPING;
    size_t size = 0;
    if (block == NULL) {
        return refuse(one, "the place for a saved state is NULL");
    }
    if (one->place.phase == UPDATING) {
        return refuse(one, "call out of order: no state can be saved within a step");
    }
    if (has_motion) {
        int64_t fault = one->kernels.read(one->motion, TO_SAVE, one->outputs);
        if (fault != 0) {
            return refuse_fault(one, fault);
        }
        size = (size_t)one->motion[STATE_BYTES];
    }
    if (*block != NULL && is_mine(one, *block) && ((State *)*block)->mark == LIVE) {
        spare(one, *block); /* the host wants it to be overwritten */
    }
    *block = NULL;
    State *state = new_block(one, size);
    if (state == NULL) {
        return out_of_memory(one);
    }
    state->is_own = true;
    state->place = one->place;
    find_owner(one, one->place.phase, state->belongs_to);
    memcpy(state->words, one->values, tables->variable_count * sizeof(double));
    memcpy(given_of(one, state), has_motion ? one->given : one->values,
           tables->input_count * sizeof(double));
    if (has_motion) {
        memcpy(motion_of(one, state), (uint8_t *)one->motion + one->motion[STATE_BEGIN], size);
        forget_reading(motion_of(one, state), size);
    }
    *block = state;
    return DONE;
}

/* Make a motion under inputs of another start. */
static Status make_given(Instance *one, const double *given, int64_t **motion) {
    const Tables *tables = &one->tables;
    size_t values = tables->variable_count, words = tables->image_count;
    double *copy = malloc((values + words + 1) * sizeof *copy);
    if (copy == NULL) {
        return out_of_memory(one);
    }
    int64_t *image = (int64_t *)(copy + values);
    memcpy(copy, one->values, values * sizeof *copy);
    memcpy(copy, given, tables->input_count * sizeof *copy);
    memcpy(image, one->image, words * sizeof *image);
    write_image(tables, copy, image);
    Status status = make_motion(one, copy, image, motion);
    free(copy);
    return status;
}

/* Find or make a motion into which a state fits, and look at a state from outside. */
static Status prepare(Instance *one, State *state, int64_t **motion) {
    const double *given = given_of(one, state);
    const Place *place = &state->place;
    Status status = DONE;
    *motion = one->motion;
    if (one->motion == NULL ||
        memcmp(given, one->given, one->tables.input_count * sizeof *given) != 0) {
        status = make_given(one, given, motion);
    }
    if (status != DONE) {
        return status;
    }
    if ((size_t)(*motion)[STATE_BYTES] != state->motion_size) {
        status = refuse(one, "the saved state does not fit the solver");
    } else if (!state->is_own) {
        int64_t fault = one->kernels.fault(*motion, motion_of(one, state),
                                           place->now - place->start, one->notes);
        status = fault == 0 ? DONE : refuse_fault(one, fault);
    }
    if (status != DONE && *motion != one->motion) {
        free_motion(*motion);
    }
    return status;
}

/* Take a motion over; from here on nothing is refused. */
static void take_motion(Instance *one, State *state, int64_t *motion) {
    if (motion != one->motion) {
        free_motion(one->motion);
        one->motion = motion;
    }
    memcpy(one->given, given_of(one, state), one->tables.input_count * sizeof *one->given);
    memcpy((uint8_t *)motion + motion[STATE_BEGIN], motion_of(one, state), state->motion_size);
}

static void take_values(Instance *one, State *state) {
    const Tables *tables = &one->tables;
    bool has_started = state->place.phase >= STEPPING; /* then the parameters are the same */
    memcpy(one->values, state->words,
           (has_started ? tables->input_count : tables->variable_count) * sizeof *one->values);
    write_image(tables, one->values, one->image);
    one->place = state->place;
    if (one->place.phase == IN_EVENT && !one->has_events) {
        one->place.phase = STEPPING;
    }
    one->filled = 0;
    one->is_checked = false;
    one->is_doubtful = one->has_new = one->place.phase >= STEPPING;
}

Status set_state(Instance *one, void *block) {
    State *state = readable(one, block);
    if (state == NULL) {
        return REFUSED;
    }
    if (one->place.phase == UPDATING) {
        return refuse(one, "call out of order: no state can be restored within a step");
    }
    if (!belongs_here(one, state)) {
        return REFUSED;
    }
    if (state->place.phase >= STEPPING) {
        int64_t *motion;
        Status status = prepare(one, state, &motion);
        if (status != DONE) {
            return status;
        }
        take_motion(one, state, motion);
        one->is_checked = true;
    } else {
        free_motion(one->motion);
        one->motion = NULL;
        one->has_fingerprint = false;
    }
    take_values(one, state);
    return DONE;
}

/* ---- bytes ------------------------------------------------------------------------ */

static void put(uint8_t *bytes, uint64_t value, size_t count) { memcpy(bytes, &value, count); }

static uint64_t taken(const uint8_t *bytes, size_t count) {
    uint64_t value = 0;
    memcpy(&value, bytes, count);
    return value;
}

/* Hash of the head before it, and of the body. */
static void find_hash(const uint8_t *bytes, size_t size, uint8_t digest[DIGEST]) {
    Hash hash;
    hash_begin(&hash);
    hash_add(&hash, bytes, HASH_AT);
    hash_add(&hash, bytes + BODY_AT, size - BODY_AT);
    hash_end(&hash, digest);
}

static size_t size_of(const Instance *one, const State *state) {
    return BODY_AT + sizeof(SavedPlace) + value_count(one) * sizeof(double) + state->motion_size;
}

/* A state that belongs to this FMU: others have another number of values. */
static State *readable_here(Instance *one, void *block) {
    State *state = readable(one, block);
    bool is_good = state != NULL && (is_mine(one, state) || belongs_here(one, state));
    return is_good ? state : NULL;
}

Status state_size(Instance *one, void *block, size_t *size) {
    State *state = readable_here(one, block);
    if (state == NULL) {
        return REFUSED;
    }
    if (size == NULL) {
        return refuse(one, "the place for the size of a saved state is NULL");
    }
    *size = size_of(one, state);
    return DONE;
}

Status state_to_bytes(Instance *one, void *block, uint8_t *bytes, size_t size) {
    State *state = readable_here(one, block);
    if (state == NULL) {
        return REFUSED;
    }
    size_t needed = size_of(one, state);
    const Place *place = &state->place;
    if (bytes == NULL || size < needed) {
        return refuse(one, "the saved state has %u bytes, but the place for it has %u",
                      (uint64_t)needed, (uint64_t)(bytes == NULL ? 0 : size));
    }
    memcpy(bytes, MAGIC, sizeof MAGIC);
    put(bytes + VERSION_AT, FORMAT, 4);
    memcpy(bytes + OWNER_AT, state->belongs_to, DIGEST);
    put(bytes + LENGTH_AT, needed - BODY_AT, 8);
    SavedPlace saved = {
        .phase = (uint8_t)place->phase,
        .flags = (uint8_t)((place->is_set_up ? IS_SET_UP : 0) | (place->has_stop ? HAS_STOP : 0)),
        .start = place->start, .now = place->now, .stop = place->stop,
    };
    memcpy(bytes + BODY_AT, &saved, sizeof saved);
    memcpy(bytes + BODY_AT + sizeof saved, state->words, needed - BODY_AT - sizeof saved);
    find_hash(bytes, needed, bytes + HASH_AT);
    return DONE;
}

/* Refuse what is no state, of another version, cut short or changed. */
static Status check_head(Instance *one, const uint8_t *bytes, size_t size) {
    uint8_t digest[DIGEST];
    if (size < BODY_AT) {
        return refuse(one, "a saved state of %u bytes is too short to be one", (uint64_t)size);
    }
    if (memcmp(bytes, MAGIC, sizeof MAGIC) != 0) {
        return refuse(one, "these bytes are no saved state of this family of FMUs");
    }
    if (taken(bytes + VERSION_AT, 4) != FORMAT) {
        return refuse(one, "the saved state has version %u, this FMU reads %u",
                      taken(bytes + VERSION_AT, 4), (uint64_t)FORMAT);
    }
    uint64_t length = taken(bytes + LENGTH_AT, 8);
    if (size - BODY_AT != length) {
        return refuse(one, "the saved state has %u bytes where %u belong",
                      (uint64_t)(size - BODY_AT), length);
    }
    find_hash(bytes, size, digest);
    if (memcmp(digest, bytes + HASH_AT, DIGEST) != 0) {
        return refuse(one, "the saved state was changed: its hash does not fit");
    }
    return DONE;
}

static Status read_place(Instance *one, const uint8_t *body, Place *place) {
    SavedPlace saved;
    memcpy(&saved, body, sizeof saved);
    double start = saved.start, now = saved.now, stop = saved.stop;
    bool is_set_up = (saved.flags & IS_SET_UP) != 0, has_stop = (saved.flags & HAS_STOP) != 0;
    if (saved.phase >= UPDATING || (saved.flags & ~(IS_SET_UP | HAS_STOP)) != 0 ||
        (!is_set_up && (saved.phase > INSTANTIATED || has_stop))) {
        return refuse(one, "the saved state is in phase %u, set up: %u", (uint64_t)saved.phase,
                      (uint64_t)saved.flags);
    }
    if (!(isfinite(start) && isfinite(now) && now >= start)) {
        return refuse(one, "the saved state has the time %r s after a start at %r s", now, start);
    }
    if (has_stop && !(stop >= start)) {
        return refuse(one, "the saved state has a stop at %r s after a start at %r s", stop,
                      start);
    }
    *place = (Place){(Phase)saved.phase, is_set_up, has_stop, start, now, has_stop ? stop : 0.0};
    return DONE;
}

/* Refuse values that are none of their type; bounds are checked when they are used. */
static Status check_types(Instance *one, State *state) {
    const Tables *tables = &one->tables;
    for (size_t k = 0; k < value_count(one); k++) {
        size_t which = k < tables->variable_count ? k : k - tables->variable_count;
        const Variable *found = &tables->variables[which];
        if (found->causality == OUTPUT) {
            state->words[k] = 0.0;
        } else if (!is_value(found, state->words[k])) {
            return refuse(one, "the saved state has %s = %r: no %s", tables->text + found->name,
                          state->words[k], type_word(found->type));
        }
    }
    return DONE;
}

/* The parameters are fixed in a state of a started instance: its owner tells them too. */
static Status check_parts(Instance *one, const uint8_t *bytes, State *state) {
    const uint8_t *body = bytes + BODY_AT;
    memcpy(state->belongs_to, bytes + OWNER_AT, DIGEST);
    memcpy(state->words, body + sizeof(SavedPlace),
           value_count(one) * sizeof(double) + state->motion_size);
    state->is_own = false;
    forget_reading(motion_of(one, state), state->motion_size);
    Status status = read_place(one, body, &state->place);
    if (status == DONE && state->place.phase < STEPPING && state->motion_size != 0) {
        status = refuse(one, "the saved state has %u bytes too many",
                        (uint64_t)state->motion_size);
    }
    return status == DONE ? check_types(one, state) : status;
}

Status state_from_bytes(Instance *one, const uint8_t *bytes, size_t size, void **block) {
    if (bytes == NULL || block == NULL) {
        return refuse(one, "a saved state, or the place for it, is NULL");
    }
    *block = NULL;
    Status status = check_head(one, bytes, size);
    if (status != DONE) {
        return status;
    }
    size_t body = size - BODY_AT, least = sizeof(SavedPlace) + value_count(one) * sizeof(double);
    if (body < sizeof(SavedPlace)) {
        return refuse(one, "the saved state has %u bytes, too few for a time", (uint64_t)body);
    }
    if (body < least) {
        return refuse(one, "the saved state has %u bytes, too few for %u values", (uint64_t)body,
                      (uint64_t)value_count(one));
    }
    State *state = new_block(one, body - least);
    if (state == NULL) {
        return out_of_memory(one);
    }
    status = check_parts(one, bytes, state);
    if (status != DONE) {
        spare(one, state);
        return status;
    }
    *block = state;
    return DONE;
}
