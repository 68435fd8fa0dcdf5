/* Replays counts through the monitor of a machine, saves its totals as a controller would, and prints the largest loads. */
#include <stdio.h>

#include "counts.h" /* the samples, in place of an encoder */
#include "machine.h" /* written by `guideload monitor build` */

static guideload_monitor monitor, again;
static uint8_t places[2][4096]; /* in place of memory that keeps its content without power */

static int failed(const char *what, int32_t code) {
    if (code < 0) {
        fprintf(stderr, "%s: %s\n", what, guideload_error_text(code));
    }
    return code < 0;
}

int main(void) {
    const uint32_t samples = sizeof counts / sizeof counts[0];
    uint64_t number = 0;
    int32_t code = guideload_start(&monitor, &guideload_machine);
    if (failed("start", code)) {
        return 1;
    }
    for (uint32_t k = 0; k < samples; k++) { /* on a controller: in the interrupt of each period */
        code = guideload_push(&monitor, &guideload_machine, k, counts[k]);
        if (failed("push", code)) {
            return 1;
        }
        if (k % 1000 == 999) { /* in a task of low priority, with the interrupt disabled */
            number++;
            code = guideload_save(&monitor, &guideload_machine, number, places[number % 2], sizeof places[0]);
            if (failed("save", code)) {
                return 1;
            }
        }
    }
    for (uint32_t carriage = 0; carriage < guideload_machine.carriage_count; carriage++) {
        guideload_totals_of_carriage totals;
        float loads[GUIDELOAD_COMPONENTS];
        if (failed("totals", guideload_totals(&monitor, &guideload_machine, carriage, &totals)) ||
            failed("loads", guideload_loads(&monitor, carriage, loads))) {
            return 1;
        }
        printf("largest %.9g N in period %llu, now Fy %.9g N\n", (double)totals.largest[6],
               (unsigned long long)totals.period_of_largest[6], (double)loads[0]);
    }
    guideload_start(&again, &guideload_machine); /* after a loss of power */
    uint64_t found = 0;
    code = guideload_restore(&again, &guideload_machine, places[0], places[1], sizeof places[0], &found);
    if (failed("restore", code) || found != number) {
        return 1;
    }
    if (guideload_loads(&monitor, GUIDELOAD_CARRIAGES, (float[GUIDELOAD_COMPONENTS]){0}) != GUIDELOAD_NO_CARRIAGE) {
        return 1;
    }
    printf("%lu samples, record %llu of %lu bytes restored\n", (unsigned long)samples, (unsigned long long)found,
           (unsigned long)guideload_record_length(&guideload_machine));
    return 0;
}
