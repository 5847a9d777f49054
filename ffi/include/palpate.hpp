// palpate for C++17: palpate.h with types that free themselves. Header only; link with palpate_ffi.
//
// What fails throws palpate::Error, but for Loop::tick, which is noexcept and gives the code: it belongs into a haptic loop.
// docs/c.md explains all of it.
#ifndef PALPATE_HPP
#define PALPATE_HPP

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "palpate.h"

namespace palpate {

/// A call that failed: its code, and its text as what().
class Error : public std::runtime_error {
public:
    Error(PalpateCode code, const char *text) : std::runtime_error(text), code_(code) {}

    PalpateCode code() const noexcept { return code_; }

private:
    PalpateCode code_;
};

namespace detail {

inline void check(PalpateCode code) {
    if (code != PALPATE_CODE_OK) {
        throw Error(code, palpate_last_error());
    }
}

}  // namespace detail

/// A struct of palpate.h, all zero but for its size.
template <class T>
T make() {
    T made{};
    made.size = sizeof(T);
    return made;
}

/// The surface of a body.
struct Surface {
    double time_s = 0.0;
    /// Three numbers for each node (m).
    std::vector<double> positions_m;
    /// Three nodes for each triangle, counter-clockwise seen from outside.
    std::vector<std::uint32_t> triangles;
};

class Session;

/// A session that is being set up. Its methods can be chained.
class Setup {
public:
    static Setup file(const std::string &path) {
        return made([&](PalpateSetup *setup) { return palpate_setup_from_file(path.c_str(), setup); });
    }

    /// Paths in the text are relative to `folder`.
    static Setup toml(const std::string &text, const std::string &folder = ".") {
        return made([&](PalpateSetup *setup) { return palpate_setup_from_toml(text.c_str(), folder.c_str(), setup); });
    }

    static Setup demo() { return made(palpate_setup_demo); }

    static Setup block(const PalpateBlock &block) {
        return made([&](PalpateSetup *setup) { return palpate_setup_block(&block, setup); });
    }

    static Setup tetrahedra(const PalpateTetrahedra &body) {
        return made([&](PalpateSetup *setup) { return palpate_setup_tetrahedra(&body, setup); });
    }

    Setup(Setup &&other) noexcept : setup_(std::exchange(other.setup_, PalpateSetup{})) {}

    Setup &operator=(Setup &&other) noexcept {
        std::swap(setup_, other.setup_);
        return *this;
    }

    ~Setup() {
        if (setup_.id != 0) {
            palpate_setup_free(setup_);
        }
    }

    Setup &friction(double coefficient) { return changed(palpate_setup_friction(setup_, coefficient)); }
    Setup &model(const std::string &name) { return changed(palpate_setup_model(setup_, name.c_str())); }
    Setup &sphere(double radius_m) { return changed(palpate_setup_sphere(setup_, radius_m)); }
    Setup &rates(double haptic_hz, double global_hz) { return changed(palpate_setup_rates(setup_, haptic_hz, global_hz)); }
    Setup &duration(double seconds) { return changed(palpate_setup_duration(setup_, seconds)); }
    Setup &log(const std::string &path) { return changed(palpate_setup_log(setup_, path.c_str())); }
    Setup &virtual_time() { return changed(palpate_setup_virtual_time(setup_)); }
    Setup &switchable() { return changed(palpate_setup_switchable(setup_)); }
    Setup &share_contacts() { return changed(palpate_setup_share_contacts(setup_)); }

    /// The tool's way: `times_s`, and three numbers of `positions_m` for each.
    Setup &path(const std::vector<double> &times_s, const std::vector<double> &positions_m) {
        if (positions_m.size() != 3 * times_s.size()) {
            throw std::invalid_argument("palpate: three numbers for each time make a path");
        }
        return changed(palpate_setup_path(setup_, times_s.data(), positions_m.data(), times_s.size()));
    }

    /// Starts the session with a haptic loop of palpate's. The setup is used up.
    Session start() &&;
    /// Starts the session for a haptic loop of the host's, with its devices. The setup is used up.
    Session start_hosted(const std::vector<PalpateDevice> &devices) &&;
    Session start_hosted(const PalpateDevice &device) &&;

private:
    explicit Setup(PalpateSetup setup) : setup_(setup) {}

    template <class Make>
    static Setup made(Make make) {
        PalpateSetup setup{};
        detail::check(make(&setup));
        return Setup(setup);
    }

    Setup &changed(PalpateCode code) {
        detail::check(code);
        return *this;
    }

