/* Whatever threads do at the same time, with handles that are good, used up or never were: each call gives a code, and nothing crashes
 * or hangs. Three threads set up, start, attach, tick, look and stop at random; a fourth stops what it finds. Run by ci/ffi.sh, under
 * sanitizers too. */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "palpate.h"

enum { THREADS = 3, SLOTS = 6, MINE = 4 };

static _Atomic uint64_t setups[SLOTS], sessions[SLOTS];
static atomic_int is_over, failures;
static atomic_long done, failed, ticked, stopped;

/* A thread's own numbers. */
static uint64_t next_random(uint64_t *state) {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state >> 11;
}

/* Every code but that of a bug will do. */
static PalpateCode count(PalpateCode code) {
    atomic_fetch_add(code == PALPATE_CODE_OK ? &done : &failed, 1);
    if (code == PALPATE_CODE_INTERNAL || code < PALPATE_CODE_OK || code > PALPATE_CODE_INTERNAL) {
        fprintf(stderr, "%s: %s\n", palpate_code_name(code), palpate_last_error());
        atomic_fetch_add(&failures, 1);
    }
    return code;
}

static void tick(PalpateSession session, uint64_t *random) {
    PalpateState state = {.size = sizeof state};
    PalpateCommand command = {.size = sizeof command};
    for (int axis = 0; axis < 3; axis++) {
        state.position_m[axis] = 0.02 + 0.001 * (double)(next_random(random) % 10);
    }
    if (next_random(random) % 50 == 0) {
        state.position_m[next_random(random) % 3] = next_random(random) % 2 ? NAN : 1e300;
    }
    if (count(palpate_tick(session, &state, &command)) == PALPATE_CODE_OK) {
        atomic_fetch_add(&ticked, 1);
        for (int axis = 0; axis < 3; axis++) {
            if (!(fabs(command.force_n[axis]) <= 3.3 * 1.001)) {
                fprintf(stderr, "a force of %g N for a device of 3.3 N\n", command.force_n[axis]);
                atomic_fetch_add(&failures, 1);
            }
        }
    }
}

static void start(PalpateSetup setup, uint64_t *random, _Atomic uint64_t *slot) {
    const PalpateDevice device = {.size = sizeof device, .position_m = {0.02, 0.02, 0.03}};
    PalpateSession session = {0};
    const PalpateCode code = next_random(random) % 4 ? palpate_start_hosted(setup, &device, 1, &session) : palpate_start(setup, &session);
    if (count(code) == PALPATE_CODE_OK) {
        const PalpateSession before = {atomic_exchange(slot, session.id)};
        /* Whoever ticks that one goes on until it is stopped. */
        count(palpate_request_stop(before));
    }
}

static void look(PalpateSession session, uint64_t *random) {
    size_t nodes = 0, triangles = 0;
    static _Thread_local double positions[3 * 64];
    static _Thread_local uint32_t corners[3 * 128];
    PalpateTool tool = {.size = sizeof tool};
    PalpateContact contacts[4];
    switch (next_random(random) % 6) {
    case 0: count(palpate_surface_size(session, &nodes, &triangles)); break;
    case 1: count(palpate_surface(session, positions, next_random(random) % 65, NULL)); break;
    case 2: count(palpate_triangles(session, corners, next_random(random) % 129)); break;
    case 3: count(palpate_tool(session, (uint32_t)(next_random(random) % 2), &tool)); break;
    case 4: count(palpate_contacts(session, contacts, next_random(random) % 5, &nodes)); break;
    default: count(palpate_set_friction(session, 0.1 * (double)(next_random(random) % 12))); break;
    }
}

static void *act(void *given) {
    uint64_t random = *(const uint64_t *)given;
    PalpateSession mine[MINE] = {{0}};
    const PalpateBlock block = {.size = sizeof block, .fixed_faces = 1u << 4, .nodes = {4, 4, 4}, .size_m = {0.03, 0.03, 0.03}};
    while (!atomic_load(&is_over)) {
        const size_t slot = next_random(&random) % SLOTS;
        PalpateSetup setup = {atomic_load(&setups[slot])};
        PalpateSession session = {next_random(&random) % 100 ? atomic_load(&sessions[slot]) : next_random(&random)};
        switch (next_random(&random) % 32) {
        case 0:
            if (count(palpate_setup_block(&block, &setup)) == PALPATE_CODE_OK) {
                const PalpateSetup before = {atomic_exchange(&setups[slot], setup.id)};
                count(palpate_setup_free(before));
            }
            break;
        case 1: count(palpate_setup_model(setup, next_random(&random) % 2 ? "patch" : "full")); break;
        case 2: count(palpate_setup_virtual_time(setup)); break;
        case 3: count(palpate_setup_share_contacts(setup)); break;
        case 4: start(setup, &random, &sessions[slot]); break;
        case 5:
            if (count(palpate_attach(session)) == PALPATE_CODE_OK) {
                PalpateSession *place = &mine[next_random(&random) % MINE];
                /* One that this thread ticks it may stop, at once. */
                count(palpate_stop(*place, NULL));
                *place = session;
            }
            break;
        case 6: count(palpate_request_stop(session)); break;
        default: look(session, &random); break;
        }
        /* So that nobody waits long who stops one of them. */
        for (size_t place = 0; place < MINE; place++) {
            tick(mine[place], &random);
        }
        tick(session, &random);
    }
    for (size_t place = 0; place < MINE; place++) {
        count(palpate_stop(mine[place], NULL));
    }
    return NULL;
}

static void *stop(void *given) {
    uint64_t random = *(const uint64_t *)given;
    const struct timespec pause = {.tv_nsec = 20000000};
    while (!atomic_load(&is_over)) {
        const PalpateSession session = {atomic_load(&sessions[next_random(&random) % SLOTS])};
        PalpateSummary summary = {.size = sizeof summary};
        atomic_fetch_add(&stopped, count(palpate_stop(session, &summary)) == PALPATE_CODE_OK);
        nanosleep(&pause, NULL);
    }
    return NULL;
}

int main(void) {
    pthread_t threads[THREADS + 1];
    uint64_t seeds[THREADS + 1];
    for (uint64_t index = 0; index <= THREADS; index++) {
        seeds[index] = 0x9e3779b97f4a7c15u * (index + 1);
        pthread_create(&threads[index], NULL, index < THREADS ? act : stop, &seeds[index]);
    }
    const struct timespec span = {.tv_sec = 3};
    nanosleep(&span, NULL);
    atomic_store(&is_over, 1);
    for (size_t index = 0; index <= THREADS; index++) {
        pthread_join(threads[index], NULL);
    }
    for (size_t slot = 0; slot < SLOTS; slot++) {
        count(palpate_stop((PalpateSession){atomic_load(&sessions[slot])}, NULL));
        count(palpate_setup_free((PalpateSetup){atomic_load(&setups[slot])}));
    }
    printf("%ld calls were done and %ld refused: %ld ticks, %ld sessions stopped by others\n", atomic_load(&done), atomic_load(&failed),
           atomic_load(&ticked), atomic_load(&stopped));
    const int is_good = atomic_load(&failures) == 0 && atomic_load(&ticked) > 100 && atomic_load(&failed) > 100;
    return is_good ? 0 : 1;
}
