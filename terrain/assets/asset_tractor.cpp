// A farm tractor with a cab. Tyres are 520/70 R38 and 420/70 R28, a pair that John Deere approves
// (operator's manual OMAL161979, tire combinations, group A); all other dimensions and the shape
// are our own, those of a tractor of about 75 kW.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <numbers>
#include <tuple>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"
#include "terrain/assets/asset_wheel.h"

namespace groundray {
namespace {

struct FarmTractor {
  static constexpr double inch = 0.0254;
  static constexpr double rear_rim = 38 * inch / 2, rear_width = 0.520;
  static constexpr double front_rim = 28 * inch / 2, front_width = 0.420;
  static constexpr double rear_radius = rear_rim + 0.70 * rear_width;
  static constexpr double front_radius = front_rim + 0.70 * front_width;
  static constexpr double wheelbase = 2.40, track = 1.80;
  static constexpr double rear = -wheelbase / 2, front = wheelbase / 2;  // axles
  static constexpr double roof = 2.72;
};

// Rounded rectangle in the plane of a constant z.
Section level_rectangle(double z, const glm::dvec2& low, const glm::dvec2& high, double radius) {
  Section section = round_rectangle(z, low, high, radius);
  for (glm::dvec3& p : section) p = {p.y, p.z, p.x};
  return section;
}

class TractorMaker {
 public:
  TractorMaker(AssetBuilder& builder, AssetShape& shape)
      : builder_(builder), detail_(shape.detail) {
    constexpr std::array<glm::vec3, 4> paints = {{{0.035f, 0.16f, 0.03f},
                                                  {0.36f, 0.025f, 0.02f},
                                                  {0.025f, 0.09f, 0.30f},
                                                  {0.45f, 0.13f, 0.012f}}};
    const double paint = shape.random.between(0, paints.size());
    const auto shade = static_cast<float>(shape.random.between(0.85, 1.15));
    paint_ = builder.surface("paint", paints[static_cast<std::size_t>(paint)] * shade);
    dark_ = builder.surface("trim", {0.03f, 0.03f, 0.03f});
    glass_ = builder.surface("glass", {0.03f, 0.035f, 0.036f});
    rim_ = builder.surface("rim", {0.45f, 0.44f, 0.40f});
    lamp_ = builder.surface("lamp", {0.55f, 0.56f, 0.57f});
    signal_ = builder.surface("tail_lamp", {0.45f, 0.12f, 0.01f});
    tyre_ = builder.surface("tyre", {0.025f, 0.025f, 0.026f});
  }

  void add() {
    add_chassis();
    add_hood();
    add_cab();
    for (const double side : {-1.0, 1.0}) {
      add_wheels(side);
      add_fenders(side);
      add_side(side);
    }
    add_hitch();
  }

 private:
  using T = FarmTractor;

  void add_box(const glm::dvec3& low, const glm::dvec3& high, double radius,
               std::uint16_t surface) {
    add_block(builder_, low, high, radius, surface);
  }

  void add_rod(const glm::dvec3& a, const glm::dvec3& b, double radius, std::uint16_t surface) {
    const std::array<TubeRing, 2> rings = {{{a, radius}, {b, radius}}};
    add_pipe(builder_, rings, 12, surface);
  }

  void add_drum(const glm::dvec3& centre, int axis, double half, double radius,
                std::uint16_t surface) {
    const double edge = 0.12 * std::min(half, radius);
    const std::array<LatheRing, 6> rings = {{{-half, 0, surface},
                                             {-half, radius - edge, surface},
                                             {-half + edge, radius, surface},
                                             {half - edge, radius, surface},
                                             {half, radius - edge, surface},
                                             {half, 0, surface}}};
    add_lathe(builder_, centre, axis, rings, 24);
  }

