/* Every misuse gives a code and a text. Run by ci/ffi.sh, under sanitizers too. */

#include <pthread.h>
#include <stdio.h>
#include <string.h>

#include "palpate.h"

static int failures = 0;

/* `call` gives `code`, and a text that has `words` in it. */
#define EXPECT(call, code, words) expect(#call, (call), (code), (words), __LINE__)

static void expect(const char *call, PalpateCode got, PalpateCode code, const char *words, int line) {
    const char *text = palpate_last_error();
    if (got != code || (code != PALPATE_CODE_OK && strstr(text, words) == NULL)) {
        fprintf(stderr, "misuse.c:%d: %s gave %s (%s), not %s (%s)\n", line, call, palpate_code_name(got), text,
                palpate_code_name(code), words);
        failures++;
    }
}

static const PalpateBlock BLOCK = {
    .size = sizeof(PalpateBlock), .fixed_faces = 1u << 4, .nodes = {5, 5, 5}, .size_m = {0.05, 0.05, 0.05}};
static const PalpateDevice DEVICE = {.size = sizeof(PalpateDevice), .position_m = {0.02, 0.02, 0.06}};
static const PalpateState STATE = {.size = sizeof(PalpateState), .position_m = {0.02, 0.02, 0.06}};

static PalpateSetup setup_of_block(void) {
    PalpateSetup setup = {0};
    EXPECT(palpate_setup_block(&BLOCK, &setup), PALPATE_CODE_OK, "");
    EXPECT(palpate_setup_model(setup, "patch"), PALPATE_CODE_OK, "");
    return setup;
}

static PalpateSession hosted(void) {
    PalpateSession session = {0};
    EXPECT(palpate_start_hosted(setup_of_block(), &DEVICE, 1, &session), PALPATE_CODE_OK, "");
    return session;
}

static void nulls(void) {
    PalpateSetup setup = {0};
    EXPECT(palpate_setup_from_file(NULL, &setup), PALPATE_CODE_NULL_POINTER, "path is null");
    EXPECT(palpate_setup_from_file("a.toml", NULL), PALPATE_CODE_NULL_POINTER, "setup is null");
    EXPECT(palpate_setup_from_toml(NULL, NULL, &setup), PALPATE_CODE_NULL_POINTER, "toml is null");
    EXPECT(palpate_setup_demo(NULL), PALPATE_CODE_NULL_POINTER, "setup is null");
    EXPECT(palpate_setup_block(NULL, &setup), PALPATE_CODE_NULL_POINTER, "PalpateBlock is null");
    EXPECT(palpate_setup_tetrahedra(NULL, &setup), PALPATE_CODE_NULL_POINTER, "PalpateTetrahedra is null");
    setup = setup_of_block();
    EXPECT(palpate_setup_model(setup, NULL), PALPATE_CODE_NULL_POINTER, "model is null");
    EXPECT(palpate_setup_log(setup, NULL), PALPATE_CODE_NULL_POINTER, "path is null");
    EXPECT(palpate_setup_path(setup, NULL, NULL, 2), PALPATE_CODE_NULL_POINTER, "times_s is null");
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_OK, "");

    PalpateSession session = hosted();
    PalpateState state = STATE;
    PalpateCommand command = {.size = sizeof command};
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    EXPECT(palpate_tick(session, NULL, &command), PALPATE_CODE_NULL_POINTER, "PalpateState is null");
    EXPECT(palpate_tick(session, &state, NULL), PALPATE_CODE_NULL_POINTER, "PalpateCommand is null");
    EXPECT(palpate_tick_all(session, NULL, &command, 1), PALPATE_CODE_NULL_POINTER, "states");
    EXPECT(palpate_surface_size(session, NULL, NULL), PALPATE_CODE_NULL_POINTER, "nodes is null");
    EXPECT(palpate_triangles(session, NULL, 1000), PALPATE_CODE_NULL_POINTER, "triangles is null");
    EXPECT(palpate_surface(session, NULL, 1000, NULL), PALPATE_CODE_NULL_POINTER, "positions_m is null");
    EXPECT(palpate_tool(session, 0, NULL), PALPATE_CODE_NULL_POINTER, "PalpateTool is null");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");
}

