// Soil, mud, gravel, sand and rock. docs/reference/textures.md states the sizes and their sources.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/math.h"
#include "terrain/textures/kinds.h"
#include "terrain/textures/shapes.h"

namespace groundray::ground {
namespace {

// Returns a stone of this diameter at a place; angular ones have facets.
Stone stone(Site& site, glm::vec2 middle, double diameter_m, double angular) {
  Dice& dice = site.dice;
  const double half_m = diameter_m / 2, flat = dice.between(0.6, 1);
  Stone made;
  made.middle = middle;
  made.along = site.direction();
  made.half_long = static_cast<float>(half_m) * site.canvas.px_per_m();
  made.half_short = made.half_long * static_cast<float>(dice.between(0.62, 0.95));
  made.height_m = static_cast<float>(half_m * flat);
  for (Stone::Cut& cut : made.cuts) {
    const double steep = angular * dice.between(0.2, 1.1);
    cut.slope = site.direction() * static_cast<float>(steep);
    cut.level = static_cast<float>(dice.between(0.55, 0.85) + 0.35 * (1 - angular));
  }
  made.pattern = static_cast<std::uint32_t>(dice.seed());
  made.spots = &site.spots;
  return made;
}

glm::vec3 stone_color(Dice& dice) {
  static constexpr std::array<glm::vec3, 6> palette{{{0.23f, 0.22f, 0.205f},
                                                     {0.175f, 0.165f, 0.15f},
                                                     {0.29f, 0.265f, 0.225f},
                                                     {0.24f, 0.195f, 0.155f},
                                                     {0.36f, 0.34f, 0.31f},
                                                     {0.130f, 0.125f, 0.118f}}};
  const auto i = static_cast<std::size_t>(dice.unit() * palette.size());
  return palette[i] * static_cast<float>(dice.between(0.8, 1.25));
}

// Places discs at random so that none overlaps another by much: the largest first.
class Packing {
 public:
  Packing(int side, double cell_px)
      : side_(side),
        cells_(std::max(1, static_cast<int>(side / cell_px))),
        lists_(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_)) {}

  // Returns whether a disc of `radius` fits, and keeps it if so.
  bool add(glm::vec2 at, float radius) {
    const int column = cell(at.x), row = cell(at.y);
    for (int y = row - 1; y <= row + 1; ++y) {
      for (int x = column - 1; x <= column + 1; ++x) {
        for (const auto& [other, reach] : list(x, y)) {
          glm::vec2 gap = glm::abs(other - at);
          gap = glm::min(gap, static_cast<float>(side_) - gap);
          const float least = 0.86f * (radius + reach);
          if (glm::dot(gap, gap) < least * least) return false;
        }
      }
    }
    list(column, row).emplace_back(at, radius);
    return true;
  }

