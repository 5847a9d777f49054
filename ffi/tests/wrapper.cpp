// The C++ wrapper: ownership moves, what fails throws, a tick does not. Run by ci/ffi.sh, under sanitizers too.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <thread>

#include "palpate.hpp"

static int failures = 0;

static void expect(bool holds, const char *what, int line) {
    if (!holds) {
        std::fprintf(stderr, "wrapper.cpp:%d: %s\n", line, what);
        ++failures;
    }
}
#define EXPECT(holds) expect((holds), #holds, __LINE__)

template <class Call>
static PalpateCode thrown(Call call) {
    try {
        call();
    } catch (const palpate::Error &error) {
        EXPECT(std::strlen(error.what()) > 0);
        return error.code();
    }
    return PALPATE_CODE_OK;
}

static palpate::Setup block() {
    auto block = palpate::make<PalpateBlock>();
    block.fixed_faces = 1u << 4;
    for (int axis = 0; axis < 3; ++axis) {
        block.nodes[axis] = 6;
        block.size_m[axis] = 0.05;
    }
    return palpate::Setup::block(block);
}

static PalpateDevice device(const char *name = nullptr, double x = 0.024) {
    auto device = palpate::make<PalpateDevice>();
    device.name = name;
    device.position_m[0] = x;
    device.position_m[1] = 0.026;
    device.position_m[2] = 0.052;
    return device;
}

static PalpateState at(double x, double z) {
    auto state = palpate::make<PalpateState>();
    state.position_m[0] = x;
    state.position_m[1] = 0.026;
    state.position_m[2] = z;
    return state;
}

/// The forces of a press in virtual time.
static std::vector<double> press() {
    auto setup = block();
    setup.friction(0.5).model("patch").virtual_time();
    auto session = std::move(setup).start_hosted(device());
    const auto loop = session.attach();
    auto command = palpate::make<PalpateCommand>();
    std::vector<double> forces;
    for (int tick = 0; tick <= 300; ++tick) {
        EXPECT(loop.tick(at(0.024, 0.052 - 0.00003 * tick), command) == PALPATE_CODE_OK);
        EXPECT(command.is_new == 1 && std::abs(command.time_s - 1e-3 * tick) < 1e-12);
        forces.push_back(command.force_n[2]);
    }
    EXPECT(session.stop().ticks == 300);
    EXPECT(palpate::Session::report().find("local") != std::string::npos);
    return forces;
}

static void virtual_time_gives_the_same_forces_every_time() {
    const auto forces = press();
    EXPECT(forces.front() == 0.0 && forces.back() > 0.05);
    EXPECT(forces == press());
}

static void a_stop_that_is_asked_for_brings_the_force_to_rest_in_the_ticks_that_follow() {
    auto setup = block();
    setup.model("patch").virtual_time();
    auto session = std::move(setup).start_hosted(device());
    const auto loop = session.attach();
    auto command = palpate::make<PalpateCommand>();
    for (int tick = 0; tick <= 300; ++tick) {
        loop.tick(at(0.024, 0.052 - 0.00003 * tick), command);
    }
    const double felt_n = command.force_n[2];
    session.request_stop();
    std::vector<double> forces;
    while (loop.tick(at(0.024, 0.043), command) == PALPATE_CODE_OK && forces.size() < 1000) {
        forces.push_back(command.force_n[2]);
    }
    EXPECT(felt_n > 0.05 && forces.size() > 10 && forces.size() < 1000);
    EXPECT(std::is_sorted(forces.rbegin(), forces.rend()) && forces.front() <= felt_n && forces.back() == 0.0);
    EXPECT(loop.tick(at(0.024, 0.043), command) == PALPATE_CODE_ENDED && command.force_n[2] == 0.0);
    EXPECT(session.ended());
    session.stop();
}

static void a_session_with_an_end_ends() {
    auto setup = block();
    setup.model("patch").virtual_time().duration(0.2);
    auto session = std::move(setup).start_hosted(device());
    const auto loop = session.attach();
    auto command = palpate::make<PalpateCommand>();
    int ticks = 0;
    while (loop.tick(at(0.024, 0.052 - 0.00003 * ticks), command) == PALPATE_CODE_OK && ticks < 1000) {
        ++ticks;
    }
    EXPECT(ticks >= 200 && ticks < 400);
    session.stop();
}