static void handles(void) {
    const PalpateSetup none = {0}, never = {UINT64_MAX};
    EXPECT(palpate_setup_friction(none, 0.5), PALPATE_CODE_BAD_HANDLE, "never given");
    EXPECT(palpate_setup_free(never), PALPATE_CODE_BAD_HANDLE, "never given");
    PalpateSetup setup = setup_of_block();
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_OK, "");
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_BAD_HANDLE, "is gone");
    EXPECT(palpate_setup_friction(setup, 0.5), PALPATE_CODE_BAD_HANDLE, "is gone");

    setup = setup_of_block();
    PalpateSession session = {0}, other = {0};
    EXPECT(palpate_start_hosted(setup, &DEVICE, 1, &session), PALPATE_CODE_OK, "");
    EXPECT(palpate_start(setup, &other), PALPATE_CODE_BAD_HANDLE, "is gone");
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_BAD_HANDLE, "is gone");
    const PalpateSession mistaken = {setup.id};
    EXPECT(palpate_stop(mistaken, NULL), PALPATE_CODE_BAD_HANDLE, "another kind");
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_BAD_HANDLE, "is gone");
    PalpateState state = STATE;
    PalpateCommand command = {.size = sizeof command};
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_BAD_HANDLE, "is gone");
    EXPECT(palpate_attach(session), PALPATE_CODE_BAD_HANDLE, "is gone");
    EXPECT(palpate_wait(session, 0.1), PALPATE_CODE_BAD_HANDLE, "is gone");
    EXPECT(palpate_request_stop(session), PALPATE_CODE_BAD_HANDLE, "is gone");
}

static void sizes(void) {
    PalpateBlock block = BLOCK;
    PalpateSetup setup = {0};
    for (uint32_t size = 0; size < 2 * sizeof block; size++) {
        block.size = size;
        if (size != sizeof block) {
            EXPECT(palpate_setup_block(&block, &setup), PALPATE_CODE_WRONG_SIZE, "PalpateBlock: its `size`");
        }
    }
    PalpateSession session = hosted();
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    PalpateState state = STATE;
    PalpateCommand command = {.size = sizeof command};
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_OK, "");
    /* A program of an older version has a smaller struct: no byte beyond it is touched, which sanitizers watch. */
    uint32_t small = sizeof small;
    EXPECT(palpate_tick(session, (const PalpateState *)(const void *)&small, &command), PALPATE_CODE_WRONG_SIZE, "PalpateState");
    EXPECT(palpate_tick(session, &state, (PalpateCommand *)(void *)&small), PALPATE_CODE_WRONG_SIZE, "PalpateCommand");
    PalpateSummary summary = {.size = 1};
    EXPECT(palpate_stop(session, &summary), PALPATE_CODE_WRONG_SIZE, "PalpateSummary");
    summary.size = sizeof summary;
    EXPECT(palpate_stop(session, &summary), PALPATE_CODE_OK, "");
}

/* Whatever a start fails by, nobody has to free the setup. */
static void used_up(void) {
    PalpateSession session = {0};
    PalpateSetup setup = setup_of_block();
    EXPECT(palpate_start(setup, NULL), PALPATE_CODE_NULL_POINTER, "session is null");
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_BAD_HANDLE, "is gone");
    setup = setup_of_block();
    EXPECT(palpate_start_hosted(setup, &DEVICE, 1, NULL), PALPATE_CODE_NULL_POINTER, "session is null");
    EXPECT(palpate_setup_free(setup), PALPATE_CODE_BAD_HANDLE, "is gone");
    PalpateDevice small = DEVICE, nameless = DEVICE;
    small.size = 8;
    nameless.name = "\xff";
    const struct {
        const PalpateDevice *devices;
        size_t count;
        PalpateCode code;
        const char *words;
    } starts[] = {
        {NULL, 1, PALPATE_CODE_NULL_POINTER, "PalpateDevice is null"},
        {&DEVICE, 0, PALPATE_CODE_BAD_ARGUMENT, "count is 0"},
        {&DEVICE, SIZE_MAX, PALPATE_CODE_BAD_ARGUMENT, "must be 1 to"},
        {&small, 1, PALPATE_CODE_WRONG_SIZE, "PalpateDevice"},
        {&nameless, 1, PALPATE_CODE_BAD_ARGUMENT, "not UTF-8"},
    };
    for (size_t place = 0; place < sizeof starts / sizeof starts[0]; place++) {
        setup = setup_of_block();
        EXPECT(palpate_start_hosted(setup, starts[place].devices, starts[place].count, &session), starts[place].code, starts[place].words);
        EXPECT(palpate_setup_free(setup), PALPATE_CODE_BAD_HANDLE, "is gone");
    }
}

