/* Kernels of a toy, to test the shell: a mass under the feed force, with a blow every 10 ms.
 *
 * Where words stand in the image, and outputs in a reading, is given by the compiler's -D.
 */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "shell.h"

static const double MASS = 100.0, PERIOD = 0.01;

/* What moves. */
typedef struct {
    int64_t is_read; /* what was read belongs to it */
    double time, x, v, force, impulse, size;
    double impulse_at_begin; /* of the communication step, if it is known */
    int64_t is_known;
    int64_t blows;
} Moving;

/* Head, what does not move, what moves. */
typedef struct {
    int64_t bytes, at, size, kind;
    int64_t shared_at, directory_at, directory_rows, directory_words, shared;
    int64_t told;
    double rock_at_start, left, x_read; /* `left`: an impulse that is not known yet */
    Moving moving;
} Motion;

static double number(const int64_t *image, int64_t at) {
    double found;
    memcpy(&found, image + at, sizeof found);
    return found;
}

/* What stands behind the bars. */
static double own(const int64_t *image, int64_t which) {
    int64_t rods = image[2], sections = image[0] + image[1];
    for (int64_t k = 0; k < rods; k++) {
        sections += image[3 + k];
    }
    return number(image, 3 + rods + VALUES + 4 * sections + 6 * rods + which);
}

static double value(const int64_t *image, int64_t field) {
    return number(image, 3 + image[2] + field);
}

static int64_t fault(int64_t *notes, int64_t which, double first, double second) {
    notes[1] = which;
    memcpy(notes + 2, &first, sizeof first);
    memcpy(notes + 3, &second, sizeof second);
    return which;
}

int64_t native_allocate(int64_t size); /* memory.c */

int64_t kernel_check_base(const int64_t *image, int64_t *notes) {
    double gap = value(image, START_GAP);
    return gap > 50.0 ? fault(notes, 5, gap, 2.0) : 0;
}

int64_t kernel_create_base(const int64_t *image, int64_t **motion, int64_t *notes) {
    double place = own(image, 4);
    Motion *made = (Motion *)(intptr_t)native_allocate(sizeof *made);
    *motion = (int64_t *)made;
    if (made == NULL) {
        return fault(notes, MEMORY_FAULT, 0.0, 0.0);
    }
    if (place > 1.0) {
        return fault(notes, 2, place, 1.0);
    }
    made->bytes = sizeof *made;
    made->at = offsetof(Motion, moving);
    made->size = sizeof made->moving;
    made->shared_at = sizeof *made; /* nothing is shared */
    made->rock_at_start = value(image, STIFFNESS);
    made->moving.force = value(image, FEED_FORCE);
    return 0;
}

int64_t kernel_step_base(int64_t *motion, const int64_t *image, int64_t flags, double t, double h,
                         double *reached, int64_t *notes) {
    Motion *all = (Motion *)motion;
    Moving *m = &all->moving;
    if ((flags & SAME_STEP) == 0) {
        all->left = m->impulse;
        m->is_known = 0;
    }
    if (flags & NEW_INPUTS) {
        m->force = value(image, FEED_FORCE);
    }
    if (m->force == 666.0 || t > 1e5) { /* the latter takes too long */
        return fault(notes, 3, t, 0.0);
    }
    if (m->force < 0.0 && all->told == 0) {
        all->told = 1;
        notes[0] = 2;
        fault(notes + 8, 1, t, m->force);
    }
    double next = PERIOD * (double)(m->blows + 1), end = t;
    int64_t before = m->blows;
    if ((flags & STOP_AT_BLOW) && next < t) {
        end = next;
    }
    while (PERIOD * (double)(m->blows + 1) <= end) {
        m->blows++;
    }
    double d = end - m->time, a = m->force / MASS;
    m->x += d * (m->v + 0.5 * a * d);
    m->v += a * d;
    m->impulse += m->force * d;
    m->time = end;
    m->size = h - (t - end);
    m->is_read = 0;
    reached[0] = end;
    reached[1] = (double)(m->blows - before);
    return 0;
}

int64_t kernel_read_base(int64_t *motion, int64_t flags, double *outputs) {
    Motion *all = (Motion *)motion;
    Moving *m = &all->moving;
    if (m->is_known == 0) {
        m->impulse_at_begin = all->left;
        m->is_known = 1;
    }
    if (flags & TO_SAVE) {
        return 0;
    }
    if (m->is_read == 0) {
        all->x_read = m->x;
        m->is_read = 1;
    }
    outputs[POSITION] = all->x_read;
    outputs[VELOCITY] = m->v;
    outputs[FORCE] = m->force;
    outputs[FORCE_MEAN] = m->size > 0.0 ? (m->impulse - m->impulse_at_begin) / m->size : 0.0;
    outputs[FORCE_PEAK] = flags & 1 ? fabs(m->force) : -1.0;
    outputs[GAUGE_STRESS] = flags & 2 ? all->rock_at_start : -1.0;
    outputs[BLOW_COUNT] = (double)m->blows;
    outputs[DRILLING_MODE] = 2.0;
    outputs[OFF_BOTTOM] = m->force < 0.0;
    return 0;
}

int64_t kernel_fault_base(const int64_t *motion, const int64_t *state, double t, int64_t *notes) {
    Moving m;
    (void)motion;
    memcpy(&m, state, sizeof m);
    const double all[] = {m.x, m.v, m.force, m.impulse, m.size, m.impulse_at_begin};
    for (size_t k = 0; k < sizeof all / sizeof *all; k++) {
        if (!isfinite(all[k])) {
            return fault(notes, 4, all[k], 0.0);
        }
    }
    if (!(fabs(m.time - t) <= 1e-9) || m.blows < 0 || m.blows > 1000000) {
        return fault(notes, 4, m.time, (double)m.blows);
    }
    return 0;
}
