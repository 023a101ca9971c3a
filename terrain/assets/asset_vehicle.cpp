// A pickup made of closed pieces. Length, width, height, wheelbase, track, tub and tyres are those
// of a Toyota HiLux SR5 dual-cab (drive.com.au, 2022-08-26; tyre 265/65 R17); the rest of the shape
// is our own.
#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"

namespace groundray {
namespace {

using std::numbers::pi;

constexpr double body_length = 5.265, body_width = 1.855, body_height = 1.865;
constexpr double wheelbase = 3.085, track = 1.550;
constexpr double tyre_radius = (17 * 0.0254 + 2 * 0.65 * 0.265) / 2, tyre_width = 0.265;
constexpr double tub_length = 1.550, tub_depth = 0.490;
constexpr double front = wheelbase / 2 + 1.03, rear = front - body_length;
constexpr double sill = 0.45, belt = 1.14, hood = 1.06, cowl = 1.15;  // heights
constexpr double floor_z = 0.70, rail = floor_z + tub_depth;          // of the tub
constexpr double tailgate = 0.08;
constexpr double cab_rear = rear + tailgate + tub_length;
constexpr double inner = 0.60, outer = body_width / 2;  // half-widths of the hull and of its flanks
constexpr double arch_radius = 0.43;

using Profile = std::vector<glm::dvec2>;  // x and z, counter-clockwise as seen from the right

class Pickup {
 public:
  Pickup() {
    metal_ = builder_.add_surface(asset_surface("metal"));
    dark_ = builder_.add_surface(asset_surface("asphalt"));
    plate_ = builder_.add_surface(asset_surface("retro_reflector"));
    add_hull();
    for (const double side : {-1.0, 1.0}) add_flank(side);
    add_tub();
    add_cabin();
    for (const double x : {-wheelbase / 2, wheelbase / 2}) {
      for (const double side : {-1.0, 1.0}) add_wheel(x, side);
    }
    add_box({rear - 0.004, -0.26, 0.55}, {rear + 0.01, 0.26, 0.66}, plate_);
    add_box({front - 0.03, -0.55, 0.68}, {front + 0.004, 0.55, 0.86}, dark_);  // grille
  }

  Model take(double scale) {
    builder_.scale(scale);
    return builder_.take();
  }

 private:
  void add_prism(const Profile& profile, double y_low, double y_high, std::uint16_t surface) {
    std::vector<glm::dvec3> low, high;
    for (auto it = profile.rbegin(); it != profile.rend(); ++it) {  // clockwise: outward is +y
      low.emplace_back(it->x, y_low, it->y);
      high.emplace_back(it->x, y_high, it->y);
    }
    builder_.add_loft(low, high, surface);
  }

  void add_box(const glm::dvec3& low, const glm::dvec3& high, std::uint16_t surface) {
    add_prism({{low.x, low.z}, {high.x, low.z}, {high.x, high.z}, {low.x, high.z}}, low.y, high.y,
              surface);
  }

  void add_hull() {
    add_prism({{rear, 0.55},
               {rear + 0.45, 0.40},
               {front - 0.20, 0.40},
               {front, 0.55},
               {front, 0.90},
               {front - 0.14, hood},
               {1.20, cowl},
               {cab_rear, belt},
               {cab_rear, floor_z},
               {rear, floor_z}},
              -inner, inner, metal_);
  }

  // Adds the upper arc of a wheel opening, from its rear to its front.
  static void add_arch(Profile& profile, double x) {
    const double low = math::asin((sill - tyre_radius) / arch_radius);
    constexpr int pieces = 10;
    for (int i = 0; i <= pieces; ++i) {
      const double angle = pi - low - (pi - 2 * low) * i / pieces;
      profile.emplace_back(x + arch_radius * math::cos(angle),
                           tyre_radius + arch_radius * math::sin(angle));
    }
  }