static void *tick_elsewhere(void *given) {
    const PalpateSession session = *(const PalpateSession *)given;
    PalpateState state = STATE;
    PalpateCommand command = {.size = sizeof command};
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_WRONG_THREAD, "not attached");
    EXPECT(palpate_attach(session), PALPATE_CODE_WRONG_THREAD, "another thread");
    return NULL;
}

static void *attach_and_leave(void *given) {
    EXPECT(palpate_attach(*(const PalpateSession *)given), PALPATE_CODE_OK, "");
    return NULL;
}

static void threads(void) {
    PalpateSession session = hosted();
    PalpateState state = STATE;
    PalpateCommand command = {.size = sizeof command};
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_WRONG_THREAD, "not attached");
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    pthread_t thread;
    pthread_create(&thread, NULL, tick_elsewhere, &session);
    pthread_join(thread, NULL);
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_OK, "");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");

    /* A thread that ends takes its loop with it, and keeps nobody waiting. */
    session = hosted();
    pthread_create(&thread, NULL, attach_and_leave, &session);
    pthread_join(thread, NULL);
    EXPECT(palpate_tick(session, &state, &command), PALPATE_CODE_WRONG_THREAD, "not attached");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");

    /* One that nobody ticks. */
    EXPECT(palpate_stop(hosted(), NULL), PALPATE_CODE_OK, "");
}

