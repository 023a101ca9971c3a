// A pickup with a rounded body. Length, width, height, wheelbase, track, tub and tyres are those of
// make_vehicle (Toyota HiLux SR5 dual-cab: drive.com.au, 2022-08-26; tyre 265/65 R17); the rest of
// the shape and its colours are our own. The body and its panes are solids of blended profiles, the
// wheels are bodies of revolution.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <string_view>
#include <vector>

#include "core/math.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"
#include "terrain/assets/asset_solid.h"
#include "terrain/assets/asset_wheel.h"

namespace groundray {
namespace {

struct Truck {
  static constexpr double length = 5.265 - 0.032;  // of the sheet metal, without the bumpers
  static constexpr double half_width = 1.855 / 2, height = 1.865;
  static constexpr double wheelbase = 3.085, track = 1.550;
  static constexpr double radius = (17 * 0.0254 + 2 * 0.65 * 0.265) / 2, tyre_width = 0.265;
  static constexpr double front = wheelbase / 2 + 1.03, rear = front - length;
  static constexpr double tub_floor = 0.70, rail = tub_floor + 0.490;
  static constexpr double cab_rear = rear + 0.08 + 1.550;
  static constexpr double belt = 1.13;
};

using Outline = std::vector<glm::dvec2>;  // x and z, counter-clockwise as seen from the right

// Half-width of the body: slightly barrelled below the belt line, tapered above.
double half_width_at(double x, double z) {
  const double nose = std::max(x - 1.9, 0.0);
  const double side =
      z < Truck::belt ? 0.908 - 0.10 * (z - 0.85) * (z - 0.85) : 0.900 - 0.27 * (z - Truck::belt);
  return side - 0.16 * nose * nose;
}

double extruded(const glm::dvec3& p, const Outline& outline, double edge) {
  const double side = 0.93 * (std::abs(p.y) - half_width_at(p.x, p.z));
  return blend_cut(polygon_distance({p.x, p.z}, outline), side, edge);
}

class PickupTruck {
 public:
  PickupTruck(AssetBuilder& builder, const AssetShape& shape) : builder_(builder) {
    constexpr std::array<glm::vec3, 6> paints = {{{0.62f, 0.62f, 0.61f},
                                                  {0.26f, 0.27f, 0.28f},
                                                  {0.42f, 0.03f, 0.025f},
                                                  {0.03f, 0.07f, 0.20f},
                                                  {0.04f, 0.04f, 0.042f},
                                                  {0.13f, 0.14f, 0.09f}}};
    AssetRandom random = shape.random;
    paint_ = paints[static_cast<std::size_t>(random.between(0, paints.size()))];
    paint_ *= static_cast<float>(random.between(0.85, 1.15));
    detail_ = shape.detail;
    fineness_ = 1 / std::sqrt(shape.detail);
  }

  void add() {
    add_body();
    add_glass();
    add_trim();
    add_lamps();
    add_seams();
    const WheelSurfaces wheel{builder_.surface("tyre", {0.025f, 0.025f, 0.026f}),
                              builder_.surface("rim", {0.35f, 0.36f, 0.37f}),
                              builder_.surface("trim", {0.03f, 0.03f, 0.03f})};
    for (const double x : {-Truck::wheelbase / 2, Truck::wheelbase / 2}) {
      for (const double side : {-1.0, 1.0}) {
        add_wheel(builder_,
                  {.centre = {x, side * Truck::track / 2, Truck::radius},
                   .radius = Truck::radius,
                   .width = Truck::tyre_width,
                   .rim = 17 * 0.0254 / 2,
                   .outer = side,
                   .height = 0.012,
                   .dish = 0.2},
                  wheel, detail_);
      }
    }
  }

 private:
  void solid(const Solid& of, const glm::dvec3& low, const glm::dvec3& high, double cell,
             std::string_view name, const glm::vec3& color) {
    add_solid(builder_, of, {low, high, cell * fineness_}, builder_.surface(name, color));
  }

  static double cab(const glm::dvec3& p) {
    static const Outline outline = {{-0.99, 0.95}, {1.42, 0.95},  {1.30, 1.14},
                                    {0.56, 1.765}, {0.30, 1.85},  {-0.30, Truck::height},
                                    {-0.78, 1.83}, {-0.97, 1.70}, {-1.03, 1.14}};
    return extruded(p, outline, 0.09);
  }

  static double shell(const glm::dvec3& p) {
    static const Outline outline = {{Truck::rear, 0.66},  {Truck::rear + 0.05, 0.52},
                                    {-2.0, 0.47},         {-0.9, 0.42},
                                    {1.0, 0.42},          {2.30, 0.38},
                                    {2.50, 0.44},         {Truck::front, 0.58},
                                    {Truck::front, 0.80}, {2.545, 0.98},
                                    {2.42, 1.055},        {1.95, 1.10},
                                    {1.15, 1.16},         {-1.05, 1.16},
                                    {-1.08, Truck::rail}, {Truck::rear, Truck::rail}};
    return extruded(p, outline, 0.07);
  }