 private:
  int cell(float at) const {
    return std::min(static_cast<int>(at * static_cast<float>(cells_) / static_cast<float>(side_)),
                    cells_ - 1);
  }
  std::vector<std::pair<glm::vec2, float>>& list(int x, int y) {
    const auto wrapped = [&](int i) { return static_cast<std::size_t>((i + cells_) % cells_); };
    return lists_[wrapped(y) * static_cast<std::size_t>(cells_) + wrapped(x)];
  }
  int side_, cells_;
  std::vector<std::vector<std::pair<glm::vec2, float>>> lists_;
};

// Appends crumbs of soil: rounded, of about the soil's colour.
void add_crumbs(Site& site, double per_m2, double smallest_m, double largest_m, const Field& bumps,
                double bump_m, glm::vec3 color, std::vector<Stone>& into) {
  Dice& dice = site.dice;
  for (int i = site.count(per_m2); i > 0; --i) {
    const double diameter_m = dice.logarithmic(smallest_m, largest_m);
    Stone crumb = stone(site, site.place(), diameter_m, 0.3);
    const float ground_m = static_cast<float>(bump_m) * bumps.at(static_cast<int>(crumb.middle.x),
                                                                 static_cast<int>(crumb.middle.y));
    crumb.z_m = ground_m - static_cast<float>(diameter_m * dice.between(0, 0.25));
    crumb.color = color * static_cast<float>(dice.between(0.8, 1.25));
    crumb.mottle = 0.12f;
    crumb.uneven = 0.3f;
    into.push_back(crumb);
  }
}

void add_stones(Site& site, double per_m2, double smallest_m, double largest_m, const Field& bumps,
                double bump_m, std::vector<Stone>& into) {
  Dice& dice = site.dice;
  for (int i = site.count(per_m2); i > 0; --i) {
    const double diameter_m = dice.logarithmic(smallest_m, largest_m);
    Stone made = stone(site, site.place(), diameter_m, 0.7);
    made.z_m = static_cast<float>(bump_m) *
                   bumps.at(static_cast<int>(made.middle.x), static_cast<int>(made.middle.y)) -
               static_cast<float>(0.2 * diameter_m);
    made.color = stone_color(dice);
    into.push_back(made);
  }
}

// Short pieces of straw and roots.
void lay_straw(Site& site, double per_m2, double z_m) {
  Dice& dice = site.dice;
  const float px = site.canvas.px_per_m();
  std::vector<Strip> straws;
  for (int i = site.count(per_m2); i > 0; --i) {
    Strip straw;
    straw.begin = site.place();
    straw.along = site.direction();
    straw.length = static_cast<float>(dice.logarithmic(0.008, 0.05)) * px;
    straw.half_begin = straw.half_end = static_cast<float>(dice.between(0.0004, 0.001)) * px;
    straw.z_begin_m = straw.z_end_m = static_cast<float>(z_m);
    straw.round_m = 0.0008f;
    straw.color_begin = straw.color_end =
        glm::vec3(0.30f, 0.235f, 0.14f) * static_cast<float>(dice.between(0.5, 1.2));
    straws.push_back(straw);
  }
  lay(site.canvas, std::span<const Strip>(straws));
}

float smooth_step(float low, float high, float value) noexcept {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

}  // namespace

Finish make_bare_soil(Site& site) {
  const glm::vec3 color(0.175f, 0.120f, 0.075f);
  constexpr double bump_m = 0.006;
  const Field bumps = site.noise(0.4, 0.003, 0.75), moist = site.noise(0.7, 0.02, 0.6);
  fill(site.canvas, [&](int x, int y) {
    const float light = 1 + 0.13f * moist.at(x, y) + 0.10f * site.spots.at(x, y);
    return Texel{static_cast<float>(bump_m) * bumps.at(x, y), color * light, 0.95f};
  });
  std::vector<Stone> stones;
  add_crumbs(site, 22000, 0.002, 0.006, bumps, bump_m, color, stones);
  add_crumbs(site, 1600, 0.006, 0.022, bumps, bump_m, color, stones);
  add_stones(site, 70, 0.005, 0.035, bumps, bump_m, stones);
  lay(site.canvas, std::span<const Stone>(stones));
  lay_straw(site, 90, 0.012);
  return {0.0025, 0.010, 0.7};
}

Finish make_mud(Site& site) {
  constexpr double bump_m = 0.011;
  const Field lumps = site.noise(0.28, 0.012, 0.95), swells = site.noise(1, 0.3, 0.9),
              tone = site.noise(0.5, 0.006, 0.4);
  const glm::vec3 dry(0.150f, 0.110f, 0.076f), wet(0.052f, 0.036f, 0.024f);
  constexpr float water = -1.1f;  // level of puddles
  Field heights = lumps;
  for (std::size_t i = 0; i < heights.values.size(); ++i) {
    // Churned: rounded lumps with creases between them.
    const float raw = lumps.values[i];
    heights.values[i] = 0.7f * raw - 0.45f * std::abs(raw) + 0.4f + 0.6f * swells.values[i];
  }
  fill(site.canvas, [&](int x, int y) {
    const float raw = heights.at(x, y), height = std::max(raw, water);
    const float moist = 1 - smooth_step(water, water + 2.2f, height);
    const glm::vec3 color =
        glm::mix(dry, wet, std::clamp(moist + 0.1f * tone.at(x, y), 0.0f, 1.0f)) *
        (1 + 0.10f * tone.at(x, y) + 0.05f * site.spots.at(x, y));
    return Texel{static_cast<float>(bump_m) * height, color,
                 raw < water ? 0.02f : 0.8f - 0.6f * moist};
  });
  std::vector<Stone> stones;
  add_crumbs(site, 5000, 0.002, 0.007, heights, bump_m, dry, stones);
  add_stones(site, 30, 0.006, 0.03, heights, bump_m, stones);
  lay(site.canvas, std::span<const Stone>(stones));
  lay_straw(site, 60, 0.012);
  return {0.003, 0.014, 0.65};
}

Finish make_gravel(Site& site) {
  const Field bumps = site.noise(0.5, 0.004, 0.7);
  const glm::vec3 color(0.150f, 0.125f, 0.098f);
  fill(site.canvas, [&](int x, int y) {
    return Texel{0.003f * bumps.at(x, y), color * (1 + 0.18f * site.spots.at(x, y)), 0.95f};
  });
  Dice& dice = site.dice;
  const auto px = static_cast<double>(site.canvas.px_per_m());
  std::vector<Stone> stones;
  Packing packing(site.canvas.side, 0.064 * px);
  // Classes of the ISO 14688-1 scale, each laid between the larger ones.
  struct Class {
    double smallest_m, largest_m, tries_per_m2;
  };
  for (const Class& each :
       {Class{0.02, 0.05, 2600.0}, {0.0112, 0.02, 20000.0}, {0.0063, 0.0112, 50000.0}}) {
    std::vector<double> diameters_m;
    for (int i = site.count(each.tries_per_m2); i > 0; --i)
      diameters_m.push_back(dice.logarithmic(each.smallest_m, each.largest_m));
    std::ranges::sort(diameters_m, std::greater<>());
    for (const double diameter_m : diameters_m) {
      const glm::vec2 at = site.place();
      if (!packing.add(at, static_cast<float>(diameter_m * px / 2))) continue;
      Stone made = stone(site, at, diameter_m, 0.75);
      made.z_m = static_cast<float>(
          0.004 * static_cast<double>(bumps.at(static_cast<int>(at.x), static_cast<int>(at.y))) -
          diameter_m * dice.between(0.0, 0.25));
      made.color = stone_color(dice);
      made.mottle = static_cast<float>(dice.between(0.05, 0.2));
      stones.push_back(made);
    }
  }
  add_stones(site, 15000, 0.002, 0.0063, bumps, 0.003, stones);
  lay(site.canvas, std::span<const Stone>(stones));
  return {0.004, 0.014, 0.8};
}

Finish make_sand(Site& site) {
  Dice& dice = site.dice;
  // Ripples: waves with directions and lengths near one, which form crests that end and fork.
  constexpr int coarsening = 4;
  const int side = site.canvas.side / coarsening;
  Field real{side,
             std::vector<float>(static_cast<std::size_t>(side) * static_cast<std::size_t>(side))};
  Field imaginary = real;
  const double wave_m = 0.085, heading_rad = dice.angle_rad();
  struct Wave {
    double columns, rows, phase_rad, size;
  };
  std::vector<Wave> waves;
  for (int i = 0; i < 14; ++i) {
    const double turn_rad = heading_rad + dice.between(-0.28, 0.28);
    const double number = site.canvas.size_m / (wave_m * dice.between(0.87, 1.15));
    waves.push_back({std::round(number * math::cos(turn_rad)),
                     std::round(number * math::sin(turn_rad)), dice.angle_rad(),
                     dice.between(0.5, 1)});
  }
  run_pass(site.canvas.runner, static_cast<std::size_t>(side), [&](std::size_t row) {
    for (const Wave& wave : waves) {
      const double step_rad = 2 * std::numbers::pi * wave.columns / side;
      const double start_rad =
          wave.phase_rad + 2 * std::numbers::pi * wave.rows * static_cast<double>(row) / side;
      double c = wave.size * math::cos(start_rad), s = wave.size * math::sin(start_rad);
      const double step_c = math::cos(step_rad), step_s = math::sin(step_rad);
      for (int x = 0; x < side; ++x) {
        const std::size_t i = row * static_cast<std::size_t>(side) + static_cast<std::size_t>(x);
        real.values[i] += static_cast<float>(c), imaginary.values[i] += static_cast<float>(s);
        const double next = c * step_c - s * step_s;
        s = c * step_s + s * step_c;
        c = next;
      }
    }
  });
  for (int i = 1; i < coarsening; i *= 2) {
    real = refined(real, site.canvas.runner);
    imaginary = refined(imaginary, site.canvas.runner);
  }
  const Field dunes = site.noise(0.8, 0.1, 0.9), grain = site.noise(0.003, 0.001, 0.2),
              tone = site.noise(0.4, 0.01, 0.4);
  fill(site.canvas, [&](int x, int y) {
    const float re = real.at(x, y), im = imaginary.at(x, y), square = re * re + im * im;
    const float size = std::sqrt(square), strength = square / (square + 0.7f);
    const float c = re / std::max(size, 1e-6f), s = im / std::max(size, 1e-6f);
    // Sharp crests, and a lee side that is steeper than the windward one.
    const float ripple = (c + 0.22f * (2 * c * c - 1) + 0.25f * s * c) * strength;
    const float z_m = 0.0032f * ripple + 0.004f * dunes.at(x, y) + 0.00012f * grain.at(x, y);
    const float light = 1 + 0.10f * grain.at(x, y) + 0.04f * tone.at(x, y) + 0.05f * ripple;
    return Texel{z_m, glm::vec3(0.44f, 0.34f, 0.215f) * light, 0.95f};
  });
  std::vector<Stone> stones;
  add_stones(site, 25, 0.002, 0.008, dunes, 0.004, stones);
  lay(site.canvas, std::span<const Stone>(stones));
  return {0.004, 0.02, 0.35};
}

Finish make_rock(Site& site) {
  const Field shape = site.noise(1, 0.003, 0.85), ridges = site.noise(0.7, 0.02, 0.7),
              cracks = site.noise(0.9, 0.01, 0.75), tone = site.noise(0.4, 0.004, 0.3),
              crust = site.noise(0.10, 0.003, 0.75), bloom = site.noise(0.6, 0.1, 0.7);
  fill(site.canvas, [&](int x, int y) {
    const float crack = 1 - smooth_step(0.0f, 0.035f, std::abs(cracks.at(x, y)));
    const float ridge = 1 - 2 * std::abs(ridges.at(x, y));
    const float z_m = 0.010f * shape.at(x, y) + 0.004f * ridge - 0.012f * crack;
    glm::vec3 color = glm::vec3(0.205f, 0.198f, 0.188f) *
                      (1 + 0.17f * tone.at(x, y) + 0.10f * site.spots.at(x, y));
    color *= 1 - 0.55f * crack;
    const float grey = smooth_step(1.05f, 1.35f, crust.at(x, y) + 0.55f * bloom.at(x, y));
    const float ochre = smooth_step(1.55f, 1.75f, -crust.at(x, y) - 0.5f * bloom.at(x, y));
    const float black = smooth_step(0.9f, 1.3f, tone.at(x, y) - 0.6f * bloom.at(x, y));
    color = glm::mix(color, glm::vec3(0.36f, 0.38f, 0.31f) * (1 + 0.12f * site.spots.at(x, y)),
                     0.8f * grey * (1 - crack));
    color = glm::mix(color, glm::vec3(0.38f, 0.24f, 0.06f) * (1 + 0.15f * site.spots.at(x, y)),
                     0.8f * ochre * (1 - crack));
    color = glm::mix(color, glm::vec3(0.06f), 0.45f * black);
    return Texel{z_m, color, 0.85f};
  });
  return {0.006, 0.02, 0.6};
}

}  // namespace groundray::ground
