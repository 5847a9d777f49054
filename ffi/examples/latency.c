/* How long does a tick take on this machine? A loop at 1 kHz, as real-time as the system grants: Linux.
 *
 *     latency [MODEL [NODES]]     the local model, `predictive` without; the nodes along an edge of the block, 12 without
 *
 * Prints how long palpate_tick took: where it computed a force, and where it came a second time in a period and gave the force of
 * before. */

#define _GNU_SOURCE
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

#include "palpate.h"

#define CHECK(call) \
    do { \
        if ((call) != PALPATE_CODE_OK) { \
            fprintf(stderr, "%s: %s\n", #call, palpate_last_error()); \
            return 1; \
        } \
    } while (0)

enum { WARM_UP = 500, TICKS = 2500 };

static double now_us(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

static int by_size(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print(const char *what, double *us, int count) {
    qsort(us, (size_t)count, sizeof *us, by_size);
    if (count > 0) {
        printf("%-10s %5d times  median %8.2f us  99 %%: %8.2f us  most %8.2f us\n", what, count, us[count / 2],
               us[count * 99 / 100], us[count - 1]);
    }
}

int main(int argc, char **argv) {
    const char *model = argc > 1 ? argv[1] : "predictive";
    const uint32_t nodes = argc > 2 ? (uint32_t)strtoul(argv[2], NULL, 10) : 12;
    PalpateBlock block = {.size = sizeof block, .fixed_faces = 1u << 4, .nodes = {nodes, nodes, nodes}, .size_m = {0.1, 0.1, 0.1}};
    PalpateDevice device = {.size = sizeof device, .max_force_n = 8.0, .position_m = {0.04, 0.052, 0.105}};
    PalpateSetup setup;
    PalpateSession session;
    CHECK(palpate_setup_block(&block, &setup));
    CHECK(palpate_setup_friction(setup, 0.5));
    CHECK(palpate_setup_model(setup, model));
    CHECK(palpate_start_hosted(setup, &device, 1, &session));
    CHECK(palpate_attach(session));

    /* What a host does for its own thread. After the start: palpate's threads are none of its children. */
    const struct sched_param priority = {.sched_priority = 80};
    if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0) {
        puts("no real-time priority here: the largest times are the system's");
    }
    if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
        puts("memory is not locked here");
    }

    static double computed[TICKS], again[TICKS];
    int computed_count = 0, again_count = 0;
    PalpateState state = {.size = sizeof state};
    PalpateCommand command = {.size = sizeof command};
    struct timespec next;
    clock_gettime(CLOCK_MONOTONIC, &next);
    for (int tick = 0; tick < WARM_UP + TICKS; tick++) {
        /* Down by a centimetre within 0.4 s, then to and fro over the surface. */
        const double time = 1e-3 * tick, depth = 0.015 * fmin(time / 0.4, 1.0);
        state.position_m[0] = 0.04 + 0.01 * sin(3.0 * time);
        state.position_m[1] = 0.052;
        state.position_m[2] = 0.105 - depth;
        for (int call = 0; call < 2; call++) {
            const double begun = now_us();
            CHECK(palpate_tick(session, &state, &command));
            const double took = now_us() - begun;
            if (tick >= WARM_UP && command.is_new) {
                computed[computed_count < TICKS ? computed_count++ : TICKS - 1] = took;
            } else if (tick >= WARM_UP && again_count < TICKS) {
                again[again_count++] = took;
            }
        }
        next.tv_nsec += 1000000;
        if (next.tv_nsec >= 1000000000) {
            next.tv_nsec -= 1000000000;
            next.tv_sec++;
        }
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, NULL);
    }
    PalpateSummary summary = {.size = sizeof summary};
    CHECK(palpate_stop(session, &summary));
    printf("%s on %u^3 nodes, peak force %.3f N\n", model, nodes, summary.peak_force_n);
    print("computed", computed, computed_count);
    print("again", again, again_count);
    return computed_count > 0 && summary.peak_force_n > 0.1 ? 0 : 1;
}
