#include "terrain/textures/ground_images.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <numbers>
#include <numeric>
#include <vector>

#include "core/error.h"
#include "core/image/srgb.h"
#include "core/mixed_bits.h"
#include "terrain/textures/canvas.h"
#include "terrain/textures/kinds.h"

namespace groundray {
namespace {

using ground::Canvas;
using ground::Field;
using ground::Finish;
using ground::Site;
using ground::Texel;

struct Kind {
  std::string_view name;
  Finish (*make)(Site&);
};

constexpr std::array<Kind, 10> kinds{{{"bare_soil", ground::make_bare_soil},
                                      {"mud", ground::make_mud},
                                      {"gravel", ground::make_gravel},
                                      {"sand", ground::make_sand},
                                      {"forest_litter", ground::make_forest_litter},
                                      {"moss", ground::make_moss},
                                      {"short_grass", ground::make_short_grass},
                                      {"dead_grass", ground::make_dead_grass},
                                      {"rock", ground::make_rock},
                                      {"heath", ground::make_heath}}};

void check_spec(const GroundImageSpec& spec) {
  Violations broken("ground images");
  broken.unless(64 <= spec.pixels && spec.pixels <= 4096 &&
                    std::has_single_bit(static_cast<unsigned>(spec.pixels)),
                "pixels = {} must be a power of two from 64 to 4096", spec.pixels);
  broken.unless(0.5 <= spec.size_m && spec.size_m <= 8, "size_m = {} must be from 0.5 to 8",
                spec.size_m);
  broken.throw_if_any();
}

// Returns sRGB bytes of equal steps of the square root of linear values, which is near sRGB.
const std::array<std::uint8_t, 4096>& srgb_bytes() {
  static const auto table = [] {
    std::array<std::uint8_t, 4096> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const double root = static_cast<double>(i) / static_cast<double>(bytes.size() - 1);
      bytes[i] = static_cast<std::uint8_t>(std::nearbyint(255 * srgb_of_linear(root * root)));
    }
    return bytes;
  }();
  return table;
}

std::uint8_t srgb_byte(float linear) noexcept {
  const float root = std::sqrt(std::clamp(linear, 0.0f, 1.0f));
  return srgb_bytes()[static_cast<std::size_t>(std::nearbyint(root * 4095))];
}

std::uint8_t byte(float share) noexcept {
  return static_cast<std::uint8_t>(std::nearbyint(255 * std::clamp(share, 0.0f, 1.0f)));
}

// Returns the heights, blurred over about two pixels, so that no edge is steeper than its pixels
// can state.
Field heights_of(const Canvas& canvas) {
  Field raw{canvas.side, std::vector<float>(canvas.texels.size())};
  Field out = raw;
  run_pass(canvas.runner, static_cast<std::size_t>(canvas.side), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    const auto line = [&](int from) { return canvas.texels.data() + raw.index(0, from); };
    const Texel *const a = line(y - 1), *const b = line(y), *const c = line(y + 1);
    float* const to = raw.values.data() + raw.index(0, y);
    for (int x = 0; x < canvas.side; ++x) to[x] = 0.25f * (a[x].z_m + c[x].z_m) + 0.5f * b[x].z_m;
  });
  run_pass(canvas.runner, static_cast<std::size_t>(canvas.side), [&](std::size_t row) {
    const int y = static_cast<int>(row), mask = canvas.side - 1;
    const float* const in = raw.values.data() + raw.index(0, y);
    float* const to = out.values.data() + raw.index(0, y);
    for (int x = 0; x < canvas.side; ++x)
      to[x] = 0.25f * (in[(x - 1) & mask] + in[(x + 1) & mask]) + 0.5f * in[x];
  });
  return out;
}

void centre(Field& heights) {
  const auto side = static_cast<std::size_t>(heights.side);
  double sum = 0;
  for (std::size_t row = 0; row < side; ++row) {
    const auto first = heights.values.begin() + static_cast<std::ptrdiff_t>(row * side);
    sum += static_cast<double>(std::accumulate(first, first + heights.side, 0.0f));
  }
  const auto mean = static_cast<float>(sum / static_cast<double>(heights.values.size()));
  for (float& value : heights.values) value -= mean;
}

