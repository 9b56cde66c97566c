/* Messages: templates, numbers as Python writes them, and only good UTF-8.
 *
 * Numbers are put together from digits: a host may have set a locale with a decimal comma.
 */
#include "shell.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Digits that tell every double from all others, and as many as a message ever asks for. */
enum { MOST_DIGITS = 17, MOST_ASKED = 40 };

/* Bytes of the character at the beginning of a text; 0 if it is none of UTF-8. */
static size_t character(const char *text) {
    const unsigned char *c = (const unsigned char *)text;
    uint32_t code;
    size_t more;
    if (c[0] < 0x80) {
        return 1;
    }
    if (c[0] >= 0xc2 && c[0] < 0xe0) {
        more = 1, code = c[0] & 0x1fu;
    } else if (c[0] >= 0xe0 && c[0] < 0xf0) {
        more = 2, code = c[0] & 0x0fu;
    } else if (c[0] >= 0xf0 && c[0] < 0xf5) {
        more = 3, code = c[0] & 0x07u;
    } else {
        return 0;
    }
    for (size_t i = 1; i <= more; i++) { /* a text that ends here has a zero */
        if ((c[i] & 0xc0u) != 0x80) {
            return 0;
        }
        code = code << 6 | (c[i] & 0x3fu);
    }
    if ((more == 2 && code < 0x800) || (more == 3 && (code < 0x10000 || code > 0x10ffff)) ||
        (code >= 0xd800 && code < 0xe000)) {
        return 0;
    }
    return more + 1;
}

char *clean_copy(const char *text) {
    char *copy = malloc(strlen(text) + 1), *to = copy;
    while (copy != NULL && *text != 0) {
        size_t size = character(text);
        if (size == 0) {
            *to++ = '?';
            text++;
        } else {
            memcpy(to, text, size);
            to += size;
            text += size;
        }
    }
    if (copy != NULL) {
        *to = 0;
    }
    return copy;
}

/* Append at most `count` bytes, whole characters only, and question marks for none. */
static void add(Text *text, const char *words, size_t count) {
    while (count > 0 && *words != 0) {
        size_t size = character(words);
        bool is_good = size > 0 && size <= count;
        size = is_good ? size : 1;
        if (text->used + size >= TEXT_SIZE) {
            break;
        }
        if (is_good) {
            memcpy(text->text + text->used, words, size);
        } else {
            text->text[text->used] = '?';
        }
        text->used += size;
        words += size;
        count -= size;
    }
    text->text[text->used] = 0;
}

/* A number as decimal digits: 0.d1 d2 d3... * 10^point. */
typedef struct {
    bool is_negative;
    char digits[MOST_ASKED + 2];
    int count, point;
} Decimal;

/* Read what snprintf has written with %e, whatever the decimal sign of the locale is. */
static Decimal decimal_of(const char *text, bool is_negative) {
    Decimal found = {.is_negative = is_negative, .count = 0};
    for (; *text != 0 && *text != 'e'; text++) {
        if (*text >= '0' && *text <= '9' && found.count < MOST_ASKED) {
            found.digits[found.count++] = *text;
        }
    }
    found.point = *text == 'e' ? atoi(text + 1) + 1 : 1;
    return found;
}

/* Round a finite number to some digits. */
static Decimal decimal(double number, int count) {
    char text[NUMBER_SIZE];
    snprintf(text, sizeof text, "%.*e", count - 1, fabs(number));
    return decimal_of(text, signbit(number) != 0);
}

/* Raise the last digit of such a text by one; false where that carries. */
static bool raise_last(char *text) {
    char *last = text + strcspn(text, "e") - 1;
    if (*last == '9') {
        return false;
    }
    (*last)++;
    return true;
}

/* Fewest digits that read as the same number. Above a power of two lies more room than below:
 * there the nearest digits may fail, and the next ones above not. */
static Decimal shortest(double number) {
    char text[NUMBER_SIZE];
    double size = fabs(number);
    for (int count = 1; count < MOST_DIGITS; count++) {
        snprintf(text, sizeof text, "%.*e", count - 1, size);
        if (strtod(text, NULL) == size || (raise_last(text) && strtod(text, NULL) == size)) {
            return decimal_of(text, signbit(number) != 0);
        }
    }
    return decimal(number, MOST_DIGITS);
}

static void strip_zeros(Decimal *one) {
    while (one->count > 1 && one->digits[one->count - 1] == '0') {
        one->count--;
    }
}

