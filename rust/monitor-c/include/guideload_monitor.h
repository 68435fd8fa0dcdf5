/* Load monitor of linear guides: from encoder counts to the loads of the carriages and the life that they use.
 *
 * `guideload monitor build machine.toml trace.csv ... -o machine.h` writes the constants of a machine, guideload_machine. Then:
 *
 *     static guideload_monitor monitor;
 *     guideload_start(&monitor, &guideload_machine);
 *     guideload_push(&monitor, &guideload_machine, stamp, count);    once per period
 *     guideload_loads(&monitor, 0, loads);                           of the first carriage
 *
 * Threads and interrupts: the library has no state of its own. Calls with the same monitor must not overlap: make all of them in one task or
 * one interrupt, or disable the interrupt that pushes around the others. Different monitors are independent, and the constants may be shared.
 * No call waits, allocates, or calls back; guideload_push takes bounded time and is made for an interrupt. It uses the floating-point unit.
 *
 * Return values: below 0 an error, with guideload_error_text. Loads are in N and N m, in the axes of the machine file.
 *
 * Memory: a pointer that is neither null nor misaligned must point to memory of its type, or of the stated length, and the pieces that one call
 * gets must not overlap. What is in that memory may be damaged: the constants are checked by guideload_start, a memory that was not started is
 * refused, and whatever else is overwritten, a call gives an error or results that are finite, in bounded time. A change of few bits in the
 * memory of a monitor may go unnoticed: against that there is memory with error correction.
 */
#ifndef GUIDELOAD_MONITOR_H
#define GUIDELOAD_MONITOR_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { GUIDELOAD_STATES = 12, GUIDELOAD_CARRIAGES = 8, GUIDELOAD_DIFFERENCES = 128, GUIDELOAD_BINS = 16 };

/* Components of a load: Fy, Fz, Mx, My, Mz about the carriage centre. */
enum { GUIDELOAD_COMPONENTS = 5 };

/* Quantities with extremes: the components, the square of the resultant of Fy and Fz (N^2), the equivalent load (N). */
enum { GUIDELOAD_QUANTITIES = 7 };

/* Errors. */
enum {
    GUIDELOAD_NULL = -1,
    GUIDELOAD_NO_CARRIAGE = -2,
    GUIDELOAD_MISALIGNED = -3,
    GUIDELOAD_NOT_STARTED = -4,
    GUIDELOAD_DAMAGED_CONSTANTS = -5,
    GUIDELOAD_OTHER_CONSTANTS = -6,
    GUIDELOAD_NOT_FINITE = -7,
    GUIDELOAD_TOO_SHORT = -11,
    GUIDELOAD_NOT_A_RECORD = -12,
    GUIDELOAD_DAMAGED = -13,
    GUIDELOAD_OTHER_MACHINE = -14
};

/* What became of a sample. */
enum {
    GUIDELOAD_USED = 0,
    GUIDELOAD_EARLY = 1,       /* came too soon after the one before, and was ignored */
    GUIDELOAD_SUSPECT = 2,     /* does not fit the motion: the next ones decide */
    GUIDELOAD_BRIDGED = 3,     /* was used, and missing or wrong samples before it were bridged */
    GUIDELOAD_COUNTER_SET = 4, /* the counter was set to another value; the motion goes on from it */
    GUIDELOAD_RESTARTED = 5    /* the first sample, or too many were missing or wrong: starts again from rest */
};

/* First word of the constants: version of this header. */
#define GUIDELOAD_LAYOUT 0x474C4303u

/* Constants of a machine, with a checksum. Written by `guideload monitor build`; not to be changed by hand. */
typedef struct {
    float weights[2][2][GUIDELOAD_COMPONENTS];
    float minor, preload, opening;
    uint32_t counted, plain, preload_form;
} guideload_rule;

typedef struct {
    float rest[GUIDELOAD_COMPONENTS];
    float by_state[GUIDELOAD_STATES][GUIDELOAD_COMPONENTS];
    guideload_rule rule;
    float limit, bins_per_load, capacity;
} guideload_carriage;

