/* What mumacro.h needs of <string.h>. */
#include <stddef.h>
#define memcpy __builtin_memcpy
