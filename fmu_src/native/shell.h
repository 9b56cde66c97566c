/* The shell of the native FMU: what its files have in common.
 *
 * The shell is the same for every scene. What is special to one stands in its tables
 * (model.bin); what computes are kernels, compiled elsewhere. FMI 2.0 and 3.0 are thin
 * layers on one core. Nothing is kept outside instances but the tables that equal ones share.
 */
#ifndef SHELL_H
#define SHELL_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* How a call ended; the numbers are those of FMI 2.0 and 3.0. */
typedef enum { DONE = 0, WARNED = 1, DISCARDED = 2, REFUSED = 3, NO_MEMORY = 4 } Status;

/* ---- text.c: messages ------------------------------------------------------------- */

enum { TEXT_SIZE = 4096, NUMBER_SIZE = 400 };

/* A text of bounded length; what is too much is cut off. */
typedef struct {
    size_t used;
    char text[TEXT_SIZE];
} Text;

/* Append words where `format` has %s, numbers at %r (double, as Python's repr), %d (int64),
 * %u (uint64), a percent sign at %%. */
void text_print(Text *text, const char *format, ...);
void text_print_list(Text *text, const char *format, va_list rest);
/* Append a template of the tables with its facts: {0}, {0:r}, {0:.3g}, {0:d},
 * {0:|word for 1|word for 2|}. */
void text_fill(Text *text, const char *form, const double *facts, size_t count);
/* Shortest text of a number that reads as the same number. */
void write_repr(double number, char out[NUMBER_SIZE]);
/* Copy a text; what is no UTF-8 becomes question marks. NULL where memory ends. */
char *clean_copy(const char *text);

/* ---- hash.c: SHA-256 -------------------------------------------------------------- */

enum { DIGEST = 32 };

typedef struct {
    uint32_t words[8];
    uint64_t length; /* [bytes] */
    uint8_t block[64];
} Hash;

void hash_begin(Hash *hash);
void hash_add(Hash *hash, const void *bytes, size_t count);
void hash_end(Hash *hash, uint8_t digest[DIGEST]);

/* ---- place.c: files of the FMU ---------------------------------------------------- */

typedef enum { IS_URI, IS_PATH } Location;

/* Read a file of the resources. NULL, and why in `fault`, where that cannot be. */
uint8_t *read_resource(const char *location, Location kind, const char *name, size_t *size,
                       Text *fault);

/* ---- kernels.c: what computes ----------------------------------------------------- */

enum { NOTE_WORDS = 8, NOTE_ROWS = 32, FACTS = NOTE_WORDS - 1 };

/* Notes of a kernel: how many rows there are, then the rows. A row is the number of a template
 * and its facts as doubles; the first row tells of a fault, notes stand from the second on. */
enum { NOTES_SIZE = 1 + NOTE_ROWS * NOTE_WORDS };

/* Flags of a step: inputs of the image have changed; stop at the end of the next blow; go on
 * within the same communication step, whose means and peaks go on too. */
enum { NEW_INPUTS = 1, STOP_AT_BLOW = 2, SAME_STEP = 4 };

/* Flags of a reading: outputs that are filled beside the others; or no output at all, but make
 * what moves ready to be saved. */
enum { WITH_PEAKS = 1, WITH_STRESS = 2, TO_SAVE = 4 };

/* Fault of a kernel that could not get memory. */
enum { MEMORY_FAULT = 1 };

/* Words at the beginning of a motion, which a kernel makes. The state, which is all that moves,
 * lies in one piece; its first word tells whether what was read last belongs to it. */
enum {
    MOTION_BYTES = 0,
    STATE_BEGIN = 1,
    STATE_BYTES = 2,
    SOLVER_KIND = 3,
    SHARED_BEGIN = 4,    /* from here on nothing changes any more */
    DIRECTORY_BEGIN = 5, /* rows whose first word is an offset of an array */
    DIRECTORY_ROWS = 6,
    DIRECTORY_WORDS = 7,
    SHARED = 8 /* for shared.c */
};

/* All return 0, or the number of a fault. A step gives the time that it has reached, and how many
 * blows have ended. */
typedef struct {
    int64_t (*check)(const int64_t *image, int64_t *notes);
    int64_t (*create)(const int64_t *image, int64_t **motion, int64_t *notes);
    int64_t (*step)(int64_t *motion, const int64_t *image, int64_t flags, double t, double h,
                    double *reached, int64_t *notes);
    int64_t (*read)(int64_t *motion, int64_t flags, double *outputs);
    int64_t (*fault)(const int64_t *motion, const int64_t *state, double t, int64_t *notes);
} Kernels;

/* Those for this processor. */
Kernels kernels_of_machine(void);

/* ---- memory.c of the engine: memory that kernels ask for ---------------------------- */