/* Write digits, with an exponent where it is below -4 or not below `limit`. */
static void write_decimal(const Decimal *one, int limit, bool has_point, char *out) {
    int exponent = one->point - 1, whole = 1;
    bool is_short = exponent >= -4 && exponent < limit;
    if (one->is_negative) {
        *out++ = '-';
    }
    if (is_short && exponent < 0) {
        *out++ = '0', *out++ = '.';
        for (int i = exponent + 1; i < 0; i++) {
            *out++ = '0';
        }
        memcpy(out, one->digits, (size_t)one->count);
        out[one->count] = 0;
        return;
    }
    if (is_short) {
        whole = exponent + 1;
    }
    for (int i = 0; i < whole || i < one->count; i++) {
        if (i == whole) {
            *out++ = '.';
        }
        *out++ = i < one->count ? one->digits[i] : '0';
    }
    if (is_short && has_point && one->count <= whole) {
        *out++ = '.', *out++ = '0';
    }
    *out = 0;
    if (!is_short) {
        snprintf(out, 16, "e%c%02d", exponent < 0 ? '-' : '+', abs(exponent));
    }
}

static bool write_odd(double number, char *out) {
    if (isfinite(number)) {
        return false;
    }
    strcpy(out, isnan(number) ? "nan" : number > 0.0 ? "inf" : "-inf");
    return true;
}

void write_repr(double number, char out[NUMBER_SIZE]) {
    if (write_odd(number, out)) {
        return;
    }
    Decimal digits = shortest(number);
    strip_zeros(&digits);
    write_decimal(&digits, 16, true, out);
}

static void write_general(double number, int count, char *out) {
    if (!write_odd(number, out)) {
        Decimal digits = decimal(number, count > 0 ? count : 1);
        strip_zeros(&digits);
        write_decimal(&digits, count > 0 ? count : 1, false, out);
    }
}

/* Digits after the point; for numbers that a reader takes in at a glance. */
static void write_fixed(double number, int count, char *out) {
    if (write_odd(number, out)) {
        return;
    }
    int length = snprintf(out, NUMBER_SIZE, "%.*f", count, number);
    if (count > 0 && length > count && length < NUMBER_SIZE) {
        /* the sign of the locale may have several bytes */
        char *tail = out + length - count, *sign = out;
        while (*sign == '-' || (*sign >= '0' && *sign <= '9')) {
            sign++;
        }
        *sign++ = '.';
        memmove(sign, tail, (size_t)count + 1);
    }
}

void text_print(Text *text, const char *format, ...) {
    va_list rest;
    va_start(rest, format);
    text_print_list(text, format, rest);
    va_end(rest);
}

void text_print_list(Text *text, const char *format, va_list rest) {
    char number[NUMBER_SIZE];
    for (const char *at = format; *at != 0; at++) {
        if (*at != '%') {
            size_t plain = strcspn(at, "%");
            add(text, at, plain);
            at += plain - 1;
            continue;
        }
        switch (*++at) {
        case 's': {
            const char *words = va_arg(rest, const char *);
            add(text, words, strlen(words));
            continue;
        }
        case 'r':
            write_repr(va_arg(rest, double), number);
            break;
        case 'd':
            snprintf(number, sizeof number, "%lld", (long long)va_arg(rest, int64_t));
            break;
        case 'u':
            snprintf(number, sizeof number, "%llu", (unsigned long long)va_arg(rest, uint64_t));
            break;
        default:
            strcpy(number, "%");
        }
        add(text, number, sizeof number);
    }
}

/* Word number `which`, from 1 on, of a list |one|two|three|}. */
static void add_choice(Text *text, const char *list, double which) {
    const char *at = list;
    for (int k = 1; *at == '|'; k++) {
        size_t length = strcspn(at + 1, "|}");
        if (k == which) {
            add(text, at + 1, length);
        }
        at += 1 + length;
    }
}

/* Write a number by what stands after the colon of a placeholder. */
static void write_as(double number, const char *form, char *out) {
    int digits = -1;
    if (*form == '.') {
        digits = 0;
        for (form++; *form >= '0' && *form <= '9'; form++) {
            digits = digits < MOST_ASKED ? 10 * digits + (*form - '0') : digits;
        }
        digits = digits < MOST_ASKED ? digits : MOST_ASKED;
    }
    if (*form == 'g') {
        write_general(number, digits < 0 ? 6 : digits, out);
    } else if (*form == 'f' || *form == 'd') {
        write_fixed(number, *form == 'd' ? 0 : digits < 0 ? 6 : digits, out);
    } else {
        write_repr(number, out);
    }
}

void text_fill(Text *text, const char *form, const double *facts, size_t count) {
    char number[NUMBER_SIZE];
    while (*form != 0) {
        size_t plain = strcspn(form, "{}");
        add(text, form, plain);
        form += plain;
        if (*form == 0) {
            return;
        }
        if (form[1] == *form || *form == '}') { /* doubled: the sign itself */
            add(text, form, 1);
            form += form[1] == *form ? 2 : 1;
            continue;
        }
        size_t which = 0;
        for (form++; *form >= '0' && *form <= '9'; form++) {
            which = which < count ? 10 * which + (size_t)(*form - '0') : which;
        }
        double fact = which < count ? facts[which] : 0.0;
        if (*form == ':') {
            form++;
        }
        if (*form == '|') {
            add_choice(text, form, fact);
        } else {
            write_as(fact, form, number);
            add(text, number, sizeof number);
        }
        form += strcspn(form, "}");
        form += *form == '}';
    }
}