  void add_chassis() {
    add_box({-1.25, -0.24, 0.62}, {-0.10, 0.24, 1.16}, 0.06, dark_);  // gearbox
    add_box({-0.15, -0.20, 0.66}, {1.05, 0.20, 1.12}, 0.05, dark_);   // engine
    add_box({0.95, -0.17, 0.74}, {2.02, 0.17, 1.02}, 0.03, dark_);    // front frame
    add_drum({T::rear, 0, T::rear_radius}, 1, 0.62, 0.15, dark_);     // rear axle
    add_drum({T::rear, 0, T::rear_radius}, 1, 0.34, 0.24, dark_);
    add_drum({T::front, 0, T::front_radius - 0.02}, 1, 0.68, 0.085, dark_);
    add_drum({T::front, 0, T::front_radius - 0.02}, 1, 0.20, 0.15, dark_);
    for (const double side : {-1.0, 1.0}) {
      add_drum({T::front, side * 0.66, T::front_radius - 0.01}, 2, 0.16, 0.08, dark_);
      add_rod({T::front - 0.16, side * 0.10, T::front_radius},
              {T::front - 0.14, side * 0.62, T::front_radius}, 0.022, rim_);
    }
    // Front weights: plates side by side.
    add_box({1.98, -0.20, 0.70}, {2.14, 0.20, 0.92}, 0.02, dark_);
    for (int i = 0; i < 8; ++i) {
      const double y = -0.28 + 0.08 * i;
      add_box({2.08, y - 0.036, 0.56}, {2.34, y + 0.036, 0.94}, 0.02, dark_);
    }
  }

  void add_hood() {
    const auto section = [](double x, double half, double low, double high, double radius) {
      return round_rectangle(x, {-half, low}, {half, high}, radius);
    };
    const std::vector<Section> shell = {
        section(0.12, 0.355, 1.02, 1.735, 0.11), section(0.14, 0.37, 1.00, 1.75, 0.12),
        section(0.60, 0.365, 1.00, 1.74, 0.13),  section(1.20, 0.345, 1.00, 1.70, 0.14),
        section(1.70, 0.325, 0.98, 1.63, 0.14),  section(1.95, 0.305, 0.97, 1.56, 0.14),
        section(2.05, 0.28, 0.98, 1.49, 0.14),   section(2.10, 0.23, 1.02, 1.40, 0.14)};
    add_sweep(builder_, shell, paint_);
    // Grilles and lamps in the nose, louvres at the sides, the exhaust and the air intake.
    add_box({1.98, -0.20, 1.02}, {2.115, 0.20, 1.34}, 0.02, dark_);
    for (int i = 0; i < 5; ++i) {
      const double z = 1.07 + 0.055 * i;
      add_box({2.09, -0.19, z - 0.008}, {2.125, 0.19, z + 0.008}, 0.003, rim_);
    }
    for (const double side : {-1.0, 1.0}) {
      add_drum({2.055, side * 0.165, 1.40}, 0, 0.04, 0.065, lamp_);
      add_box({0.70, std::min(side * 0.33, side * 0.366), 1.14},
              {1.62, std::max(side * 0.33, side * 0.366), 1.50}, 0.01, dark_);
      for (int i = 0; i < 9; ++i) {
        const double x = 0.78 + 0.095 * i;
        add_box({x - 0.012, std::min(side * 0.35, side * 0.374), 1.17},
                {x + 0.012, std::max(side * 0.35, side * 0.374), 1.47}, 0.004, paint_);
      }
      // A light stripe.
      add_box({0.20, std::min(side * 0.34, side * 0.374), 1.56},
              {1.30, std::max(side * 0.34, side * 0.374), 1.60}, 0.004, rim_);
    }
    const std::array<TubeRing, 6> exhaust = {{{{0.16, -0.50, 1.10}, 0.05},
                                              {{0.16, -0.50, 1.50}, 0.05},
                                              {{0.16, -0.50, 1.52}, 0.075},
                                              {{0.16, -0.50, 2.15}, 0.075},
                                              {{0.16, -0.50, 2.17}, 0.045},
                                              {{0.14, -0.50, 2.60}, 0.045}}};
    add_pipe(builder_, exhaust, 16, dark_);
  }