/* Memory of zeros; 0 where there is none left. */
int64_t native_allocate(int64_t size);
void native_free(int64_t memory);

/* ---- shared.c: tables that equal motions share -------------------------------------- */

/* Give back a motion. */
void free_motion(int64_t *motion);
/* A motion that `create` has made, but with tables that equal ones share. */
int64_t *share_motion(int64_t *made, const uint8_t digest[DIGEST]);
/* A new motion at time zero, equal to those with this hash; NULL if there are none. */
int64_t *equal_motion(const uint8_t digest[DIGEST]);

/* ---- tables.c: what is special to a scene ----------------------------------------- */

typedef enum { REAL = 1, INTEGER = 2, BOOLEAN = 4, ENUMERATION = 8 } Type;
typedef enum { INPUT = 0, OUTPUT = 1, PARAMETER = 2, INDEPENDENT = 3 } Causality;

/* How a value becomes a word of the image. */
typedef enum {
    AS_NUMBER = 0,      /* double */
    AS_NUMBER_OR_NAN,   /* double; the value that stands for "left out" becomes NaN */
    AS_WHOLE,           /* int64 */
    AS_CHOICE,          /* int64: its place among the numbers that are allowed */
    NOWHERE             /* an output */
} Conversion;

/* Records of the file as they stand there. Texts are places in `text`. */
typedef struct {
    uint32_t reference, name, type, causality;
    uint32_t conversion, place; /* in the image, or among the outputs */
    double start, lower, upper; /* bounds that are allowed themselves */
    double left_out;
    uint32_t has_left_out;
    uint32_t needs; /* flags of a reading that fills this output */
    uint32_t allowed, unit;
    uint32_t first_choice, choice_count; /* of an enumeration */
} Variable;

/* A variable of FMI 3.0, made of variables of FMI 2.0. */
typedef struct {
    uint32_t reference, name, type, causality;
    uint32_t first_member, member_count;
    uint32_t first_known, known_count; /* what an output depends on at the start */
} Entry;

/* The drive's force is a product of two numbers, and has bounds of its own; so has the pressure,
 * where the drive is a choice that takes it as it is. */
typedef struct {
    uint32_t on, pressure, area, kind; /* variables */
    uint32_t choice;                   /* 0: any other, of a force */
    uint32_t name, allowed, unit;
    double lower, upper;
} Drive;

/* A place of the hash table of references. */
typedef struct {
    uint32_t reference;
    uint32_t entry; /* EMPTY: none */
} Slot;

#define EMPTY UINT32_MAX

typedef struct {
    uint8_t *file;
    uint8_t digest[DIGEST]; /* of the file */
    const char *text;
    const char *guid;
    const Variable *variables; /* inputs, outputs, parameters */
    uint32_t variable_count, input_count, output_count;
    const int64_t *choices;
    const int64_t *image; /* first words */
    size_t image_count;
    const Drive *drives;
    size_t drive_count;
    const uint32_t *notes, *faults; /* templates: places in `text`; number 0 is unused */
    size_t note_count, fault_count;
    const Entry *entries; /* of the version of FMI that is spoken */
    size_t entry_count;
    const uint32_t *members, *known;
    Slot *slots;
    uint32_t slot_shift, slot_mask;
    void *own; /* entries and members of FMI 2.0, which are not in the file */
} Tables;

/* Take over the bytes of a file. False, and why in `fault`, if they are no good tables. */
bool open_tables(Tables *tables, uint8_t *file, size_t size, int fmi, Text *fault);
void close_tables(Tables *tables);

/* Entry of a reference, NULL if there is none. */
static inline const Entry *find_entry(const Tables *tables, uint32_t reference) {
    uint32_t at = (uint32_t)(reference * UINT32_C(2654435769)) >> tables->slot_shift;
    while (tables->slots[at].entry != EMPTY) {
        if (tables->slots[at].reference == reference) {
            return &tables->entries[tables->slots[at].entry];
        }
        at = (at + 1) & tables->slot_mask;
    }
    return NULL;
}

/* ---- instance.c: an instance, its phases and its steps ---------------------------- */

/* Where an instance is in the calling sequence; the first four as in other FMUs' states. */
typedef enum {
    INSTANTIATED = 0,
    INITIALISING = 1,
    STEPPING = 2,
    TERMINATED = 3,
    FAILED = 4,   /* a step could not be computed */
    IN_EVENT = 5, /* event mode of FMI 3.0 */
    UPDATING = 6, /* within a step: the host looks at intermediate values */
    PHASES
} Phase;

typedef struct {
    Phase phase;
    bool is_set_up; /* the start time is known */
    bool has_stop;
    double start, now, stop; /* [s] */
} Place;