static void a_scene_with_a_pointer_takes_the_device_of_the_host() {
    auto setup = palpate::Setup::toml(R"(
        [body]
        kind = "mass_spring"
        [body.block]
        nodes = [6, 6, 6]
        size_m = [0.05, 0.05, 0.05]
        fixed = ["z_min"]
        [body.material]
        node_mass_kg = 0.0005
        stiffness_n_per_m = 30.0
        damping_ratio = 0.3
        [device]
        kind = "pointer"
        tool = { shape = "sphere", radius_m = 0.008 }
    )");
    setup.model("patch").virtual_time();
    auto session = std::move(setup).start_hosted(device());
    const auto loop = session.attach();
    auto command = palpate::make<PalpateCommand>();
    for (int tick = 0; tick <= 300; ++tick) {
        EXPECT(loop.tick(at(0.024, 0.06 - 0.00003 * tick), command) == PALPATE_CODE_OK);
    }
    EXPECT(command.force_n[2] > 0.05);
    EXPECT(thrown([&] { session.point(0.0, 0.0, 0.0); }) == PALPATE_CODE_BAD_ARGUMENT);
    session.stop();
}

static void one_thread_ticks_two_sessions() {
    auto first = block().start_hosted(device());
    auto second = block().start_hosted(device());
    const auto one = first.attach(), other = second.attach();
    auto command = palpate::make<PalpateCommand>();
    EXPECT(one.tick(at(0.024, 0.052), command) == PALPATE_CODE_OK && other.tick(at(0.024, 0.052), command) == PALPATE_CODE_OK);
    first.stop();
    EXPECT(one.tick(at(0.024, 0.052), command) == PALPATE_CODE_BAD_HANDLE);
    EXPECT(other.tick(at(0.024, 0.052), command) == PALPATE_CODE_OK);
    second.stop();
}

static void two_devices_feel_two_forces() {
    auto setup = block();
    setup.model("patch").virtual_time();
    auto session = std::move(setup).start_hosted({device("left", 0.014), device("right", 0.036)});
    const auto loop = session.attach();
    std::array<PalpateCommand, 2> commands = {palpate::make<PalpateCommand>(), palpate::make<PalpateCommand>()};
    for (int tick = 0; tick <= 300; ++tick) {
        const std::array<PalpateState, 2> states = {at(0.014, 0.052 - 0.00003 * tick), at(0.036, 0.052)};
        EXPECT(loop.tick(states, commands) == PALPATE_CODE_OK);
    }
    EXPECT(commands[0].force_n[2] > 0.05 && std::abs(commands[1].force_n[2]) < 1e-6);
    EXPECT(session.tool(0).commanded_force_n[2] == commands[0].force_n[2]);
    EXPECT(session.stop().tools == 2);
}