  void add_cab() {
    // Body below the panes, panes, posts and roof.
    const std::vector<Section> base = {level_rectangle(0.98, {-1.02, -0.48}, {-0.02, 0.48}, 0.05),
                                       level_rectangle(1.30, {-1.30, -0.56}, {0.10, 0.56}, 0.06),
                                       level_rectangle(1.48, {-1.48, -0.60}, {0.12, 0.60}, 0.06)};
    add_sweep(builder_, base, dark_);
    const std::vector<Section> panes = {level_rectangle(1.44, {-1.46, -0.62}, {0.10, 0.62}, 0.05),
                                        level_rectangle(1.95, {-1.52, -0.70}, {0.08, 0.70}, 0.06),
                                        level_rectangle(2.52, {-1.46, -0.66}, {-0.04, 0.66}, 0.06)};
    add_sweep(builder_, panes, glass_);
    for (const double side : {-1.0, 1.0}) {
      const auto post = [&](double x0, double x1, double x2, double radius) {
        const std::array<TubeRing, 3> rings = {{{{x0, side * 0.60, 1.42}, radius},
                                                {{x1, side * 0.68, 1.95}, radius},
                                                {{x2, side * 0.64, 2.55}, radius}}};
        add_pipe(builder_, rings, 10, dark_);
      };
      post(0.07, 0.05, -0.07, 0.042);
      post(-1.43, -1.49, -1.43, 0.042);
      const std::array<TubeRing, 3> middle = {{{{-0.78, side * 0.625, 1.42}, 0.03},
                                               {{-0.80, side * 0.705, 1.95}, 0.03},
                                               {{-0.80, side * 0.665, 2.55}, 0.03}}};
      add_pipe(builder_, middle, 8, dark_);
      // Mirrors on arms, work lights under the roof.
      add_rod({0.02, side * 0.66, 2.30}, {0.18, side * 0.98, 2.32}, 0.014, dark_);
      add_box({0.15, side * 1.0 - 0.09, 2.06}, {0.21, side * 1.0 + 0.09, 2.36}, 0.025, dark_);
      for (const double x : {0.145, -1.625})
        add_box({x - 0.03, side * 0.55 - 0.09, 2.53}, {x + 0.03, side * 0.55 + 0.09, 2.61}, 0.015,
                lamp_);
    }
    const std::vector<Section> roof = {
        level_rectangle(2.48, {-1.56, -0.70}, {0.08, 0.70}, 0.10),
        level_rectangle(2.53, {-1.64, -0.78}, {0.16, 0.78}, 0.14),
        level_rectangle(2.62, {-1.64, -0.78}, {0.16, 0.78}, 0.16),
        level_rectangle(2.69, {-1.58, -0.71}, {0.09, 0.71}, 0.18),
        level_rectangle(T::roof, {-1.42, -0.55}, {-0.10, 0.55}, 0.20)};
    add_sweep(builder_, roof, paint_);
  }

  void add_wheels(double side) {
    const double y = side * T::track / 2;
    add_wheel(builder_,
              {.centre = {T::rear, y, T::rear_radius},
               .radius = T::rear_radius,
               .width = T::rear_width,
               .rim = T::rear_rim,
               .outer = side,
               .tread = Tread::Bars,
               .count = 21,
               .height = 0.05,
               .spokes = 0,
               .dish = 0.42},
              {tyre_, rim_, dark_}, detail_);
    add_wheel(builder_,
              {.centre = {T::front, side * (T::track / 2 - 0.02), T::front_radius},
               .radius = T::front_radius,
               .width = T::front_width,
               .rim = T::front_rim,
               .outer = side,
               .tread = Tread::Bars,
               .count = 18,
               .height = 0.042,
               .spokes = 0,
               .dish = 0.36},
              {tyre_, rim_, dark_}, detail_);
    // Nuts round the hubs.
    for (const auto& [x, radius, out] : {std::tuple{T::rear, T::rear_radius, 0.045},
                                         std::tuple{T::front, T::front_radius, 0.06}}) {
      for (int i = 0; i < 8; ++i) {
        const double angle = std::numbers::pi / 4 * i;
        add_drum({x + 0.15 * math::cos(angle), y + side * out, radius + 0.15 * math::sin(angle)}, 1,
                 0.03, 0.018, dark_);
      }
    }
  }

