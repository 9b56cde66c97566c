/* The tables of a scene: what the file model.bin holds, checked before it is used.
 *
 * Layout (little endian): magic, version, length, SHA-256 of all else, then for each section
 * where it begins and how many records it has. `tables.py` writes it.
 */
#include "shell.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char MAGIC[8] = "PHTABLE";
enum { FILE_VERSION = 3 };

enum {
    TEXT, HEAD, VARIABLES, CHOICES, IMAGE, DRIVE, NOTES, FAULTS, ENTRIES, MEMBERS, KNOWN,
    SECTIONS
};

typedef struct {
    uint64_t begin, count;
} Section;

typedef struct {
    char magic[8];
    uint32_t version, sections;
    uint64_t length;
    uint8_t digest[DIGEST];
    Section section[SECTIONS];
} Head;

/* Numbers of the section HEAD. */
enum { GUID, INPUTS, OUTPUTS, PLAIN_WORDS, HEAD_COUNT };

/* Of the image: counts before those of rods, numbers of a section and of a joint. The other words
 * are PLAIN_WORDS. */
enum { COUNTS = 3, SECTION_WORDS = 4, JOINT_WORDS = 6 };

static const size_t SIZES[SECTIONS] = {
    [TEXT] = 1, [HEAD] = sizeof(uint32_t), [VARIABLES] = sizeof(Variable),
    [CHOICES] = sizeof(int64_t), [IMAGE] = sizeof(int64_t), [DRIVE] = sizeof(Drive),
    [NOTES] = sizeof(uint32_t), [FAULTS] = sizeof(uint32_t), [ENTRIES] = sizeof(Entry),
    [MEMBERS] = sizeof(uint32_t), [KNOWN] = sizeof(uint32_t),
};

_Static_assert(sizeof(Head) == 56 + 16 * SECTIONS, "the head has no gaps");
_Static_assert(sizeof(Variable) == 80 && sizeof(Entry) == 32 && sizeof(Drive) == 48,
               "records have no gaps");

static bool is_head_good(const Head *head, const uint8_t *file, size_t size, Text *fault) {
    Hash hash;
    uint8_t digest[DIGEST];
    if (size < sizeof *head || memcmp(head->magic, MAGIC, sizeof MAGIC) != 0) {
        text_print(fault, "model.bin is no table of this family of FMUs");
    } else if (head->version != FILE_VERSION || head->sections != SECTIONS) {
        text_print(fault, "model.bin has version %u, this library reads %u",
                   (uint64_t)head->version, (uint64_t)FILE_VERSION);
    } else if (head->length != size) {
        text_print(fault, "model.bin has %u bytes where %u belong", (uint64_t)size,
                   (uint64_t)head->length);
    } else {
        hash_begin(&hash);
        hash_add(&hash, file, offsetof(Head, digest));
        hash_add(&hash, file + offsetof(Head, section), size - offsetof(Head, section));
        hash_end(&hash, digest);
        if (memcmp(digest, head->digest, DIGEST) == 0) {
            return true;
        }
        text_print(fault, "model.bin was changed: its hash does not fit");
    }
    return false;
}

/* Whether every section lies within the file. */
static bool are_sections_good(const Head *head, size_t size) {
    for (int k = 0; k < SECTIONS; k++) {
        const Section *one = &head->section[k];
        if (one->begin % 8 != 0 || one->begin > size || one->begin < sizeof *head ||
            one->count > (size - one->begin) / SIZES[k] || one->count >= EMPTY) {
            return false;
        }
    }
    return size % 8 == 0 && head->section[HEAD].count == HEAD_COUNT; /* with the last one's fill */
}

static const void *begin_of(const Tables *tables, const Head *head, int which) {
    return tables->file + head->section[which].begin;
}

static void take_sections(Tables *tables, const Head *head) {
    const Section *section = head->section;
    const uint32_t *numbers = begin_of(tables, head, HEAD);
    memcpy(tables->digest, head->digest, DIGEST);
    tables->text = begin_of(tables, head, TEXT);
    tables->input_count = numbers[INPUTS];
    tables->output_count = numbers[OUTPUTS];
    tables->variables = begin_of(tables, head, VARIABLES);
    tables->variable_count = (uint32_t)section[VARIABLES].count;
    tables->choices = begin_of(tables, head, CHOICES);
    tables->image = begin_of(tables, head, IMAGE);
    tables->image_count = (size_t)section[IMAGE].count;
    tables->drives = begin_of(tables, head, DRIVE);
    tables->drive_count = (size_t)section[DRIVE].count;
    tables->notes = begin_of(tables, head, NOTES);
    tables->note_count = (size_t)section[NOTES].count;
    tables->faults = begin_of(tables, head, FAULTS);
    tables->fault_count = (size_t)section[FAULTS].count;
}