static void arguments(void) {
    PalpateSetup setup = setup_of_block();
    EXPECT(palpate_setup_model(setup, "boundary"), PALPATE_CODE_BAD_ARGUMENT, "must be hold, ");
    EXPECT(palpate_setup_model(setup, "\xff"), PALPATE_CODE_BAD_ARGUMENT, "not UTF-8");
    EXPECT(palpate_setup_rates(setup, 0.0, 30.0), PALPATE_CODE_BAD_ARGUMENT, "haptic_hz is 0");
    const double times[2] = {0.0, -1.0}, places[6] = {0};
    EXPECT(palpate_setup_path(setup, times, places, 2), PALPATE_CODE_SCENE, "");
    EXPECT(palpate_setup_friction(setup, -1.0), PALPATE_CODE_OK, "");
    PalpateSession session = {0};
    EXPECT(palpate_start_hosted(setup, &DEVICE, 1, &session), PALPATE_CODE_SCENE, "friction");
    PalpateDevice strong = DEVICE;
    strong.max_force_n = -1.0;
    EXPECT(palpate_start_hosted(setup_of_block(), &strong, 1, &session), PALPATE_CODE_DEVICE, "max_force_n");
    EXPECT(palpate_setup_from_file("no/such.toml", &setup), PALPATE_CODE_IO, "no/such.toml");
    EXPECT(palpate_setup_from_toml("[body]\nkind = 7", NULL, &setup), PALPATE_CODE_SCENE, "kind");

    PalpateBlock block = BLOCK;
    block.nodes[1] = 1;
    EXPECT(palpate_setup_block(&block, &setup), PALPATE_CODE_SCENE, "");
    for (int axis = 0; axis < 3; axis++) {
        block.nodes[axis] = 100000;
    }
    EXPECT(palpate_setup_block(&block, &setup), PALPATE_CODE_SCENE, "at most 1000000 in all");
    block = BLOCK;
    block.fixed_faces = 1u << 6;
    EXPECT(palpate_setup_block(&block, &setup), PALPATE_CODE_BAD_ARGUMENT, "six faces");

    const double points[12] = {0, 0, 0, 0.05, 0, 0, 0, 0.05, 0, 0, 0, 0.05};
    const uint32_t element[4] = {0, 1, 2, 4}, fixed[3] = {0, 1, 2};
    PalpateTetrahedra body = {.size = sizeof body, .points_m = points, .point_count = 4, .elements = element, .element_count = 1,
                              .fixed_nodes = fixed, .fixed_count = 3};
    EXPECT(palpate_setup_tetrahedra(&body, &setup), PALPATE_CODE_BAD_ARGUMENT, "node 4 is named and there are 4");
    body.point_count = SIZE_MAX / 4;
    EXPECT(palpate_setup_tetrahedra(&body, &setup), PALPATE_CODE_BAD_ARGUMENT, "more than memory has");

    session = hosted();
    EXPECT(palpate_attach(session), PALPATE_CODE_OK, "");
    PalpateState states[2] = {STATE, STATE};
    PalpateCommand commands[2] = {{.size = sizeof(PalpateCommand)}, {.size = sizeof(PalpateCommand)}};
    EXPECT(palpate_tick_all(session, states, commands, 2), PALPATE_CODE_BAD_ARGUMENT, "number of devices");
    EXPECT(palpate_tick_all(session, states, commands, 1), PALPATE_CODE_OK, "");
    EXPECT(palpate_tick_all(session, states, commands, SIZE_MAX), PALPATE_CODE_BAD_ARGUMENT, "more than");
    PalpateTool tool = {.size = sizeof tool};
    EXPECT(palpate_tool(session, 1, &tool), PALPATE_CODE_BAD_ARGUMENT, "no tool 1");
    double positions[3];
    EXPECT(palpate_surface(session, positions, 1, NULL), PALPATE_CODE_BAD_ARGUMENT, "room for 1, and there are 125");
    size_t count = 0;
    PalpateContact contacts[1];
    EXPECT(palpate_contacts(session, contacts, 1, &count), PALPATE_CODE_BAD_ARGUMENT, "palpate_setup_share_contacts");
    EXPECT(palpate_point(session, 0, 0, 0), PALPATE_CODE_BAD_ARGUMENT, "no pointer");
    EXPECT(palpate_set_model(session, "full"), PALPATE_CODE_BAD_ARGUMENT, "cannot be set");
    EXPECT(palpate_set_stiffness(session, 1e9), PALPATE_CODE_BAD_ARGUMENT, "stiffness");
    EXPECT(palpate_wait(session, -1.0), PALPATE_CODE_BAD_ARGUMENT, "seconds is -1");
    /* What is no number is a fault of the device: the force fades, and nothing crashes. */
    states[0].position_m[0] = 0.0 / 0.0;
    EXPECT(palpate_tick(session, states, commands), PALPATE_CODE_OK, "");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");

    /* A session that palpate loops is not ticked. */
    EXPECT(palpate_setup_demo(&setup), PALPATE_CODE_OK, "");
    EXPECT(palpate_setup_virtual_time(setup), PALPATE_CODE_OK, "");
    EXPECT(palpate_start(setup, &session), PALPATE_CODE_OK, "");
    EXPECT(palpate_attach(session), PALPATE_CODE_BAD_ARGUMENT, "palpate owns the loop");
    EXPECT(palpate_tick(session, states, commands), PALPATE_CODE_BAD_ARGUMENT, "palpate owns the loop");
    EXPECT(palpate_stop(session, NULL), PALPATE_CODE_OK, "");
}

int main(void) {
    nulls();
    handles();
    sizes();
    used_up();
    threads();
    arguments();
    if (failures == 0) {
        puts("every misuse gave its code and its text");
    }
    return failures == 0 ? 0 : 1;
}