  // A curved sheet over a wheel: from an angle behind the top to one ahead of it.
  void add_arc(double x, double z, double radius, double y_in, double y_out, double from, double to,
               std::uint16_t surface) {
    std::vector<Section> sections;
    constexpr int steps = 18;
    const auto [low, high] = std::minmax({y_in, y_out});
    for (int i = 0; i <= steps; ++i) {
      const double angle = from + (to - from) * i / steps;  // from the top, positive ahead
      const double s = math::sin(angle), c = math::cos(angle);
      const auto at = [&](double r, double y) { return glm::dvec3(x + r * s, y, z + r * c); };
      sections.push_back({at(radius, high), at(radius + 0.035, high - 0.02),
                          at(radius + 0.035, low + 0.02), at(radius, low)});
    }
    add_sweep(builder_, sections, surface);
  }

  void add_fenders(double side) {
    add_arc(T::rear, T::rear_radius, T::rear_radius + 0.10, side * 0.58, side * 1.10, -1.25, 0.95,
            paint_);
    add_arc(T::front, T::front_radius, T::front_radius + 0.07, side * 0.72, side * 1.06, -1.0, 0.45,
            dark_);
    add_rod({T::front, side * 0.64, T::front_radius + 0.05},
            {T::front, side * 0.80, 2 * T::front_radius + 0.08}, 0.02, dark_);
    // Lamps on the rear fender.
    add_box({-2.02, side * 0.96 - 0.10, 1.30}, {-1.97, side * 0.96 + 0.10, 1.40}, 0.015, signal_);
    add_rod({-1.96, side * 0.90, 1.33}, {-2.0, side * 0.94, 1.34}, 0.02, dark_);
  }

  // Steps and the tank on the left, the tool box and a step on the right.
  void add_side(double side) {
    add_box({-0.32, std::min(side * 0.26, side * 0.62), 0.62},
            {0.30, std::max(side * 0.26, side * 0.62), 0.98}, 0.06, dark_);
    for (int i = 0; i < 3; ++i) {
      const double z = 0.48 + 0.27 * i, y = side * (0.78 - 0.05 * i);
      add_box({-0.24, y - 0.12, z}, {0.16, y + 0.12, z + 0.03}, 0.01, dark_);
    }
    for (const double x : {-0.245, 0.165})
      add_rod({x, side * 0.88, 0.47}, {x, side * 0.66, 1.12}, 0.016, dark_);
    add_rod({0.20, side * 0.64, 1.25}, {0.13, side * 0.74, 1.95}, 0.014, dark_);
  }

  // Three-point linkage, drawbar and a power take-off.
  void add_hitch() {
    for (const double side : {-1.0, 1.0}) {
      add_rod({-1.25, side * 0.24, 0.60}, {-2.10, side * 0.42, 0.56}, 0.035, dark_);
      add_rod({-1.40, side * 0.28, 1.20}, {-1.80, side * 0.36, 0.58}, 0.025, rim_);
      add_rod({-1.15, side * 0.20, 1.16}, {-1.45, side * 0.29, 1.22}, 0.04, dark_);
    }
    add_rod({-1.25, 0, 1.02}, {-1.90, 0, 0.95}, 0.028, rim_);
    add_box({-2.00, -0.05, 0.44}, {-0.90, 0.05, 0.49}, 0.012, dark_);
    add_box({-1.30, -0.20, 0.46}, {-1.22, 0.20, 0.90}, 0.02, dark_);
    add_drum({-1.36, 0, 0.72}, 0, 0.09, 0.03, rim_);
  }

  AssetBuilder& builder_;
  double detail_;
  std::uint16_t paint_ = 0, dark_ = 0, glass_ = 0, rim_ = 0, lamp_ = 0, signal_ = 0, tyre_ = 0;
};

}  // namespace

Model make_tractor(AssetShape shape) {
  AssetBuilder builder;
  TractorMaker(builder, shape).add();
  return stood(builder, shape.size_m);
}

}  // namespace groundray