typedef struct {
    uint32_t ticks, tolerance, counter_bits;
    int32_t most_change, slack, still;
    uint32_t most_missing;
} guideload_input;

typedef struct {
    uint32_t layout;
    uint32_t id, carriage_count;
    guideload_input input;
    uint32_t tap_count, lag, settling, exponent;
    float period, speed_of_step;
    float taps[2][GUIDELOAD_DIFFERENCES];
    float change[GUIDELOAD_STATES][GUIDELOAD_STATES];
    float from_start[GUIDELOAD_STATES], from_end[GUIDELOAD_STATES];
    guideload_carriage carriages[GUIDELOAD_CARRIAGES];
    uint32_t check;
} guideload_prepared;

/* Memory of a monitor; its content is private. */
typedef struct {
    uint64_t words[560];
} guideload_monitor;

/* Totals of a carriage since the first start. */
typedef struct {
    float smallest[GUIDELOAD_QUANTITIES], largest[GUIDELOAD_QUANTITIES];
    uint64_t period_of_smallest[GUIDELOAD_QUANTITIES], period_of_largest[GUIDELOAD_QUANTITIES];
    double power;                       /* integral of the equivalent load to the power p over the travel, N^p m */
    double life_used;                   /* share of the rating life, 1 for all of it; -1 if there is no rating */
    uint64_t histogram[GUIDELOAD_BINS]; /* periods by equivalent load; the last bin has all larger loads */
    uint64_t above_limit;               /* periods with an equivalent load above the limit */
    uint64_t limit_exceeded;            /* how often it rose above the limit */
} guideload_totals_of_carriage;

/* The layout that the library was compiled for. */
#if defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
_Static_assert(sizeof(guideload_prepared) == 4772, "guideload_monitor.h does not fit the library");
#endif

/* Starts a monitor for a machine, or starts it again with nothing seen. Checks the constants, which takes about as long as 100 samples. */
int32_t guideload_start(guideload_monitor *monitor, const guideload_prepared *machine);

/* Takes a sample: its time stamp in ticks (or its number) and the counter; both may wrap. A pause of 2^31 ticks or more
 * is not recognised. Returns what became of it. */
int32_t guideload_push(guideload_monitor *monitor, const guideload_prepared *machine, uint32_t stamp, uint32_t count);

/* Loads of a carriage, `lag` samples before the last one. Returns 1 while they still depend on the start, else 0. */
int32_t guideload_loads(const guideload_monitor *monitor, uint32_t carriage, float loads[GUIDELOAD_COMPONENTS]);

/* Number of the period of the loads, from 0 at the first sample. */
int32_t guideload_period(const guideload_monitor *monitor, uint64_t *period);

/* Totals of a carriage. Returns 1 while there are no extremes, which are 0 then: no load was known and settled so far; else 0. */
int32_t guideload_totals(const guideload_monitor *monitor, const guideload_prepared *machine, uint32_t carriage,
                         guideload_totals_of_carriage *totals);

/* Bytes of a record of the totals; 0 if the pointer cannot be used. */
uint32_t guideload_record_length(const guideload_prepared *machine);

/* Writes the totals as record `number`, which must grow from record to record. Returns its length. Keep two places and write them in turn: if
 * power fails while one is written, the other is whole. */
int32_t guideload_save(const guideload_monitor *monitor, const guideload_prepared *machine, uint64_t number, uint8_t *place,
                       uint32_t length);

/* Goes on with the newer of two records, both of `length` bytes, and gives its number. Call it before the first sample. */
int32_t guideload_restore(guideload_monitor *monitor, const guideload_prepared *machine, const uint8_t *first,
                          const uint8_t *second, uint32_t length, uint64_t *number);

/* Text of an error. */
const char *guideload_error_text(int32_t error);

#ifdef __cplusplus
}
#endif

#endif