// Returns what a tent of two cells, of the variance of a square of sqrt(2) cells, averages out.
Field finer_than(const Field& heights, double cell_m, const Canvas& canvas) {
  const int radius =
      static_cast<int>(cell_m * canvas.side / canvas.size_m * std::numbers::sqrt2 / 2);
  if (radius == 0) return heights;
  Field fine = box_mean(heights, std::min(radius, canvas.side / 4), canvas.runner);
  for (std::size_t i = 0; i < fine.values.size(); ++i)
    fine.values[i] = heights.values[i] - fine.values[i];
  return fine;
}

GroundImages developed(const Canvas& canvas, const Finish& finish, double shown_m) {
  const int side = canvas.side, mask = side - 1;
  GroundImages images{Image8(side, side, 3), Image8(side, side, 3), ImageF(side, side, 1),
                      Image8(side, side, 1)};
  Field heights = heights_of(canvas);
  const int radius = std::clamp(
      static_cast<int>(std::lround(finish.radius_m * side / canvas.size_m)), 1, side / 4);
  const Field around = box_mean(heights, radius, canvas.runner);
  centre(heights);
  const Field fine = finer_than(heights, shown_m, canvas);
  const float per_step = canvas.px_per_m() / 2;
  const auto shade_m = static_cast<float>(finish.shade_m);
  const auto darkest = static_cast<float>(1 - finish.depth);
  run_pass(canvas.runner, static_cast<std::size_t>(side), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    const auto line = [&](const Field& field, int from) {
      return field.values.data() + field.index(0, from);
    };
    const float *const north = line(fine, y - 1), *const here = line(fine, y),
                       *const south = line(fine, y + 1), *const mean = line(around, y);
    const Texel* const texels = canvas.texels.data() + heights.index(0, y);
    for (int x = 0; x < side; ++x) {
      const float below = (mean[x] - texels[x].z_m) / shade_m;
      // 1 well above the surroundings, `darkest` well below.
      const float share = 0.5f - below / (1 + std::abs(below)) * 0.5f;
      const glm::vec3 color = texels[x].color * (darkest + (1 - darkest) * share);
      const glm::vec3 normal =
          glm::normalize(glm::vec3((here[(x - 1) & mask] - here[(x + 1) & mask]) * per_step,
                                   (south[x] - north[x]) * per_step, 1));
      for (std::size_t i = 0; i < 3; ++i) {
        const auto axis = static_cast<glm::length_t>(i);
        images.albedo.at(x, y)[i] = srgb_byte(color[axis]);
        images.normal.at(x, y)[i] = byte(0.5f + 0.5f * normal[axis]);
      }
      images.height_m.at(x, y)[0] = line(heights, y)[x];
      images.roughness.at(x, y)[0] = byte(texels[x].roughness);
    }
  });
  return images;
}

}  // namespace

namespace ground {

Site::Site(int pixels, double size_m, std::uint64_t seed, const PassRunner& runner)
    : canvas(pixels, size_m, runner), dice(seed) {
  spots = noise(0.012, 0.001, 0.4);
}

glm::vec2 Site::direction() {
  const double angle_rad = dice.angle_rad();
  return {math::cos(angle_rad), math::sin(angle_rad)};
}

}  // namespace ground

std::span<const std::string_view> ground_image_names() noexcept {
  static const auto names = [] {
    std::array<std::string_view, kinds.size()> all{};
    std::ranges::transform(kinds, all.begin(), &Kind::name);
    return all;
  }();
  return names;
}

GroundImages make_ground_images(const GroundImageSpec& spec, double shown_m,
                                const PassRunner& runner) {
  check_spec(spec);
  const auto kind = static_cast<std::size_t>(spec.kind);
  Site site(spec.pixels, spec.size_m, mixed_bits(spec.variant) + kind, runner);
  const Finish finish = kinds.at(kind).make(site);
  return developed(site.canvas, finish, shown_m);
}

}  // namespace groundray