  void add_flank(double side) {
    Profile fore{{cab_rear, sill}};
    add_arch(fore, wheelbase / 2);
    for (const glm::dvec2 p : {glm::dvec2(front - 0.10, sill), glm::dvec2(front - 0.06, 0.90),
                               glm::dvec2(front - 0.20, hood - 0.03), glm::dvec2(1.20, cowl - 0.02),
                               glm::dvec2(cab_rear, belt)}) {
      fore.push_back(p);
    }
    Profile aft{{rear + 0.05, sill + 0.05}};
    add_arch(aft, -wheelbase / 2);
    for (const glm::dvec2 p : {glm::dvec2(cab_rear - 0.02, sill), glm::dvec2(cab_rear - 0.02, 0.90),
                               glm::dvec2(rear, 0.90)}) {
      aft.push_back(p);
    }
    // The flanks extend into the hull, so that no corner of one piece is a corner of another.
    const auto [low, high] = std::minmax({side * (inner - 0.02), side * outer});
    add_prism(fore, low, high, metal_);
    add_prism(aft, low, high, metal_);
  }

  void add_tub() {
    constexpr double wall = outer - 0.07;
    for (const double side : {-1.0, 1.0}) {
      const auto [low, high] = std::minmax({side * wall, side * outer});
      add_box({rear, low, 0.88}, {cab_rear - 0.02, high, rail}, metal_);
    }
    add_box({rear + 0.005, -wall - 0.02, floor_z - 0.02},
            {rear + tailgate, wall + 0.02, rail - 0.01}, metal_);
  }

  // Adds the cabin above the belt line, and dark panes that protrude from its faces by 5 mm.
  void add_cabin() {
    using Rim = std::array<glm::dvec3, 4>;  // rear right, front right, front left, rear left
    const auto rim = [](double x_rear, double x_front, double half_width, double z_rear,
                        double z_front) {
      return Rim{{{x_rear, -half_width, z_rear},
                  {x_front, -half_width, z_front},
                  {x_front, half_width, z_front},
                  {x_rear, half_width, z_rear}}};
    };
    const Rim low = rim(cab_rear, 1.20, outer - 0.03, belt - 0.03, belt - 0.03);
    const Rim high = rim(cab_rear + 0.16, 0.42, 0.68, body_height, body_height);
    builder_.add_loft(low, high, metal_);
    for (std::size_t i = 0; i < 4; ++i)
      add_pane(low[i], low[(i + 1) % 4], high[i], high[(i + 1) % 4]);
  }

  void add_pane(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                const glm::dvec3& d) {
    const glm::dvec3 out = glm::normalize(glm::cross(b - a, c - a)) * 0.005;
    const auto at = [&](double s, double t) {
      return glm::mix(glm::mix(a, b, s), glm::mix(c, d, s), t);
    };
    const std::array<glm::dvec3, 4> on{at(0.07, 0.15), at(0.93, 0.15), at(0.93, 0.88),
                                       at(0.07, 0.88)};
    std::array<glm::dvec3, 4> low, high;
    for (std::size_t i = 0; i < 4; ++i) {
      low[i] = on[i] - out;
      high[i] = on[i] + out;
    }
    builder_.add_loft(low, high, dark_);
  }

  void add_disc(const glm::dvec3& center, double radius, double half_width, int sides,
                std::uint16_t surface) {
    std::vector<glm::dvec3> low, high;
    for (int i = 0; i < sides; ++i) {
      // Starts at the ground, so that the wheel stands on a corner and its height is exact.
      const double angle = -pi / 2 - 2 * pi * i / sides;
      const glm::dvec3 rim = center + radius * glm::dvec3(math::cos(angle), 0, math::sin(angle));
      low.push_back(rim - glm::dvec3(0, half_width, 0));
      high.push_back(rim + glm::dvec3(0, half_width, 0));
    }
    builder_.add_loft(low, high, surface);
  }

  void add_wheel(double x, double side) {
    const glm::dvec3 center{x, side * track / 2, tyre_radius};
    add_disc(center, tyre_radius, tyre_width / 2, 32, dark_);
    add_disc(center, 17 * 0.0254 / 2, tyre_width / 2 + 0.008, 24, metal_);
  }

  AssetBuilder builder_;
  std::uint16_t metal_ = 0;
  std::uint16_t dark_ = 0;
  std::uint16_t plate_ = 0;
};

}  // namespace

Model make_vehicle(AssetShape shape) {
  // The grille and the plate protrude by 4 mm each.
  return Pickup().take(shape.size_m / (body_length + 0.008));
}

}  // namespace groundray
