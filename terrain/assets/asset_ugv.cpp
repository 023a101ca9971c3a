// A skid-steered unmanned ground vehicle. Length and height of the body, wheelbase, track and
// wheels are those of a Clearpath Husky A200 (husky_description of github.com/husky/husky, BSD
// licence: base 0.9874 x 0.2475 m, wheelbase 0.5120, track 0.5708, wheels 0.1651 x 0.1143, axles
// 0.03282 above the bottom); the shape and the mast are our own.
#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "terrain/assets/asset_builder.h"
#include "terrain/assets/asset_kinds.h"
#include "terrain/assets/asset_shapes.h"
#include "terrain/assets/asset_wheel.h"

namespace groundray {
namespace {

struct Rover {
  static constexpr double length = 0.9874, height = 0.2475;
  static constexpr double wheelbase = 0.5120, track = 0.5708;
  static constexpr double radius = 0.1651, tyre_width = 0.1143;
  static constexpr double bottom = radius - 0.03282, top = bottom + height;
  static constexpr double half_width = 0.205;  // of the hull, between the wheels
  static constexpr double mast = 0.92;
};

class RoverMaker {
 public:
  RoverMaker(AssetBuilder& builder, double detail)
      : builder_(builder),
        detail_(detail),
        paint_(builder.surface("paint", {0.52f, 0.30f, 0.012f})),
        dark_(builder.surface("trim", {0.03f, 0.03f, 0.03f})),
        metal_(builder.surface("rim", {0.35f, 0.36f, 0.37f})),
        glass_(builder.surface("glass", {0.018f, 0.021f, 0.022f})),
        lamp_(builder.surface("lamp", {0.55f, 0.56f, 0.57f})),
        signal_(builder.surface("tail_lamp", {0.30f, 0.012f, 0.01f})) {}

  void add() {
    add_hull();
    add_bumpers();
    add_wheels();
    add_deck();
    add_mast();
  }

 private:
  // Body of revolution about z or x with a flat foot and a rounded head.
  void add_knob(const glm::dvec3& foot, int axis, double radius, double height,
                std::uint16_t surface) {
    const std::array<LatheRing, 6> rings = {{{0, 0, surface},
                                             {0, radius, surface},
                                             {0.8 * height, radius, surface},
                                             {0.95 * height, 0.85 * radius, surface},
                                             {height, 0.6 * radius, surface},
                                             {height, 0, surface}}};
    add_lathe(builder_, foot, axis, rings, 24);
  }

  void add_hull() {
    const auto section = [](double x, double width, double low, double high) {
      return round_rectangle(x, {-width, low}, {width, high}, 0.018);
    };
    const double w = Rover::half_width, low = Rover::bottom, high = Rover::top - 0.035;
    const std::vector<Section> hull = {section(-0.445, w - 0.02, low + 0.07, high - 0.05),
                                       section(-0.44, w, low + 0.06, high - 0.04),
                                       section(-0.37, w, low + 0.005, high - 0.005),
                                       section(-0.35, w, low, high),
                                       section(0.35, w, low, high),
                                       section(0.37, w, low + 0.005, high - 0.005),
                                       section(0.44, w, low + 0.06, high - 0.04),
                                       section(0.445, w - 0.02, low + 0.07, high - 0.05)};
    add_sweep(builder_, hull, dark_);
    // Painted covers on the sloping ends and the sides, in front of the hull's sheet metal.
    for (const double side : {-1.0, 1.0}) {
      const double y = side * (w + 0.004);
      add_block(builder_, {-0.33, std::min(y, y - side * 0.01), high - 0.07},
                {0.33, std::max(y, y - side * 0.01), high - 0.012}, 0.003, paint_);
      add_block(builder_, {-0.40, std::min(side * 0.235, side * 0.28), high + 0.003},
                {0.40, std::max(side * 0.235, side * 0.28), high + 0.012}, 0.004, paint_);
    }
    add_block(builder_, {-0.36, -w - 0.03, high - 0.004}, {0.36, w + 0.03, high + 0.012}, 0.005,
              paint_);
  }

  void add_bumpers() {
    for (const double end : {-1.0, 1.0}) {
      const double x = end * (Rover::length / 2 - 0.02), z = Rover::bottom + 0.10;
      const std::array<TubeRing, 6> bar = {{{{end * 0.42, -0.17, z}, 0.02},
                                            {{x - end * 0.01, -0.19, z}, 0.02},
                                            {{x, -0.16, z}, 0.02},
                                            {{x, 0.16, z}, 0.02},
                                            {{x - end * 0.01, 0.19, z}, 0.02},
                                            {{end * 0.42, 0.17, z}, 0.02}}};
      add_pipe(builder_, bar, 12, dark_);
      for (const double side : {-1.0, 1.0}) {
        const std::array<LatheRing, 4> light = {
            {{-0.012, 0, lamp_}, {-0.012, 0.022, lamp_}, {0.012, 0.022, lamp_}, {0.012, 0, lamp_}}};
        add_lathe(builder_, {end * 0.446, side * 0.14, Rover::bottom + 0.12}, 0, light, 20);
      }
    }
  }

