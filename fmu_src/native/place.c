/* Where the resources of the FMU lie, and reading of them.
 *
 * FMI 2.0 gives a URI: file:/x, file:///x, file://localhost/x, with percent escapes; hosts
 * also give plain paths, and URIs that are not escaped. FMI 3.0 gives a plain path.
 */
#include "shell.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <wchar.h>
#endif

/* More than any tables, and less than what could bring a machine down [bytes]. */
enum { LARGEST = 1 << 30 };

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c - 'A' + 'a') : c; }

static bool begins(const char *text, const char *with) {
    for (; *with != 0; text++, with++) {
        if (lower(*text) != *with) {
            return false;
        }
    }
    return true;
}

static bool is_drive(const char *path) {
    char c = lower(path[0]);
    return c >= 'a' && c <= 'z' && path[1] == ':';
}

static int hex(char c) {
    c = lower(c);
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Replace escapes by what they stand for; what is none is left as it is. */
static void decode(char *text) {
    char *to = text;
    for (; *text != 0; text++) {
        if (*text == '%' && hex(text[1]) >= 0 && hex(text[2]) >= 0) {
            int code = 16 * hex(text[1]) + hex(text[2]);
            if (code != 0) { /* which would cut the path */
                *to++ = (char)code;
                text += 2;
                continue;
            }
        }
        *to++ = *text;
    }
    *to = 0;
}

/* The path within a file: URI, still escaped. */
static const char *path_of_uri(const char *uri) {
    const char *path = uri + 5;
    if (path[0] == '/' && path[1] == '/') {
        if (begins(path + 2, "localhost/")) {
            path += 11;
        } else if (path[2] == '/' || is_drive(path + 2)) { /* the latter is wrong, but is met */
            path += 2;
        } /* else another machine, as Windows writes it */
    }
    return path[0] == '/' && is_drive(path + 1) ? path + 1 : path;
}

static FILE *open_file(const char *path) {
#ifdef _WIN32
    /* UTF-8 to UTF-16; what is no UTF-8 is tried as it is */
    size_t length = strlen(path);
    wchar_t *wide = malloc((length + 1) * sizeof *wide);
    FILE *file = NULL;
    if (wide != NULL) {
        size_t used = 0;
        const unsigned char *c = (const unsigned char *)path;
        while (*c != 0) {
            uint32_t code = *c++;
            int more = code >= 0xf0 ? 3 : code >= 0xe0 ? 2 : code >= 0xc0 ? 1 : 0;
            code &= more == 3 ? 0x07u : more == 2 ? 0x0fu : more == 1 ? 0x1fu : 0x7fu;
            for (; more > 0 && (*c & 0xc0u) == 0x80; more--) {
                code = code << 6 | (*c++ & 0x3fu);
            }
            if (code >= 0x10000) {
                wide[used++] = (wchar_t)(0xd800u + ((code - 0x10000) >> 10));
                code = 0xdc00u + ((code - 0x10000) & 0x3ffu);
            }
            wide[used++] = (wchar_t)code;
        }
        wide[used] = 0;
        file = _wfopen(wide, L"rb");
        free(wide);
    }
    return file != NULL ? file : fopen(path, "rb");
#else
    return fopen(path, "rb");
#endif
}

/* Open a file of a folder; a host that escapes nothing may mean its percent signs. */
static FILE *open_in(const char *folder, bool is_escaped, const char *name) {
    size_t length = strlen(folder);
    char *path = malloc(length + strlen(name) + 2);
    FILE *file = NULL;
    for (int k = is_escaped ? 0 : 1; path != NULL && file == NULL && k < 2; k++) {
        strcpy(path, folder);
        if (k == 0) {
            decode(path);
        }
        size_t used = strlen(path);
        if (used > 0 && path[used - 1] != '/' && path[used - 1] != '\\') {
            path[used++] = '/';
        }
        strcpy(path + used, name);
        file = open_file(path);
    }
    free(path);
    return file;
}

static uint8_t *read_all(FILE *file, size_t *size) {
    size_t room = 1 << 16, used = 0;
    uint8_t *bytes = malloc(room);
    while (bytes != NULL && room <= LARGEST) {
        used += fread(bytes + used, 1, room - used, file);
        if (used < room) {
            break;
        }
        room *= 2;
        uint8_t *more = realloc(bytes, room);
        if (more == NULL) {
            free(bytes);
        }
        bytes = more;
    }
    if (bytes != NULL && (ferror(file) || used == room)) {
        free(bytes);
        bytes = NULL;
    }
    *size = used;
    return bytes;
}

uint8_t *read_resource(const char *location, Location kind, const char *name, size_t *size,
                       Text *fault) {
    bool is_uri = begins(location, "file:");
    const char *folder = is_uri ? path_of_uri(location) : location;
    FILE *file = open_in(folder, is_uri, name);
    if (file == NULL && is_uri && kind == IS_PATH) { /* a folder that is called so */
        file = open_in(location, false, name);
    }
    if (file == NULL) {
        text_print(fault, "the resources of the FMU cannot be read: there is no %s in %s", name,
                   location);
        return NULL;
    }
    uint8_t *bytes = read_all(file, size);
    fclose(file);
    if (bytes == NULL) {
        text_print(fault, "the resources of the FMU cannot be read: %s in %s", name, location);
    }
    return bytes;
}
