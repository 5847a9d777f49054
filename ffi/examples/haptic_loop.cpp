// A loop in the style of a CHAI3D application: a device class, a haptics thread that reads, computes and writes, a graphics thread that
// draws. What CHAI3D would compute with a mesh, palpate computes: one call in the haptics thread.
//
// The device is simulated: a mass in a hand that presses it down into the block and lifts it again. Put a cGenericHapticDevicePtr in
// its place. Runs two seconds of real time.

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <thread>

#include "palpate.hpp"

using Clock = std::chrono::steady_clock;
using Vector = std::array<double, 3>;

/// A device in a hand: a mass on a spring whose other end the hand moves. The names are those of CHAI3D.
class SimulatedDevice {
public:
    static constexpr double max_force_n = 8.0;

    Vector getPosition() const { return position_; }
    Vector getLinearVelocity() const { return velocity_; }
    void setForce(const Vector &force) { force_ = force; }

    /// What the hand does until `time_s`, in steps of a quarter of a millisecond.
    void move(double time_s) {
        constexpr double mass_kg = 0.1, spring_n_per_m = 400.0, damper_n_s_per_m = 12.0, step_s = 0.25e-3;
        for (; now_s_ < time_s; now_s_ += step_s) {
            const double depth_m = 0.015 * std::sin(std::min(now_s_ / 1.8, 1.0) * 3.14159);
            const Vector wanted = {0.048, 0.052, 0.105 - depth_m};
            for (int axis = 0; axis < 3; ++axis) {
                const double pull = spring_n_per_m * (wanted[axis] - position_[axis]) - damper_n_s_per_m * velocity_[axis];
                velocity_[axis] += step_s / mass_kg * (pull + force_[axis]);
                position_[axis] += step_s * velocity_[axis];
            }
        }
    }

private:
    Vector position_ = {0.048, 0.052, 0.105}, velocity_ = {}, force_ = {};
    double now_s_ = 0.0;
};

/// What the haptics thread leaves behind.
struct Felt {
    double most_n = 0.0;
    long ticks = 0;
    PalpateCode ended_by = PALPATE_CODE_OK;
};

/// The haptics thread: as fast as its device, here a little faster than 1 kHz.
static Felt haptics(const palpate::Session &session, SimulatedDevice &device) {
    Felt felt;
    const palpate::Loop loop = session.attach();
    auto state = palpate::make<PalpateState>();
    auto command = palpate::make<PalpateCommand>();
    const Clock::time_point start = Clock::now();
    Clock::time_point next = start;
    for (;;) {
        device.move(std::chrono::duration<double>(Clock::now() - start).count());
        const Vector position = device.getPosition(), velocity = device.getLinearVelocity();
        std::copy(position.begin(), position.end(), state.position_m);
        std::copy(velocity.begin(), velocity.end(), state.velocity_m_s);
        const PalpateCode code = loop.tick(state, command);
        if (code != PALPATE_CODE_OK) {
            device.setForce({});
            felt.ended_by = code;
            return felt;
        }
        device.setForce({command.force_n[0], command.force_n[1], command.force_n[2]});
        felt.most_n = std::max(felt.most_n, command.force_n[2]);
        felt.ticks += command.is_new;
        next += std::chrono::microseconds(900);
        std::this_thread::sleep_until(next);
    }
}

int main() try {
    auto block = palpate::make<PalpateBlock>();
    block.fixed_faces = 1u << 4;  // It stands on a table.
    for (int axis = 0; axis < 3; ++axis) {
        block.nodes[axis] = 8;
        block.size_m[axis] = 0.1;
    }
    SimulatedDevice device;
    auto capabilities = palpate::make<PalpateDevice>();
    capabilities.max_force_n = SimulatedDevice::max_force_n;
    const Vector begin = device.getPosition();
    std::copy(begin.begin(), begin.end(), capabilities.position_m);

    auto setup = palpate::Setup::block(block);
    setup.friction(0.4).model("patch").share_contacts();
    auto session = std::move(setup).start_hosted(capabilities);

    Felt felt;
    std::thread haptics_thread([&] { felt = haptics(session, device); });

    // The graphics thread: 20 pictures a second, of which this example prints what it would draw.
    palpate::Surface surface;
    double lowest_m = 1.0;
    for (int picture = 0; picture < 40; ++picture) {
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        session.surface(surface);
        double top_m = 1.0;
        // The middle of the upper face: nodes are numbered along x, then y, then z.
        for (std::size_t node : {448 + 27, 448 + 28, 448 + 35, 448 + 36}) {
            top_m = std::min(top_m, surface.positions_m[3 * node + 2]);
        }
        lowest_m = std::min(lowest_m, top_m);
        if (picture % 8 == 7) {
            const PalpateTool tool = session.tool();
            std::printf("%.2f s  tool at %.4f m, surface at %.4f m, %.3f N, %zu contacts\n", tool.time_s, tool.position_m[2],
                        top_m, tool.commanded_force_n[2], session.contacts().size());
        }
    }

    // The force goes to rest in the ticks that follow; then the loop ends by itself.
    session.request_stop();
    haptics_thread.join();
    const PalpateSummary summary = session.stop();
    std::printf("%ld new forces in %.2f s, %llu resyncs, at most %.3f N felt; the surface went down to %.4f m\n", felt.ticks,
                summary.duration_s, static_cast<unsigned long long>(summary.resyncs), felt.most_n, lowest_m);
    const bool good = felt.ended_by == PALPATE_CODE_ENDED && felt.most_n > 0.1 && lowest_m < 0.099;
    if (!good) {
        std::fprintf(stderr, "nothing was felt, or the loop ended by %s\n", palpate_code_name(felt.ended_by));
    }
    return good ? 0 : 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