  void add_wheels() {
    for (const double x : {-Rover::wheelbase / 2, Rover::wheelbase / 2}) {
      for (const double side : {-1.0, 1.0}) {
        const glm::dvec3 centre{x, side * Rover::track / 2, Rover::radius};
        add_wheel(builder_,
                  {.centre = centre,
                   .radius = Rover::radius,
                   .width = Rover::tyre_width,
                   .rim = 0.095,
                   .outer = side,
                   .tread = Tread::Blocks,
                   .count = 22,
                   .height = 0.012,
                   .spokes = 5,
                   .dish = 0.18},
                  {builder_.surface("tyre", {0.025f, 0.025f, 0.026f}), metal_, dark_}, detail_);
        const std::array<LatheRing, 4> axle = {
            {{-0.06, 0, dark_}, {-0.06, 0.03, dark_}, {0.06, 0.03, dark_}, {0.06, 0, dark_}}};
        add_lathe(builder_, {x, side * 0.195, Rover::radius}, 1, axle, 16);
      }
    }
  }

  void add_deck() {
    const double low = Rover::top - 0.025;
    for (const double side : {-1.0, 1.0}) {
      add_block(builder_, {-0.34, side * 0.18 - 0.0105, low},
                {0.34, side * 0.18 + 0.0105, Rover::top}, 0.003, metal_);
    }
    for (const double x : {-0.33, 0.33})
      add_block(builder_, {x - 0.0105, -0.17, low + 0.001}, {x + 0.0105, 0.17, Rover::top - 0.001},
                0.003, metal_);
    // A computer and a battery box, an antenna and the button that stops the vehicle.
    add_block(builder_, {-0.30, -0.15, low - 0.002}, {-0.02, 0.15, Rover::top + 0.075}, 0.012,
              dark_);
    for (int fin = 0; fin < 9; ++fin) {
      const double y = -0.12 + 0.03 * fin;
      add_block(builder_, {-0.28, y - 0.004, Rover::top + 0.07},
                {-0.06, y + 0.004, Rover::top + 0.09}, 0.002, metal_);
    }
    add_block(builder_, {0.10, -0.12, low - 0.003}, {0.30, 0.12, Rover::top + 0.035}, 0.01, metal_);
    add_knob({-0.31, 0.10, Rover::top - 0.005}, 2, 0.02, 0.04, signal_);
    const std::array<TubeRing, 3> whip = {{{{-0.31, -0.13, Rover::top - 0.01}, 0.008},
                                           {{-0.31, -0.13, Rover::top + 0.05}, 0.006},
                                           {{-0.315, -0.13, Rover::top + 0.34}, 0.004}}};
    add_pipe(builder_, whip, 8, dark_);
  }

  void add_mast() {
    constexpr double x = 0.03, top = Rover::mast;
    add_block(builder_, {x - 0.02, -0.02, Rover::top - 0.02}, {x + 0.02, 0.02, top}, 0.004, metal_);
    for (const double side : {-1.0, 1.0}) {
      const std::array<TubeRing, 2> brace = {
          {{{x - 0.002, side * 0.17, Rover::top - 0.01}, 0.008}, {{x, side * 0.012, 0.62}, 0.008}}};
      add_pipe(builder_, brace, 8, metal_);
    }
    // Stereo camera, plate, lidar and the antenna of a satellite receiver.
    const double eye = top - 0.14;
    add_block(builder_, {x + 0.015, -0.13, eye - 0.024}, {x + 0.06, 0.13, eye + 0.024}, 0.01,
              dark_);
    for (const double y : {-0.10, 0.10}) {
      add_knob({x + 0.055, y, eye}, 0, 0.017, 0.014, dark_);
      add_knob({x + 0.060, y, eye}, 0, 0.012, 0.011, glass_);
    }
    add_block(builder_, {x - 0.07, -0.07, top - 0.005}, {x + 0.07, 0.07, top + 0.004}, 0.003,
              metal_);
    const std::array<LatheRing, 10> lidar = {{{0, 0, metal_},
                                              {0, 0.051, metal_},
                                              {0.022, 0.0515, metal_},
                                              {0.024, 0.049, glass_},
                                              {0.056, 0.049, glass_},
                                              {0.058, 0.0515, metal_},
                                              {0.068, 0.0515, metal_},
                                              {0.072, 0.047, metal_},
                                              {0.0725, 0.02, metal_},
                                              {0.0725, 0, metal_}}};
    add_lathe(builder_, {x, 0, top + 0.003}, 2, lidar, 40);
    const std::array<TubeRing, 3> arm = {{{{x - 0.01, 0.0, top - 0.05}, 0.009},
                                          {{x - 0.12, 0.0, top - 0.05}, 0.009},
                                          {{x - 0.121, 0.0, top + 0.012}, 0.009}}};
    add_pipe(builder_, arm, 10, metal_);
    add_knob({x - 0.12, 0, top + 0.010}, 2, 0.045, 0.022, lamp_);
  }

  AssetBuilder& builder_;
  double detail_;
  std::uint16_t paint_, dark_, metal_, glass_, lamp_, signal_;
};

}  // namespace

Model make_ugv(AssetShape shape) {
  AssetBuilder builder;
  RoverMaker(builder, shape.detail).add();
  return stood(builder, shape.size_m);
}

}  // namespace groundray