    PalpateSetup setup_;
};

/// The place of the calling thread in a session that the host loops. A plain value: it owns nothing.
class Loop {
public:
    /// One haptic tick: see palpate_tick. Real-time safe. `state` and `command` come from make().
    PalpateCode tick(const PalpateState &state, PalpateCommand &command) const noexcept {
        return palpate_tick(session_, &state, &command);
    }

    /// One haptic tick of several devices.
    template <std::size_t N>
    PalpateCode tick(const std::array<PalpateState, N> &states, std::array<PalpateCommand, N> &commands) const noexcept {
        return palpate_tick_all(session_, states.data(), commands.data(), N);
    }

private:
    friend class Session;
    explicit Loop(PalpateSession session) : session_(session) {}

    PalpateSession session_;
};

/// A session that runs. It is stopped when it is destroyed, at the latest.
class Session {
public:
    Session(Session &&other) noexcept : session_(std::exchange(other.session_, PalpateSession{})) {}

    Session &operator=(Session &&other) noexcept {
        std::swap(session_, other.session_);
        return *this;
    }

    ~Session() {
        if (session_.id != 0) {
            palpate_stop(session_, nullptr);
        }
    }

    /// Makes the calling thread the one that ticks: see palpate_attach.
    Loop attach() const {
        detail::check(palpate_attach(session_));
        return Loop(session_);
    }

    void wait(double seconds) const { detail::check(palpate_wait(session_, seconds)); }

    double time_s() const {
        double time = 0.0;
        detail::check(palpate_progress(session_, &time, nullptr));
        return time;
    }

    bool ended() const {
        std::int32_t ended = 0;
        detail::check(palpate_progress(session_, nullptr, &ended));
        return ended != 0;
    }

    void point(double x, double y, double z) const { detail::check(palpate_point(session_, x, y, z)); }
    void set_friction(double coefficient) const { detail::check(palpate_set_friction(session_, coefficient)); }
    void set_stiffness(double factor) const { detail::check(palpate_set_stiffness(session_, factor)); }
    void set_model(const std::string &name) const { detail::check(palpate_set_model(session_, name.c_str())); }

    /// Puts the newest surface into `surface`, whose room is used again.
    void surface(Surface &surface) const {
        std::size_t nodes = 0, triangles = 0;
        detail::check(palpate_surface_size(session_, &nodes, &triangles));
        if (surface.triangles.size() != 3 * triangles) {
            surface.triangles.resize(3 * triangles);
            detail::check(palpate_triangles(session_, surface.triangles.data(), triangles));
        }
        surface.positions_m.resize(3 * nodes);
        detail::check(palpate_surface(session_, surface.positions_m.data(), nodes, &surface.time_s));
    }

    PalpateTool tool(std::uint32_t index = 0) const {
        PalpateTool tool = make<PalpateTool>();
        detail::check(palpate_tool(session_, index, &tool));
        return tool;
    }

    std::vector<PalpateContact> contacts() const {
        std::vector<PalpateContact> contacts(64);
        std::size_t count = 0;
        PalpateCode code = palpate_contacts(session_, contacts.data(), contacts.size(), &count);
        if (count > contacts.size()) {
            contacts.resize(count);
            code = palpate_contacts(session_, contacts.data(), contacts.size(), &count);
        }
        detail::check(code);
        contacts.resize(count);
        return contacts;
    }

    /// Asks the session to end: see palpate_request_stop.
    void request_stop() const { detail::check(palpate_request_stop(session_)); }

    /// Stops the session and tells what it came to. Throws if it ended by a fault.
    PalpateSummary stop() {
        PalpateSummary summary = make<PalpateSummary>();
        detail::check(palpate_stop(std::exchange(session_, PalpateSession{}), &summary));
        return summary;
    }

    /// The report of the session that this thread stopped last.
    static std::string report() { return palpate_report(); }

private:
    friend class Setup;
    explicit Session(PalpateSession session) : session_(session) {}

    PalpateSession session_;
};

inline Session Setup::start() && {
    PalpateSession session{};
    detail::check(palpate_start(std::exchange(setup_, PalpateSetup{}), &session));
    return Session(session);
}

inline Session Setup::start_hosted(const std::vector<PalpateDevice> &devices) && {
    PalpateSession session{};
    PalpateSetup setup = std::exchange(setup_, PalpateSetup{});
    detail::check(palpate_start_hosted(setup, devices.data(), devices.size(), &session));
    return Session(session);
}

inline Session Setup::start_hosted(const PalpateDevice &device) && {
    return std::move(*this).start_hosted(std::vector<PalpateDevice>{device});
}

}  // namespace palpate

#endif  // PALPATE_HPP
