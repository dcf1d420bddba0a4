/* An importer of an FMU of the virtual rig, FMI 2.0, without Python: two instances side by side, states kept, restored,
   serialized and freed on the way. It prints the bits of the last force.
   Arguments: library, resources as a URI, guid, references of valve command and force, period in s. */
#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void (*logger_t)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    logger_t logger;
    void *allocate, *release, *finished, *environment;
} callbacks_t;

static int messages;

static void log_message(void *environment, const char *name, int status, const char *category, const char *text, ...) {
    (void)environment, (void)name, (void)status, (void)category, (void)text;
    messages++;
}

#define LOAD(name, result, ...) \
    result (*name)(__VA_ARGS__) = (result(*)(__VA_ARGS__))dlsym(library, #name); \
    if (!name) return fprintf(stderr, "no %s\n", #name), 1
#define CHECK(call) \
    if ((call) != 0) return fprintf(stderr, "%s\n", #call), 1

int main(int count, char **argument) {
    if (count != 7) return 2;
    void *library = dlopen(argument[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    LOAD(fmi2Instantiate, void *, const char *, int, const char *, const char *, const callbacks_t *, int, int);
    LOAD(fmi2SetupExperiment, int, void *, int, double, double, int, double);
    LOAD(fmi2EnterInitializationMode, int, void *);
    LOAD(fmi2ExitInitializationMode, int, void *);
    LOAD(fmi2SetReal, int, void *, const unsigned *, size_t, const double *);
    LOAD(fmi2GetReal, int, void *, const unsigned *, size_t, double *);
    LOAD(fmi2DoStep, int, void *, double, double, int);
    LOAD(fmi2GetFMUstate, int, void *, void **);
    LOAD(fmi2SetFMUstate, int, void *, void *);
    LOAD(fmi2FreeFMUstate, int, void *, void **);
    LOAD(fmi2SerializedFMUstateSize, int, void *, void *, size_t *);
    LOAD(fmi2SerializeFMUstate, int, void *, void *, char *, size_t);
    LOAD(fmi2DeSerializeFMUstate, int, void *, const char *, size_t, void **);
    LOAD(fmi2FreeInstance, void, void *);
    unsigned valve = (unsigned)atoi(argument[4]), force = (unsigned)atoi(argument[5]);
    double period = atof(argument[6]), value = NAN;
    callbacks_t callbacks = {log_message, NULL, NULL, NULL, NULL};
    void *instance[2], *state[2] = {NULL, NULL};
    if (fmi2Instantiate("rig", 1, "another", argument[2], &callbacks, 0, 0) || messages != 1)
        return fprintf(stderr, "a wrong guid was taken\n"), 1;
    for (int i = 0; i < 2; i++) {
        instance[i] = fmi2Instantiate("rig", 1, argument[3], argument[2], &callbacks, 0, 0);
        if (!instance[i]) return fprintf(stderr, "no instance\n"), 1;
        CHECK(fmi2SetupExperiment(instance[i], 0, 0.0, 0.0, 0, 0.0));
        CHECK(fmi2EnterInitializationMode(instance[i]));
        CHECK(fmi2ExitInitializationMode(instance[i]));
    }
    if (fmi2SetReal(instance[0], &force, 1, &value) != 3 || fmi2SetReal(NULL, &valve, 1, &value) != 3 ||
        fmi2SetReal(instance[0], NULL, 1, &value) != 3)
        return fprintf(stderr, "a wrong value was taken\n"), 1;
    for (int tick = 0; tick < 100; tick++) {
        value = 0.01 * (tick % 17);
        for (int i = 0; i < 2; i++) {
            CHECK(fmi2SetReal(instance[i], &valve, 1, &value));
            CHECK(fmi2DoStep(instance[i], tick * period, period, 1));
        }
        CHECK(fmi2GetFMUstate(instance[0], &state[0]));
        if (tick % 10 == 0) {
            /* The first one's state by way of bytes into the second. */
            size_t size;
            CHECK(fmi2SerializedFMUstateSize(instance[0], state[0], &size));
            char *bytes = malloc(size);
            CHECK(fmi2SerializeFMUstate(instance[0], state[0], bytes, size));
            CHECK(fmi2DeSerializeFMUstate(instance[1], bytes, size, &state[1]));
            CHECK(fmi2SetFMUstate(instance[1], state[1]));
            bytes[size / 2] ^= 1;
            if (fmi2DeSerializeFMUstate(instance[1], bytes, size, &state[1]) != 3)
                return fprintf(stderr, "broken bytes were taken\n"), 1;
            free(bytes);
        }
        if (tick % 7 == 0) CHECK(fmi2FreeFMUstate(instance[0], &state[0]));
    }
    double last[2];
    for (int i = 0; i < 2; i++) {
        CHECK(fmi2GetReal(instance[i], &force, 1, &last[i]));
        fmi2FreeInstance(instance[i]);
    }
    if (memcmp(&last[0], &last[1], sizeof last[0])) return fprintf(stderr, "the two differ\n"), 1;
    uint64_t bits;
    memcpy(&bits, last, sizeof bits);
    printf("%016llx\n", (unsigned long long)bits);
    return 0;
}
