/* The functions of mumacro.h as a library, for everything that loads one: see README.md. */
#ifdef _WIN32
#define MUMACRO_API __declspec(dllexport)
#else
#define MUMACRO_API
#endif
#include "mumacro.h"
