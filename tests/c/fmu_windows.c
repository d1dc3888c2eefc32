/* Loads an FMI 3.0 unit's DLL under Windows; prints its version and mu_macro of its start values and at v0 = 1 m/s. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <windows.h>

typedef void *(*Instantiate)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t,
                             void *, void *, void *);
typedef int (*Initialize)(void *, bool, double, double, bool, double);
typedef int (*Get)(void *, const uint32_t *, size_t, double *, size_t);
typedef int (*Set)(void *, const uint32_t *, size_t, const double *, size_t);

int main(int count, char **words) {
    HMODULE unit = LoadLibraryA(words[1]);
    const uint32_t v0 = 6, mu_macro = 8;
    const double fast = 1.0;
    double first, second;
    void *m;
    if (count != 3 || unit == NULL) return 1;
#define OF(type, name) ((type)(void *)GetProcAddress(unit, name))
    m = OF(Instantiate, "fmi3InstantiateCoSimulation")("unit", words[2], "", false, false, false, false, NULL, 0, NULL,
                                                       NULL, NULL);
    if (m == NULL || OF(Initialize, "fmi3EnterInitializationMode")(m, false, 0.0, 0.0, false, 0.0)) return 2;
    if (OF(Get, "fmi3GetFloat64")(m, &mu_macro, 1, &first, 1)) return 3;
    if (OF(Set, "fmi3SetFloat64")(m, &v0, 1, &fast, 1)) return 4;
    if (OF(Get, "fmi3GetFloat64")(m, &mu_macro, 1, &second, 1)) return 5;
    printf("%s %.17g %.17g\n", OF(const char *(*)(void), "fmi3GetVersion")(), first, second);
    return 0;
}