/* Whether a place in the text is one; the text ends with a zero. */
static bool is_text(const Head *head, uint32_t place) { return place < head->section[TEXT].count; }

static bool are_texts(const Head *head, const uint32_t *places, size_t count) {
    bool is_good = true;
    for (size_t k = 0; k < count; k++) {
        is_good &= is_text(head, places[k]);
    }
    return is_good;
}

static bool is_range(uint32_t first, uint32_t count, uint64_t all) {
    return first <= all && count <= all - first;
}

static bool is_type(uint32_t type) {
    return type == REAL || type == INTEGER || type == BOOLEAN || type == ENUMERATION;
}

/* Whether the counts at the beginning of the image are those of its words. */
static bool is_image_good(const Tables *tables, uint64_t plain_words) {
    const int64_t *counts = tables->image;
    uint64_t words = tables->image_count, sections = 0;
    if (words < COUNTS || counts[2] < 0 || (uint64_t)counts[2] > words - COUNTS) {
        return false;
    }
    uint64_t rods = (uint64_t)counts[2];
    for (uint64_t k = 0; k < COUNTS + rods; k++) {
        if (counts[k] < 0 || (uint64_t)counts[k] > words) {
            return false;
        }
        sections += k == 2 ? 0 : (uint64_t)counts[k]; /* of bars */
    }
    return words == COUNTS + rods + plain_words + SECTION_WORDS * sections + JOINT_WORDS * rods;
}

static bool is_variable_good(const Tables *tables, const Head *head, uint32_t k) {
    const Variable *one = &tables->variables[k];
    uint32_t inputs = tables->input_count, computed = inputs + tables->output_count;
    uint32_t causality = k < inputs ? INPUT : k < computed ? OUTPUT : PARAMETER;
    bool is_output = causality == OUTPUT;
    size_t room = is_output ? tables->output_count : tables->image_count;
    uint64_t least = is_output ? 0 : COUNTS + (uint64_t)tables->image[2];
    return one->causality == causality && is_type(one->type) && is_text(head, one->name) &&
           is_text(head, one->allowed) && is_text(head, one->unit) && one->place < room &&
           one->place >= least &&
           (is_output ? one->conversion == NOWHERE : one->conversion < NOWHERE) &&
           (one->conversion != AS_CHOICE || one->type == ENUMERATION) &&
           (one->conversion != AS_WHOLE || one->type != REAL) &&
           is_range(one->first_choice, one->choice_count, head->section[CHOICES].count) &&
           (is_output || is_value(one, one->start));
}

static bool are_variables_good(const Tables *tables, const Head *head) {
    uint64_t count = tables->variable_count;
    bool is_good = (uint64_t)tables->input_count + tables->output_count <= count;
    for (uint32_t k = 0; is_good && k < count; k++) {
        is_good = is_variable_good(tables, head, k);
    }
    for (size_t k = 0; is_good && k < tables->drive_count; k++) {
        const Drive *drive = tables->drives + k;
        is_good = drive->on < count && drive->pressure < count && drive->area < count &&
                  drive->kind < count && are_texts(head, &drive->name, 3);
    }
    return is_good;
}

static bool are_entries_good(const Tables *tables, const Head *head) {
    for (size_t k = 0; k < tables->entry_count; k++) {
        const Entry *one = &tables->entries[k];
        if (!is_type(one->type) || one->causality > INDEPENDENT || !is_text(head, one->name) ||
            !is_range(one->first_member, one->member_count, head->section[MEMBERS].count) ||
            !is_range(one->first_known, one->known_count, head->section[KNOWN].count) ||
            (one->member_count == 0) != (one->causality == INDEPENDENT)) {
            return false;
        }
        for (uint32_t m = 0; m < one->member_count; m++) {
            uint32_t member = tables->members[one->first_member + m];
            if (member >= tables->variable_count ||
                tables->variables[member].type != one->type ||
                tables->variables[member].causality != one->causality) {
                return false;
            }
        }
    }
    for (size_t k = 0; k < head->section[KNOWN].count; k++) {
        if (tables->known[k] >= tables->entry_count) {
            return false;
        }
    }
    return true;
}