static void tetrahedra_from_arrays() {
    // Six tetrahedra around the diagonal make a cube; 4 x 4 x 4 cubes of 1 cm.
    constexpr std::uint32_t n = 5;
    std::vector<double> points;
    std::vector<std::uint32_t> elements, fixed;
    const auto id = [](std::uint32_t i, std::uint32_t j, std::uint32_t k) { return i + n * (j + n * k); };
    for (std::uint32_t k = 0; k < n; ++k) {
        for (std::uint32_t j = 0; j < n; ++j) {
            for (std::uint32_t i = 0; i < n; ++i) {
                points.insert(points.end(), {0.01 * i, 0.01 * j, 0.01 * k});
                if (k == 0) {
                    fixed.push_back(id(i, j, k));
                }
                if (i + 1 < n && j + 1 < n && k + 1 < n) {
                    const std::uint32_t a = id(i, j, k), b = id(i + 1, j, k), c = id(i + 1, j + 1, k), d = id(i, j + 1, k);
                    const std::uint32_t e = id(i, j, k + 1), f = id(i + 1, j, k + 1), g = id(i + 1, j + 1, k + 1),
                                        h = id(i, j + 1, k + 1);
                    for (const auto &element : std::array<std::array<std::uint32_t, 4>, 6>{
                             {{a, b, c, g}, {a, c, d, g}, {a, d, h, g}, {a, h, e, g}, {a, e, f, g}, {a, f, b, g}}}) {
                        elements.insert(elements.end(), element.begin(), element.end());
                    }
                }
            }
        }
    }
    auto body = palpate::make<PalpateTetrahedra>();
    body.points_m = points.data();
    body.point_count = points.size() / 3;
    body.elements = elements.data();
    body.element_count = elements.size() / 4;
    body.fixed_nodes = fixed.data();
    body.fixed_count = fixed.size();
    auto setup = palpate::Setup::tetrahedra(body);
    setup.model("patch").sphere(0.006).virtual_time().share_contacts();
    setup.path({0.0, 0.3, 1.0}, {0.021, 0.019, 0.05, 0.021, 0.019, 0.041, 0.021, 0.019, 0.041});
    setup.duration(0.6);
    auto session = std::move(setup).start();
    palpate::Surface surface;
    session.wait(0.5);
    session.surface(surface);
    EXPECT(surface.positions_m.size() == points.size() && surface.triangles.size() == 3 * 6 * 2 * 4 * 4);
    const auto contacts = session.contacts();
    EXPECT(!contacts.empty());
    for (const PalpateContact &contact : contacts) {
        EXPECT(contact.size == sizeof contact && contact.tool == 0 && contact.normal[2] > 0.5f);
        EXPECT(std::abs(contact.place_m[2] - 0.037f) < 0.006f);
        EXPECT(contact.mode == PALPATE_CONTACT_MODE_STICK || contact.mode == PALPATE_CONTACT_MODE_SLIP);
    }
    EXPECT(!session.ended());
    session.wait(1.0);
    EXPECT(session.ended() && session.stop().peak_force_n > 0.01);
}

static void what_fails_throws_and_ownership_moves() {
    EXPECT(thrown([] { palpate::Setup::file("no/such.toml"); }) == PALPATE_CODE_IO);
    EXPECT(thrown([] { palpate::Setup::toml("[body]"); }) == PALPATE_CODE_SCENE);
    auto setup = block();
    EXPECT(thrown([&] { setup.model("none"); }) == PALPATE_CODE_BAD_ARGUMENT);
    auto moved = std::move(setup);
    EXPECT(thrown([&] { moved.model("patch"); }) == PALPATE_CODE_OK);
    auto first = std::move(moved).start_hosted(device());
    EXPECT(thrown([&] { moved.model("patch"); }) == PALPATE_CODE_BAD_HANDLE);  // NOLINT: used up on purpose
    auto second = std::move(first);
    EXPECT(thrown([&] { first.attach(); }) == PALPATE_CODE_BAD_HANDLE);
    const auto loop = second.attach();
    auto command = palpate::make<PalpateCommand>();
    std::thread([&] { EXPECT(loop.tick(at(0.024, 0.052), command) == PALPATE_CODE_WRONG_THREAD); }).join();
    EXPECT(loop.tick(at(0.024, 0.052), command) == PALPATE_CODE_OK);
    second.set_friction(0.3);
    second.stop();
    EXPECT(thrown([&] { second.stop(); }) == PALPATE_CODE_BAD_HANDLE);
    // What is destroyed is stopped.
    { auto dropped = block().start_hosted(device()); }
}

int main() {
    virtual_time_gives_the_same_forces_every_time();
    a_stop_that_is_asked_for_brings_the_force_to_rest_in_the_ticks_that_follow();
    a_session_with_an_end_ends();
    a_scene_with_a_pointer_takes_the_device_of_the_host();
    one_thread_ticks_two_sessions();
    two_devices_feel_two_forces();
    tetrahedra_from_arrays();
    what_fails_throws_and_ownership_moves();
    if (failures == 0) {
        std::puts("the wrapper holds what it promises");
    }
    return failures == 0 ? 0 : 1;
}
