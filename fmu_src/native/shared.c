/* Tables that equal motions share: the first one that is made stays as it is, and each instance
 * has a copy of all but the tables.
 */
#include "shell.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* A motion as it was made, whose tables others use. */
typedef struct Shared Shared;
struct Shared {
    Shared *next;
    uint8_t digest[DIGEST];
    int64_t *made;
    size_t users;
};

static Shared *all_shared;
static atomic_flag is_busy = ATOMIC_FLAG_INIT; /* held for some words of memory only */

static void begin_alone(void) {
    while (atomic_flag_test_and_set_explicit(&is_busy, memory_order_acquire)) {
    }
}

static void end_alone(void) { atomic_flag_clear_explicit(&is_busy, memory_order_release); }

/* Count a user more of what has a hash. */
static Shared *find_shared(const uint8_t digest[DIGEST]) {
    Shared *one = all_shared;
    while (one != NULL && memcmp(one->digest, digest, DIGEST) != 0) {
        one = one->next;
    }
    if (one != NULL) {
        one->users++;
    }
    return one;
}

static void leave_shared(Shared *one) {
    begin_alone();
    bool is_last = --one->users == 0;
    for (Shared **at = &all_shared; is_last && *at != NULL; at = &(*at)->next) {
        if (*at == one) {
            *at = one->next;
            break;
        }
    }
    end_alone();
    if (is_last) {
        native_free((int64_t)(intptr_t)one->made);
        free(one);
    }
}

/* Copy all but the tables; offsets of tables then lead to those of the original. */
static int64_t *copy_motion(Shared *shared) {
    const int64_t *made = shared->made;
    int64_t own = made[SHARED_BEGIN];
    int64_t *copy = (int64_t *)(intptr_t)native_allocate(own);
    if (copy == NULL) {
        leave_shared(shared);
        return NULL;
    }
    memcpy(copy, made, (size_t)own);
    int64_t *row = copy + made[DIRECTORY_BEGIN] / (int64_t)sizeof *copy;
    for (int64_t k = 0; k < made[DIRECTORY_ROWS]; k++, row += made[DIRECTORY_WORDS]) {
        if (row[0] >= own) {
            row[0] += (int64_t)((intptr_t)made - (intptr_t)copy);
        }
    }
    copy[MOTION_BYTES] = own;
    copy[SHARED] = (int64_t)(intptr_t)shared;
    return copy;
}

int64_t *equal_motion(const uint8_t digest[DIGEST]) {
    begin_alone();
    Shared *shared = find_shared(digest);
    end_alone();
    return shared == NULL ? NULL : copy_motion(shared);
}

int64_t *share_motion(int64_t *made, const uint8_t digest[DIGEST]) {
    Shared *mine = made[SHARED_BEGIN] < made[MOTION_BYTES] ? malloc(sizeof *mine) : NULL;
    if (mine == NULL) { /* it goes on alone */
        return made;
    }
    *mine = (Shared){.made = made, .users = 1};
    memcpy(mine->digest, digest, DIGEST);
    begin_alone();
    Shared *shared = find_shared(digest); /* another thread may have been first */
    if (shared == NULL) {
        mine->next = all_shared;
        shared = all_shared = mine;
    }
    end_alone();
    if (shared != mine) {
        native_free((int64_t)(intptr_t)made);
        free(mine);
    }
    return copy_motion(shared);
}

void free_motion(int64_t *motion) {
    if (motion != NULL) {
        Shared *shared = (Shared *)(intptr_t)motion[SHARED];
        native_free((int64_t)(intptr_t)motion);
        if (shared != NULL) {
            leave_shared(shared);
        }
    }
}