  // Distance in the plane of the side from the nearer wheel's axle.
  static double from_axle(const glm::dvec3& p) {
    const double x = std::abs(p.x) - Truck::wheelbase / 2, z = p.z - Truck::radius;
    return std::sqrt(x * x + z * z);
  }

  static double body(const glm::dvec3& p) {
    double d = blend(shell(p), cab(p), 0.05);
    // Flares round the wheel openings, then the openings and the tub.
    const double r = from_axle(p), y = std::abs(p.y);
    const double flare =
        std::max({std::abs(r - 0.50) - 0.035, y - Truck::half_width, 0.80 - y, 0.44 - p.z});
    d = blend(d, flare, 0.03);
    d = blend_cut(d, -std::max(r - 0.465, 0.58 - y), 0.012);
    d = blend_cut(d,
                  -round_box(p, {Truck::rear + 0.08, -0.765, Truck::tub_floor},
                             {Truck::cab_rear - 0.05, 0.765, 2}, 0.03),
                  0.02);
    const double gap = std::max(std::abs(p.x - Truck::cab_rear + 0.005) - 0.012, 0.62 - p.z);
    return blend_cut(d, -gap, 0.008);
  }

  void add_body() {
    solid(body, {Truck::rear, -Truck::half_width, 0.37},
          {Truck::front, Truck::half_width, Truck::height}, 0.040, "paint", paint_);
  }

  // Part of the cab's skin within a region, slightly proud of it.
  static double skin(const glm::dvec3& p, double region) {
    const double d = cab(p);
    return blend_cut(blend_cut(d - 0.006, -d - 0.03, 0.008), region, 0.02);
  }

  void add_glass() {
    constexpr glm::vec3 dark{0.018f, 0.021f, 0.022f};
    static const std::array<Outline, 2> panes = {
        {{{0.17, 1.19}, {1.02, 1.19}, {0.46, 1.70}, {0.17, 1.765}},
         {{-0.86, 1.21}, {0.07, 1.19}, {0.07, 1.77}, {-0.60, 1.76}, {-0.80, 1.67}}}};
    for (const double side : {-1.0, 1.0}) {
      for (const Outline& pane : panes) {
        const auto window = [&](const glm::dvec3& p) {
          return skin(p, std::max(polygon_distance({p.x, p.z}, pane), 0.35 - side * p.y));
        };
        solid(window, {-0.9, side < 0 ? -0.93 : 0.5, 1.17}, {1.05, side < 0 ? -0.5 : 0.93, 1.8},
              0.032, "glass", dark);
      }
    }
    const auto windscreen = [](const glm::dvec3& p) {
      const double half = 0.79 - 0.32 * (p.z - 1.15);
      return skin(p, std::max({std::abs(p.y) - half, 1.20 - p.z, p.z - 1.75, 0.42 - p.x}));
    };
    solid(windscreen, {0.42, -0.8, 1.18}, {1.32, 0.8, 1.78}, 0.032, "glass", dark);
    const auto rear_window = [](const glm::dvec3& p) {
      return skin(p, std::max({std::abs(p.y) - 0.60, 1.28 - p.z, p.z - 1.66, p.x + 0.85}));
    };
    solid(rear_window, {-1.06, -0.65, 1.24}, {-0.85, 0.65, 1.7}, 0.032, "glass", dark);
  }

  void add_trim() {
    constexpr glm::vec3 dark{0.03f, 0.03f, 0.03f};
    const auto grille = [](const glm::dvec3& p) {
      const double y = std::abs(p.y);
      const double bars = std::abs(std::remainder(p.z - 0.66, 0.075)) - 0.022;
      const double frame = std::max(y - 0.50, std::abs(p.z - 0.82) - 0.135);
      const double d = body(p);
      return blend_cut(std::max(blend_cut(d - 0.012, -d - 0.04, 0.01), frame), bars, 0.008);
    };
    solid(grille, {2.4, -0.52, 0.66}, {2.62, 0.52, 0.98}, 0.020, "trim", dark);
    const auto bumper = [](const glm::dvec3& p) {
      const double d = shell(p);
      return blend_cut(blend_cut(d - 0.02, -d - 0.05, 0.02),
                       std::max({std::abs(p.z - 0.50) - 0.10, 2.28 - p.x, -p.z}), 0.02);
    };
    solid(bumper, {2.22, -0.95, 0.37}, {2.62, 0.95, 0.64}, 0.032, "trim", dark);
    const auto step = [](const glm::dvec3& p) {
      return round_box({p.x, std::abs(p.y), p.z}, {Truck::rear - 0.01, -0.1, 0.50},
                       {Truck::rear + 0.12, 0.83, 0.63}, 0.03);
    };
    solid(step, {Truck::rear - 0.03, -0.85, 0.48}, {Truck::rear + 0.14, 0.85, 0.65}, 0.032, "trim",
          dark);
    const auto floor = [](const glm::dvec3& p) {  // closes the body's underside
      return round_box(p, {-2.4, -0.62, 0.36}, {2.2, 0.62, 0.72}, 0.05);
    };
    solid(floor, {-2.4, -0.64, 0.34}, {2.2, 0.64, 0.75}, 0.06, "trim", dark);
    for (const double side : {-1.0, 1.0}) {
      const auto mirror = [side](const glm::dvec3& p) {
        const glm::dvec3 q{p.x, side * p.y, p.z};
        return blend(ellipsoid(q, {0.98, 1.005, 1.235}, {0.07, 0.105, 0.085}),
                     round_cone(q, {{0.99, 0.85, 1.15}, 0.025}, {{0.99, 0.95, 1.19}, 0.022}), 0.03);
      };
      solid(mirror, {0.88, side < 0 ? -1.13 : 0.8, 1.1}, {1.08, side < 0 ? -0.8 : 1.13, 1.34},
            0.020, "trim", dark);
      for (const double x : {0.26, -0.72}) {
        const auto handle = [side, x](const glm::dvec3& p) {
          return round_cone({p.x, side * p.y, p.z}, {{x, 0.905, 1.04}, 0.014},
                            {{x + 0.16, 0.905, 1.045}, 0.014});
        };
        solid(handle, {x - 0.02, side < 0 ? -0.93 : 0.88, 1.0},
              {x + 0.2, side < 0 ? -0.88 : 0.93, 1.07}, 0.014, "trim", dark);
      }
    }
  }