typedef enum { EVENTS = 0, WARNINGS, ERRORS, CATEGORIES } Category;

typedef struct State State;
typedef struct Instance Instance;

struct Instance {
    int fmi; /* 2 or 3 */
    char *name;
    void *host; /* environment of the callbacks */
    void (*send)(Instance *one, Status status, const char *category, const char *text);
    void (*logger)(void); /* of the host; `send` knows its type */
    bool is_logged[CATEGORIES];

    Kernels kernels;
    Tables tables;
    Place place;
    double *values; /* of variables; outputs have none */
    int64_t *image;
    bool is_checked;  /* all values, before the first step */
    bool is_doubtful; /* an input may be out of bounds */
    bool has_new;     /* inputs have changed since the last step */
    int64_t *motion;  /* NULL before it is needed */
    double *given;    /* inputs with which the motion was made */
    double *outputs;
    int64_t filled; /* what the last reading gave: its flags and IS_READ; 0: nothing */
    int64_t notes[NOTES_SIZE];
    Status last_step;
    uint8_t fingerprint[DIGEST]; /* of tables and parameters */
    bool has_fingerprint;
    State *states; /* all that were made */
    State *spare;  /* those that were freed, to be used again */

    /* FMI 3.0 */
    bool has_events, returns_early;
    bool is_step_mode_told; /* that discrete inputs belong to event mode */
    void (*update)(void); /* callback of intermediate values, or NULL */
};

enum { IS_READ = 1 << 30 };

/* An empty instance, which can log. */
Instance *new_instance(int fmi, const char *name);
/* Make it ready. Refuses another FMU's guid, and tables that cannot be read. */
Status open_instance(Instance *one, const char *guid, const char *location, Location kind);
void free_instance(Instance *one);

Status refuse(Instance *one, const char *format, ...); /* log an error: as text_print */
void warn(Instance *one, const char *format, ...);
Status out_of_memory(Instance *one);
/* Log these categories only, or no longer; all where none is named. */
Status choose_logging(Instance *one, bool on, size_t count, const char *const categories[]);
/* Refuse a call that is not allowed now. */
bool is_phase(Instance *one, const char *call, Phase phase);

Status set_up(Instance *one, double start, bool has_stop, double stop);
Status enter_initialisation(Instance *one);
Status exit_initialisation(Instance *one);
Status terminate(Instance *one, const char *call);
Status reset(Instance *one);
/* Log the fault of a kernel. */
Status refuse_fault(Instance *one, int64_t number);
/* Make a motion of inputs and parameters; NULL, and a message, if they make no sense. */
Status make_motion(Instance *one, const double *values, const int64_t *image, int64_t **motion);
/* Have a motion of the present values. */
Status need_motion(Instance *one);
/* Refuse a step that cannot be; checks new inputs. */
Status check_step(Instance *one, const char *call, double from, double size);
/* How far a step has come. */
typedef struct {
    double time; /* of the host [s] */
    bool is_blow; /* a blow has ended */
} Reached;

/* Advance the motion to a time of the host, or to the end of a blow before it; `size` is that
 * of the communication step. */
Status advance(Instance *one, double to, double size, int64_t flags, Reached *reached);
Status do_step(Instance *one, const char *call, double from, double size);

/* ---- values.c: variables ---------------------------------------------------------- */

/* In what a host keeps values. */
typedef enum { DOUBLES, INTS, LONGS, BOOLS, NO_FORM } Form;

/* One getter or setter of FMI: what variables it takes, its word for them. */
typedef struct {
    uint32_t types;
    Form form;
    const char *word;
} Access;

Status get_values(Instance *one, const Access *access, const uint32_t *references,
                  size_t count, void *values, size_t value_count);
Status set_values(Instance *one, const Access *access, const uint32_t *references,
                  size_t count, const void *values, size_t value_count);
/* Check values within bounds: those of variables from `first` on. */
Status check_values(Instance *one, const double *values, uint32_t first, uint32_t count);
Status check_drive(Instance *one, const double *values);
void write_word(const Tables *tables, const Variable *one, double value, int64_t *image);
void write_image(const Tables *tables, const double *values, int64_t *image);
bool is_value(const Variable *one, double value); /* of its type, in bounds or not */
const char *type_word(uint32_t type);

/* ---- state.c: saved states -------------------------------------------------------- */

Status get_state(Instance *one, void **state);
Status set_state(Instance *one, void *state);
Status free_state(Instance *one, void **state);
Status state_size(Instance *one, void *state, size_t *size);
Status state_to_bytes(Instance *one, void *state, uint8_t *bytes, size_t size);
Status state_from_bytes(Instance *one, const uint8_t *bytes, size_t size, void **state);
void free_states(Instance *one);

#endif