/* In FMI 2.0 every variable is an entry of its own. */
static bool make_entries(Tables *tables) {
    size_t count = tables->variable_count;
    Entry *entries = calloc(count + 1, sizeof *entries + sizeof(uint32_t));
    if (entries == NULL) {
        return false;
    }
    uint32_t *members = (uint32_t *)(entries + count + 1);
    for (uint32_t k = 0; k < count; k++) {
        const Variable *one = &tables->variables[k];
        members[k] = k;
        entries[k] = (Entry){.reference = one->reference, .name = one->name, .type = one->type,
                             .causality = one->causality, .first_member = k, .member_count = 1};
    }
    tables->own = entries;
    tables->entries = entries;
    tables->members = members;
    tables->entry_count = count;
    return true;
}

/* Hash table of references. False where memory ends, or where two are the same. */
static bool make_slots(Tables *tables, bool *are_unique) {
    uint32_t bits = 4;
    while ((UINT64_C(1) << bits) < 4 * (uint64_t)tables->entry_count) {
        bits++;
    }
    tables->slot_shift = 32 - bits;
    tables->slot_mask = (UINT32_C(1) << bits) - 1;
    tables->slots = malloc(((size_t)tables->slot_mask + 1) * sizeof *tables->slots);
    *are_unique = true;
    if (tables->slots == NULL) {
        return false;
    }
    memset(tables->slots, 0xff, ((size_t)tables->slot_mask + 1) * sizeof *tables->slots);
    for (uint32_t k = 0; k < tables->entry_count; k++) {
        uint32_t reference = tables->entries[k].reference;
        uint32_t at = (uint32_t)(reference * UINT32_C(2654435769)) >> tables->slot_shift;
        for (; tables->slots[at].entry != EMPTY; at = (at + 1) & tables->slot_mask) {
            if (tables->slots[at].reference == reference) {
                *are_unique = false;
                return false;
            }
        }
        tables->slots[at] = (Slot){reference, k};
    }
    return true;
}

static bool index_entries(Tables *tables, const Head *head, int fmi, Text *fault) {
    bool are_unique = true;
    tables->entries = begin_of(tables, head, ENTRIES);
    tables->entry_count = (size_t)head->section[ENTRIES].count;
    tables->members = begin_of(tables, head, MEMBERS);
    tables->known = begin_of(tables, head, KNOWN);
    if (tables->entry_count > UINT32_C(1) << 26 || tables->variable_count > UINT32_C(1) << 26 ||
        !are_entries_good(tables, head)) {
        text_print(fault, "model.bin makes no sense: its entries");
        return false;
    }
    if ((fmi == 2 && !make_entries(tables)) || !make_slots(tables, &are_unique)) {
        text_print(fault, are_unique ? "memory is exhausted"
                                     : "model.bin makes no sense: two references are the same");
        return false;
    }
    return true;
}

bool open_tables(Tables *tables, uint8_t *file, size_t size, int fmi, Text *fault) {
    static const uint16_t little = 1;
    Head head = {0};
    tables->file = file;
    memcpy(&head, file, size < sizeof head ? size : sizeof head);
    if (*(const uint8_t *)&little != 1) {
        text_print(fault, "this library is for processors with little endian numbers");
        return false;
    }
    if (!is_head_good(&head, file, size, fault)) {
        return false;
    }
    if (!are_sections_good(&head, size)) {
        text_print(fault, "model.bin makes no sense: its sections");
        return false;
    }
    take_sections(tables, &head);
    const uint32_t *numbers = begin_of(tables, &head, HEAD);
    uint64_t length = head.section[TEXT].count;
    if (length == 0 || tables->text[length - 1] != 0 || !is_text(&head, numbers[GUID]) ||
        !are_texts(&head, tables->notes, tables->note_count) ||
        !are_texts(&head, tables->faults, tables->fault_count)) {
        text_print(fault, "model.bin makes no sense: its texts");
        return false;
    }
    tables->guid = tables->text + numbers[GUID];
    if (!is_image_good(tables, numbers[PLAIN_WORDS])) {
        text_print(fault, "model.bin makes no sense: its image");
        return false;
    }
    if (!are_variables_good(tables, &head)) {
        text_print(fault, "model.bin makes no sense: its variables");
        return false;
    }
    return index_entries(tables, &head, fmi, fault);
}

void close_tables(Tables *tables) {
    free(tables->file);
    free(tables->slots);
    free(tables->own);
    memset(tables, 0, sizeof *tables);
}
