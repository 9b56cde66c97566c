/* What the files of FMI 3.0 have in common. */
#ifndef FMI3_SHELL_H
#define FMI3_SHELL_H

#include "shell.h"

#include "fmi3Functions.h"

/* A status of the core is one of FMI. */
fmi3Status as3(Status status);

#endif
