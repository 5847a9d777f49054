/* The least that a host with a haptic loop of its own does: a scene, a session, a tick per millisecond, a force.
 *
 * In virtual time, so that it runs anywhere and gives the same force every time; without that line, the ticks belong into the host's
 * thread at 1 kHz. Built, after `cargo build --release -p palpate-ffi`, by
 *
 *     cc -o touch ffi/examples/touch.c -I ffi/include -L target/release -lpalpate_ffi -Wl,-rpath,$PWD/target/release -lm */

#include <stdio.h>

#include "palpate.h"

#define CHECK(call) \
    do { \
        if ((call) != PALPATE_CODE_OK) { \
            fprintf(stderr, "%s: %s\n", #call, palpate_last_error()); \
            return 1; \
        } \
    } while (0)

int main(void) {
    /* A block of 10 cm that stands on a table. */
    PalpateBlock block = {.size = sizeof block, .fixed_faces = 1u << 4, .nodes = {8, 8, 8}, .size_m = {0.1, 0.1, 0.1}};
    PalpateSetup setup;
    CHECK(palpate_setup_block(&block, &setup));
    CHECK(palpate_setup_friction(setup, 0.5));
    CHECK(palpate_setup_model(setup, "predictive"));
    CHECK(palpate_setup_virtual_time(setup));

    PalpateDevice device = {.size = sizeof device, .max_force_n = 8.0, .position_m = {0.048, 0.052, 0.105}};
    PalpateSession session;
    CHECK(palpate_start_hosted(setup, &device, 1, &session));
    CHECK(palpate_attach(session));

    PalpateState state = {.size = sizeof state};
    PalpateCommand command = {.size = sizeof command};
    for (int tick = 0; tick <= 600; tick++) {
        /* Down by 1.5 cm within 0.4 s, and back up within 0.2 s. */
        double depth_m = tick < 400 ? 0.015 * tick / 400.0 : 0.015 * (600 - tick) / 200.0;
        state.position_m[0] = 0.048;
        state.position_m[1] = 0.052;
        state.position_m[2] = 0.105 - depth_m;
        state.velocity_m_s[2] = tick < 400 ? -0.0375 : 0.075;
        CHECK(palpate_tick(session, &state, &command));
        if (tick % 100 == 0) {
            printf("%.3f s  tool at %.4f m  force %+.4f N\n", command.time_s, state.position_m[2], command.force_n[2]);
        }
        if (tick == 399 && !(command.force_n[2] > 0.1)) {
            fprintf(stderr, "a block that is pressed by a centimetre pushes back\n");
            return 1;
        }
    }

    PalpateSummary summary = {.size = sizeof summary};
    CHECK(palpate_stop(session, &summary));
    printf("%llu ticks, %llu resyncs, at most %.3f N\n", (unsigned long long)summary.ticks,
           (unsigned long long)summary.resyncs, summary.peak_commanded_n);
    return 0;
}
