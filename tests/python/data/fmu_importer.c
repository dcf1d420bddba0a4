/* An importer of an FMU without Python, FMI 2.0 or with -DFMI=3 FMI 3.0: two instances side by side, and a hundred times a
   state that is kept, restored, sent as bytes to the other instance and freed. It prints the bits of the last output.
   Arguments: library, resources as FMI wants them, token, references of an input and an output, period in s. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#define dlopen(path, how) LoadLibraryA(path)
#define dlsym(library, name) GetProcAddress((HMODULE)(library), name)
#define dlerror() "the library cannot be loaded"
#else
#include <dlfcn.h>
#endif

/* Twice, so that a name of both versions is expanded before it becomes a text. */
#define LOAD(name, result, ...) LOAD_AS(name, result, __VA_ARGS__)
#define LOAD_AS(name, result, ...) \
    result (*name)(__VA_ARGS__) = (result(*)(__VA_ARGS__))dlsym(library, #name); \
    if (!name) return fprintf(stderr, "no %s\n", #name), 1
#define CHECK(call) \
    if ((call) != 0) return fprintf(stderr, "%s\n", #call), 1

static int messages;

#if FMI == 3
static void log_message(void *environment, int status, const char *category, const char *text) {
    (void)environment, (void)status, (void)category, (void)text;
    messages++;
}
#define GET_STATE fmi3GetFMUState
#define SET_STATE fmi3SetFMUState
#define FREE_STATE fmi3FreeFMUState
#define SIZE fmi3SerializedFMUStateSize
#define SERIALIZE fmi3SerializeFMUState
#define DESERIALIZE fmi3DeserializeFMUState
#define EXIT_INITIALIZATION fmi3ExitInitializationMode
#define RESET fmi3Reset
#define FREE_INSTANCE fmi3FreeInstance
#define INSTANTIATE(token) \
    fmi3InstantiateCoSimulation("rig", token, argument[2], 0, 0, 0, 0, NULL, 0, NULL, log_message, NULL)
#define ENTER(c) fmi3EnterInitializationMode(c, 0, 0.0, 0.0, 0, 0.0)
#define SET(c, reference, value) fmi3SetFloat64(c, reference, 1, value, 1)
#define GET(c, reference, value) fmi3GetFloat64(c, reference, 1, value, 1)
#define STEP(c, time) fmi3DoStep(c, time, period, 0, &answers[0], &answers[1], &answers[2], &reached)
#else
typedef void (*logger_t)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    logger_t logger;
    void *allocate, *release, *finished, *environment;
} callbacks_t;
static void log_message(void *environment, const char *name, int status, const char *category, const char *text, ...) {
    (void)environment, (void)name, (void)status, (void)category, (void)text;
    messages++;
}
static const callbacks_t callbacks = {log_message, NULL, NULL, NULL, NULL};
#define GET_STATE fmi2GetFMUstate
#define SET_STATE fmi2SetFMUstate
#define FREE_STATE fmi2FreeFMUstate
#define SIZE fmi2SerializedFMUstateSize
#define SERIALIZE fmi2SerializeFMUstate
#define DESERIALIZE fmi2DeSerializeFMUstate
#define EXIT_INITIALIZATION fmi2ExitInitializationMode
#define RESET fmi2Reset
#define FREE_INSTANCE fmi2FreeInstance
#define INSTANTIATE(token) fmi2Instantiate("rig", 1, token, argument[2], &callbacks, 0, 0)
#define ENTER(c) (fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0) || fmi2EnterInitializationMode(c))
#define SET(c, reference, value) fmi2SetReal(c, reference, 1, value)
#define GET(c, reference, value) fmi2GetReal(c, reference, 1, value)
#define STEP(c, time) fmi2DoStep(c, time, period, 1)
#endif

int main(int count, char **argument) {
    if (count != 7) return 2;
    void *library = dlopen(argument[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
#if FMI == 3
    LOAD(fmi3InstantiateCoSimulation, void *, const char *, const char *, const char *, bool, bool, bool, bool,
         const unsigned *, size_t, void *, void (*)(void *, int, const char *, const char *), void *);
    LOAD(fmi3EnterInitializationMode, int, void *, bool, double, double, bool, double);
    LOAD(fmi3SetFloat64, int, void *, const unsigned *, size_t, const double *, size_t);
    LOAD(fmi3GetFloat64, int, void *, const unsigned *, size_t, double *, size_t);
    LOAD(fmi3DoStep, int, void *, double, double, bool, bool *, bool *, bool *, double *);
    bool answers[3];
    double reached;
#else
    LOAD(fmi2Instantiate, void *, const char *, int, const char *, const char *, const callbacks_t *, int, int);
    LOAD(fmi2SetupExperiment, int, void *, int, double, double, int, double);
    LOAD(fmi2EnterInitializationMode, int, void *);
    LOAD(fmi2SetReal, int, void *, const unsigned *, size_t, const double *);
    LOAD(fmi2GetReal, int, void *, const unsigned *, size_t, double *);
    LOAD(fmi2DoStep, int, void *, double, double, int);
#endif
    LOAD(EXIT_INITIALIZATION, int, void *);
    LOAD(GET_STATE, int, void *, void **);
    LOAD(SET_STATE, int, void *, void *);
    LOAD(FREE_STATE, int, void *, void **);
    LOAD(SIZE, int, void *, void *, size_t *);
    LOAD(SERIALIZE, int, void *, void *, char *, size_t);
    LOAD(DESERIALIZE, int, void *, const char *, size_t, void **);
    LOAD(RESET, int, void *);
    LOAD(FREE_INSTANCE, void, void *);
    unsigned input = (unsigned)atoi(argument[4]), output = (unsigned)atoi(argument[5]);
    double period = atof(argument[6]), value = NAN;
    void *instance[2], *state[2] = {NULL, NULL};
    if (INSTANTIATE("another") || messages != 1) return fprintf(stderr, "a wrong token was taken\n"), 1;
    for (int i = 0; i < 2; i++) {
        instance[i] = INSTANTIATE(argument[3]);
        if (!instance[i]) return fprintf(stderr, "no instance\n"), 1;
        CHECK(ENTER(instance[i]));
        CHECK(EXIT_INITIALIZATION(instance[i]));
    }
    if (SET(instance[0], &output, &value) != 3 || SET(NULL, &input, &value) != 3 || SET(instance[0], NULL, &value) != 3)
        return fprintf(stderr, "a wrong value was taken\n"), 1;
    for (int tick = 0; tick < 100; tick++) {
        /* A step that is taken back. */
        CHECK(GET_STATE(instance[0], &state[0]));
        value = 0.3;
        CHECK(SET(instance[0], &input, &value));
        CHECK(STEP(instance[0], tick * period));
        CHECK(SET_STATE(instance[0], state[0]));
        value = 0.01 * (tick % 17);
        for (int i = 0; i < 2; i++) {
            CHECK(SET(instance[i], &input, &value));
            CHECK(STEP(instance[i], tick * period));
        }
        /* The first one's state by way of bytes into the second. */
        size_t size;
        CHECK(GET_STATE(instance[0], &state[0]));
        CHECK(SIZE(instance[0], state[0], &size));
        char *bytes = malloc(size);
        CHECK(SERIALIZE(instance[0], state[0], bytes, size));
        CHECK(DESERIALIZE(instance[1], bytes, size, &state[1]));
        if (tick % 2) {
            CHECK(SET_STATE(instance[1], state[1]));
        }
        bytes[size / 2] ^= 1;
        if (DESERIALIZE(instance[1], bytes, size, &state[1]) != 3)
            return fprintf(stderr, "broken bytes were taken\n"), 1;
        free(bytes);
        /* Some are freed with their instance. */
        if (tick % 7 == 0) CHECK(FREE_STATE(instance[0], &state[0]));
        if (tick % 11 == 0) CHECK(FREE_STATE(instance[1], &state[1]));
    }
    double last[2];
    for (int i = 0; i < 2; i++) {
        CHECK(GET(instance[i], &output, &last[i]));
        CHECK(RESET(instance[i]));
        FREE_INSTANCE(instance[i]);
    }
    if (memcmp(&last[0], &last[1], sizeof last[0])) return fprintf(stderr, "the two differ\n"), 1;
    uint64_t bits;
    memcpy(&bits, last, sizeof bits);
    printf("%016llx\n", (unsigned long long)bits);
    return 0;
}
