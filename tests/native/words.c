/* Writes numbers and templates as the shell does: words form bits... */
#include "shell.h"

#include <inttypes.h>
#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Lines of the input: a form, a tabulator, the bits of a number. */
int main(int count, char **words) {
    char line[512];
    if (count > 1 && setlocale(LC_ALL, words[1]) == NULL) {
        return 77;
    }
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *tab = strchr(line, '\t');
        uint64_t bits = strtoull(tab + 1, NULL, 16);
        double fact;
        Text text = {.used = 0};
        memcpy(&fact, &bits, sizeof fact);
        *tab = 0;
        text_fill(&text, line, &fact, 1);
        puts(text.text);
    }
    return 0;
}
