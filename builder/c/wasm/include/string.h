/* What the kernel needs of <string.h>; -mbulk-memory makes it an instruction. */
#include <stddef.h>
#define memcpy __builtin_memcpy
