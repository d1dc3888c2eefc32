/* What the functions of the shared object are marked with, where they are defined;
 * library.h declares them without. */
#if defined _WIN32
#pragma clang diagnostic ignored "-Wdll-attribute-on-redeclaration"
#define MU_EXPORT __declspec(dllexport)
#else
#define MU_EXPORT __attribute__((visibility("default")))
#endif
