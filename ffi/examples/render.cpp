// A renderer that takes the surface: palpate owns the haptic loop, this program says where the tool is wanted and draws what it does.
//
// Draws three pictures of a tool that presses a block, into press-0.ppm to press-2.ppm, and writes the last surface to press.obj. In
// virtual time: the pictures are the same every time.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>

#include "palpate.hpp"

using Vector = std::array<double, 3>;

static Vector minus(const Vector &a, const Vector &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
static double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static Vector cross(const Vector &a, const Vector &b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
static Vector unit(const Vector &a) {
    const double length = std::sqrt(dot(a, a));
    return length > 0.0 ? Vector{a[0] / length, a[1] / length, a[2] / length} : a;
}

/// A picture with a depth for each pixel, seen from the front and above, without perspective.
class Picture {
public:
    static constexpr int side = 320;

    /// Draws a triangle of this colour (red, green, blue), the brighter the more it faces the light.
    void triangle(const std::array<Vector, 3> &corners, const Vector &colour) {
        const Vector normal = unit(cross(minus(corners[1], corners[0]), minus(corners[2], corners[0])));
        const double light = 0.25 + 0.75 * std::max(0.0, dot(normal, unit({-0.4, -0.6, 1.0})));
        std::array<Vector, 3> at;
        for (int corner = 0; corner < 3; ++corner) {
            at[corner] = seen(corners[corner]);
        }
        const double area = edge(at[0], at[1], at[2]);
        if (std::abs(area) < 1e-9) {
            return;
        }
        const auto [left, right] = std::minmax({at[0][0], at[1][0], at[2][0]});
        const auto [low, high] = std::minmax({at[0][1], at[1][1], at[2][1]});
        for (int y = first(low); y <= last(high); ++y) {
            for (int x = first(left); x <= last(right); ++x) {
                const Vector here = {x + 0.5, y + 0.5, 0.0};
                const double a = edge(at[1], at[2], here) / area, b = edge(at[2], at[0], here) / area;
                if (a >= 0.0 && b >= 0.0 && a + b <= 1.0) {
                    put(x, y, a * at[0][2] + b * at[1][2] + (1.0 - a - b) * at[2][2], light, colour);
                }
            }
        }
    }

    void write(const std::string &path) const {
        std::ofstream file(path, std::ios::binary);
        file << "P6\n" << side << ' ' << side << "\n255\n";
        for (const Vector &colour : colours_) {
            for (const double part : colour) {
                file << static_cast<char>(static_cast<int>(255.0 * part));
            }
        }
        if (!file) {
            throw std::runtime_error(path + " cannot be written");
        }
    }

    /// How many pixels show something.
    long drawn() const {
        return std::count_if(near_.begin(), near_.end(), [](double near) { return near > nothing; });
    }

private:
    /// Where a point is in the picture (pixels), and how near.
    static Vector seen(const Vector &point) {
        const Vector right = {0.8, -0.6, 0.0}, up = unit({0.36, 0.48, 0.8}), to_eye = cross(right, up);
        const Vector from_middle = minus(point, {0.05, 0.05, 0.05});
        const double scale = side / 0.19;
        return {0.5 * side + scale * dot(from_middle, right), 0.5 * side - scale * dot(from_middle, up),
                dot(from_middle, to_eye)};
    }

    static double edge(const Vector &a, const Vector &b, const Vector &c) {
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    }

    static int first(double value) { return std::clamp(static_cast<int>(std::floor(value)), 0, side - 1); }
    static int last(double value) { return std::clamp(static_cast<int>(std::ceil(value)), 0, side - 1); }

    void put(int x, int y, double near, double light, const Vector &colour) {
        const std::size_t place = static_cast<std::size_t>(y) * side + x;
        if (near > near_[place]) {
            near_[place] = near;
            colours_[place] = {light * colour[0], light * colour[1], light * colour[2]};
        }
    }

    static constexpr double nothing = -1e9;
    std::vector<double> near_ = std::vector<double>(side * side, nothing);
    std::vector<Vector> colours_ = std::vector<Vector>(side * side, Vector{1.0, 1.0, 1.0});
};

/// Draws the tool: a sphere of 16 times 8 faces.
static void draw_sphere(Picture &drawing, const double *centre, double radius_m) {
    const auto at = [&](int around, int down) -> Vector {
        const double turn = 3.14159265 * around / 8, fall = 3.14159265 * down / 8;
        return {centre[0] + radius_m * std::sin(fall) * std::cos(turn), centre[1] + radius_m * std::sin(fall) * std::sin(turn),
                centre[2] + radius_m * std::cos(fall)};
    };
    const Vector steel = {0.75, 0.8, 0.85};
    for (int around = 0; around < 16; ++around) {
        for (int down = 0; down < 8; ++down) {
            const Vector a = at(around, down), b = at(around, down + 1), c = at(around + 1, down + 1), d = at(around + 1, down);
            drawing.triangle({a, b, c}, steel);
            drawing.triangle({a, c, d}, steel);
        }
    }
}

static Vector node(const palpate::Surface &surface, std::uint32_t number) {
    const double *at = &surface.positions_m[3 * number];
    return {at[0], at[1], at[2]};
}

static void write_obj(const palpate::Surface &surface, const std::string &path) {
    std::ofstream file(path);
    for (std::size_t at = 0; at < surface.positions_m.size(); at += 3) {
        file << "v " << surface.positions_m[at] << ' ' << surface.positions_m[at + 1] << ' ' << surface.positions_m[at + 2] << '\n';
    }
    for (std::size_t at = 0; at < surface.triangles.size(); at += 3) {
        file << "f " << surface.triangles[at] + 1 << ' ' << surface.triangles[at + 1] + 1 << ' ' << surface.triangles[at + 2] + 1 << '\n';
    }
    if (!file) {
        throw std::runtime_error(path + " cannot be written");
    }
}

int main() try {
    constexpr double radius_m = 0.012;  // As in the scene.
    auto setup = palpate::Setup::toml(R"(
        [body]
        kind = "mass_spring"
        [body.block]
        nodes = [12, 12, 12]
        size_m = [0.1, 0.1, 0.1]
        fixed = ["z_min"]
        [body.material]
        node_mass_kg = 0.0005
        stiffness_n_per_m = 30.0
        damping_ratio = 0.3
        [contact]
        friction = 0.5
        [local]
        model = "predictive"
        [device]
        kind = "pointer"
        tool = { shape = "sphere", radius_m = 0.012 }
    )");
    setup.virtual_time().share_contacts();
    auto session = std::move(setup).start();

    palpate::Surface surface;
    long least = Picture::side * Picture::side;
    for (int picture = 0; picture < 3; ++picture) {
        // The tool hangs on a spring behind this place, as behind a mouse: in the upper face, and along it.
        session.point(0.03 + 0.02 * picture, 0.05, 0.1);
        session.wait(0.4);
        session.surface(surface);
        Picture drawing;
        for (std::size_t at = 0; at < surface.triangles.size(); at += 3) {
            drawing.triangle({node(surface, surface.triangles[at]), node(surface, surface.triangles[at + 1]),
                              node(surface, surface.triangles[at + 2])},
                             {0.95, 0.62, 0.55});
        }
        const PalpateTool tool = session.tool();
        draw_sphere(drawing, tool.position_m, radius_m);
        drawing.write("press-" + std::to_string(picture) + ".ppm");
        least = std::min(least, drawing.drawn());
        const auto contacts = session.contacts();
        std::printf("%.3f s  tool at (%.4f, %.4f, %.4f) m  computed force %.3f N  touches in %zu places\n", tool.time_s,
                    tool.position_m[0], tool.position_m[1], tool.position_m[2], tool.computed_force_n[2], contacts.size());
    }
    write_obj(surface, "press.obj");
    const PalpateSummary summary = session.stop();
    std::printf("%llu ticks, %llu resyncs, peak force %.3f N\n", static_cast<unsigned long long>(summary.ticks),
                static_cast<unsigned long long>(summary.resyncs), summary.peak_force_n);
    return least > 10000 && summary.peak_force_n > 0.1 ? 0 : 1;
} catch (const std::exception &error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