  void add_lamps() {
    for (const double side : {-1.0, 1.0}) {
      const auto within = [side](const glm::dvec3& p, const glm::dvec3& centre,
                                 const glm::dvec3& radii) {
        const double d = body(p);
        return blend_cut(blend_cut(d - 0.008, -d - 0.04, 0.01),
                         ellipsoid({p.x, side * p.y, p.z}, centre, radii), 0.015);
      };
      const auto head = [&](const glm::dvec3& p) {
        return within(p, {2.40, 0.70, 0.90}, {0.28, 0.20, 0.085});
      };
      solid(head, {2.1, side < 0 ? -0.95 : 0.45, 0.8}, {2.62, side < 0 ? -0.45 : 0.95, 1.0}, 0.016,
            "lamp", {0.55f, 0.56f, 0.57f});
      const auto tail = [&](const glm::dvec3& p) {
        return within(p, {Truck::rear, 0.88, 0.98}, {0.14, 0.12, 0.19});
      };
      solid(tail, {Truck::rear - 0.03, side < 0 ? -0.95 : 0.7, 0.78},
            {Truck::rear + 0.2, side < 0 ? -0.7 : 0.95, 1.18}, 0.016, "tail_lamp",
            {0.30f, 0.012f, 0.01f});
    }
    const auto plate = [](const glm::dvec3& p) {
      return round_box(p, {Truck::rear - 0.012, -0.26, 0.72}, {Truck::rear + 0.02, 0.26, 0.83},
                       0.006);
    };
    solid(plate, {Truck::rear - 0.02, -0.27, 0.71}, {Truck::rear + 0.03, 0.27, 0.84}, 0.03,
          "retro_reflector", glm::vec3(1));
  }

  // Half-width of the body at a height.
  static double flank(double x, double z) {
    double inside = 0.5, outside = 1;
    for (int i = 0; i < 40; ++i) {
      const double middle = (inside + outside) / 2;
      (body({x, middle, z}) < 0 ? inside : outside) = middle;
    }
    return outside;
  }

  // Gaps of the doors, of the fuel flap and of the tailgate: dark lines on the paint.
  void add_seams() {
    using Line = std::vector<glm::dvec2>;
    static const std::array<Line, 4> lines = {{{{1.08, 1.15}, {1.10, 0.95}, {1.06, 0.60}},
                                               {{0.12, 1.78}, {0.12, 1.15}, {0.10, 0.56}},
                                               {{-0.90, 1.16}, {-0.88, 0.95}, {-0.72, 0.80}},
                                               {{1.04, 0.56}, {0.10, 0.53}, {-0.86, 0.56}}}};
    const std::uint16_t dark = builder_.surface("trim", {0.03f, 0.03f, 0.03f});
    for (const double side : {-1.0, 1.0}) {
      for (const Line& line : lines) {
        std::vector<TubeRing> rings;
        for (std::size_t i = 0; i + 1 < line.size(); ++i) {
          constexpr int pieces = 6;
          for (int k = i == 0 ? 0 : 1; k <= pieces; ++k) {
            const glm::dvec2 p = glm::mix(line[i], line[i + 1], double(k) / pieces);
            rings.push_back({{p.x, side * flank(p.x, p.y), p.y}, 0.004});
          }
        }
        add_pipe(builder_, rings, 4, dark);
      }
    }
  }

  AssetBuilder& builder_;
  glm::vec3 paint_{0};
  double detail_ = 1, fineness_ = 1;
};

}  // namespace

Model make_pickup(AssetShape shape) {
  AssetBuilder builder;
  PickupTruck(builder, shape).add();
  return stood(builder, shape.size_m);
}

}  // namespace groundray
