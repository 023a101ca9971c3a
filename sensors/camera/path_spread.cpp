#include "sensors/camera/path_spread.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <vector>

namespace groundray {
namespace {

constexpr int reach_px = 4;  // the pixels around are a square of 9 x 9
constexpr std::size_t colours = 3;

// Returns the number of parts of each net of a pixel with `count` paths.
std::uint32_t parts_of(std::uint32_t count) {
  return std::clamp<std::uint32_t>(count / PathSums::nets, 1, PathSums::most_parts);
}

// Sums over the pixels with an estimate.
struct Surroundings {
  double between[colours] = {}, within[colours] = {};
  double pixels = 0;

  void add(const PathSpreads& spreads, int x, int y) {
    if (spreads.paths.at(x, y)[0] < 2) return;
    for (std::size_t k = 0; k < colours; ++k) {
      between[k] += static_cast<double>(spreads.between.at(x, y)[k]);
      within[k] += static_cast<double>(spreads.within.at(x, y)[k]);
    }
    pixels += 1;
  }
  void add(const Surroundings& other) {
    for (std::size_t k = 0; k < colours; ++k) {
      between[k] += other.between[k];
      within[k] += other.within[k];
    }
    pixels += other.pixels;
  }
};

// Returns the variance of a pixel's mean from its own spreads and those around.
double variance(double between, double within, double freedom_within, const Surroundings& around,
                std::size_t k) {
  const double expected = around.between[k] / around.pixels;
  const double scaled =
      around.within[k] > 0 ? within / around.within[k] * around.between[k] : expected;
  return (between + freedom_within * scaled + expected) / (2 + freedom_within);
}

}  // namespace

// All numbers are powers of two, so that shifts divide.
PathSums::Place PathSums::place(std::uint32_t i, std::uint32_t count) noexcept {
  const std::uint32_t size = std::max(count / nets, 1U);
  const std::uint32_t net = i >> std::countr_zero(size), index = i & (size - 1);
  const int shift = std::countr_zero(size) - std::countr_zero(parts_of(count));
  return {net, index, net * most_parts + (index >> shift)};
}

PathSums::Sum PathSums::of_net(std::uint32_t net) const noexcept {
  Sum sum;
  for (std::uint32_t part = 0; part < most_parts; ++part) {
    const Sum& each = sums_[net * most_parts + part];
    sum.radiance += each.radiance;
    sum.count += each.count;
  }
  return sum;
}

PathSums::Sum PathSums::total() const noexcept {
  const Sum first = of_net(0), second = of_net(1);
  return {first.radiance + second.radiance, first.count + second.count};
}

// The variance of a ratio of sums over r independent groups: r/(r - 1) times the sum of squares of
// the groups' differences from their expectation, over the squared number of paths.
// @see Cochran, Sampling Techniques (1977), section 6.4.
glm::dvec3 PathSums::between_nets() const noexcept {
  const Sum all = total();
  if (all.count == 0) return glm::dvec3(0);
  const glm::dvec3 mean = all.mean();
  return 2.0 * (of_net(0).square_off(mean) + of_net(1).square_off(mean)) / (all.count * all.count);
}

glm::dvec3 PathSums::within_nets() const noexcept {
  glm::dvec3 squares(0);
  double count = 0;
  for (std::uint32_t net = 0; net < nets; ++net) {
    const Sum all = of_net(net);
    double parts = 0;
    glm::dvec3 of_parts(0);
    for (std::uint32_t part = 0; part < most_parts; ++part) {
      const Sum& each = sums_[net * most_parts + part];
      if (each.count == 0) continue;
      of_parts += each.square_off(all.mean());
      parts += 1;
    }
    if (parts > 1) squares += of_parts * (parts / (parts - 1));
    count += all.count;
  }
  return count > 0 ? squares / (count * count) : squares;
}

ImageF standard_errors(const PathSpreads& spreads) {
  const int width = spreads.paths.width(), height = spreads.paths.height();
  ImageF errors(width, height, static_cast<int>(colours));
  tbb::parallel_for(0, height, [&](int y) {
    std::vector<Surroundings> columns(static_cast<std::size_t>(width));
    for (int row = std::max(y - reach_px, 0); row < std::min(y + reach_px + 1, height); ++row) {
      for (int x = 0; x < width; ++x) columns[static_cast<std::size_t>(x)].add(spreads, x, row);
    }
    for (int x = 0; x < width; ++x) {
      const float paths = spreads.paths.at(x, y)[0];
      if (paths == 0) continue;
      if (paths == 1) {
        std::ranges::fill(errors.at(x, y), std::numeric_limits<float>::infinity());
        continue;
      }
      Surroundings around;
      for (int column = std::max(x - reach_px, 0); column < std::min(x + reach_px + 1, width);
           ++column)
        around.add(columns[static_cast<std::size_t>(column)]);
      const double freedom_within =
          PathSums::nets * (parts_of(static_cast<std::uint32_t>(paths)) - 1.0);
      for (std::size_t k = 0; k < colours; ++k) {
        const double of_mean =
            variance(static_cast<double>(spreads.between.at(x, y)[k]),
                     static_cast<double>(spreads.within.at(x, y)[k]), freedom_within, around, k);
        errors.at(x, y)[k] = static_cast<float>(std::sqrt(of_mean));
      }
    }
  });
  return errors;
}

}  // namespace groundray
