#include "reconstruction/dem/fill/fill_shadow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace groundray {
namespace {

constexpr double least_bounded = 0.5;  // fraction of a hole's samples
constexpr double most_above = 0.5;     // fraction of the height that lines lose over a hole
constexpr int approach = 2;  // search distance for ground that casts shadows on a box, in boxes

constexpr std::array<glm::ivec2, 8> ways{{{1, 0},
                                          {1, 1},
                                          {0, 1},
                                          {-1, 1},  //
                                          {-1, 0},
                                          {-1, -1},
                                          {0, -1},
                                          {1, -1}}};

glm::dvec2 in_metres(const PlateRaster& raster, glm::ivec2 way) {
  return glm::dvec2(way) * glm::abs(raster.step_m);
}

// Returns the index of the direction nearest to `ahead`.
std::size_t way_along(const PlateRaster& raster, glm::dvec2 ahead) {
  const auto along = [&](glm::ivec2 way) {
    return glm::dot(glm::normalize(in_metres(raster, way)), ahead);
  };
  return static_cast<std::size_t>(std::ranges::max_element(ways, {}, along) - ways.begin());
}

// Samples of a raster by column and row.
class RasterSamples {
 public:
  explicit RasterSamples(const PlateRaster& raster) : raster_(raster) {}

  std::size_t index(glm::ivec2 at) const {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(raster_.size.x) +
           static_cast<std::size_t>(at.x);
  }
  glm::ivec2 place(std::uint32_t sample) const {
    return {static_cast<int>(sample) % raster_.size.x, static_cast<int>(sample) / raster_.size.x};
  }
  bool is_in(glm::ivec2 at) const {
    return at.x >= 0 && at.y >= 0 && at.x < raster_.size.x && at.y < raster_.size.y;
  }
  bool is_known(glm::ivec2 at) const {
    return is_in(at) && raster_.numbers[index(at)] == plate_known;
  }
  double height_m(glm::ivec2 at) const { return raster_.heights_m[index(at)]; }

 private:
  const PlateRaster& raster_;
};

// Returns the mean gradient of bounds along columns and rows, m/m; nothing if too few neighbours
// have bounds.
std::optional<glm::dvec2> mean_rise(const PlateRaster& raster, std::span<const float> most_m,
                                    std::span<const std::uint32_t> hole) {
  const RasterSamples samples(raster);
  glm::dvec2 sum_m(0), count(0);
  for (const std::uint32_t sample : hole) {
    const glm::ivec2 at = samples.place(sample);
    for (const int k : {0, 1}) {
      const glm::ivec2 next = at + glm::ivec2(k == 0, k == 1);
      if (!samples.is_in(next) || samples.is_known(next)) continue;
      const double rise_m = double{most_m[samples.index(next)]} - most_m[sample];
      if (std::isnan(rise_m)) continue;
      sum_m[k] += rise_m;
      count[k] += 1;
    }
  }
  if (count.x == 0 || count.y == 0) return std::nullopt;
  return sum_m / (count * glm::abs(raster.step_m));
}

// Height, at each sample of a box, of the line of sight that just clears the ground before it.
class Lines {
 public:
  Lines(const PlateRaster& raster, glm::ivec2 way, double fall_m, glm::ivec2 low, glm::ivec2 high)
      : first_(low),
        size_(high - low + 1),
        lines_m_(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y)) {
    const RasterSamples samples(raster);
    for (int j = 0; j < size_.y; ++j) {
      for (int i = 0; i < size_.x; ++i) {
        const glm::ivec2 at =
            low + glm::ivec2(way.x < 0 ? size_.x - 1 - i : i, way.y < 0 ? size_.y - 1 - j : j);
        const glm::ivec2 before = at - way;
        double line_m = -std::numeric_limits<double>::infinity();
        if (glm::clamp(before, low, high) == before) {
          line_m = at_m(before);
          if (samples.is_known(before)) line_m = std::max(line_m, samples.height_m(before));
        }
        lines_m_[index(at)] = line_m - fall_m;
      }
    }
  }

  double at_m(glm::ivec2 at) const { return lines_m_[index(at)]; }

 private:
  std::size_t index(glm::ivec2 at) const {
    const glm::ivec2 place = at - first_;
    return static_cast<std::size_t>(place.y) * static_cast<std::size_t>(size_.x) +
           static_cast<std::size_t>(place.x);
  }

  glm::ivec2 first_, size_;
  std::vector<double> lines_m_;
};

}  // namespace

std::optional<GrazingSight> sight_over(const PlateRaster& raster, std::span<const float> most_m,
                                       std::span<const std::uint32_t> hole) {
  const auto rise = mean_rise(raster, most_m, hole);
  if (!rise || !(glm::length(*rise) > 0)) return std::nullopt;
  GrazingSight sight{.ahead = -glm::normalize(*rise), .fall = glm::length(*rise)};
  const RasterSamples samples(raster);
  const glm::ivec2 way = ways[way_along(raster, sight.ahead)];
  const double step_m = glm::length(in_metres(raster, way));
  double bounded = 0, first = 0;
  for (const std::uint32_t sample : hole) {
    if (std::isnan(most_m[sample])) continue;
    bounded += 1;
    const glm::ivec2 before = samples.place(sample) - way;
    if (!samples.is_known(before)) continue;
    first += 1;
    const double above_m = most_m[sample] + sight.fall * step_m - samples.height_m(before);
    sight.above_m += std::fmax(above_m, 0);
  }
  if (first == 0 || bounded < least_bounded * static_cast<double>(hole.size())) return std::nullopt;
  sight.above_m /= first;
  if (sight.above_m > most_above * sight.fall * step_m * bounded / first) return std::nullopt;
  return sight;
}

CastShadow cast_shadow(const PlateRaster& raster, const GrazingSight& sight, std::uint32_t turn,
                       glm::ivec2 low, glm::ivec2 high) {
  constexpr std::array<std::size_t, 5> turns{4, 3, 5, 2, 6};  // eighths of a full turn
  const glm::ivec2 way = ways[(way_along(raster, sight.ahead) + turns[turn % turns.size()]) % 8];
  const glm::ivec2 far = approach * (high - low + 1) * way;
  const Lines lines(raster, way, sight.fall * glm::length(in_metres(raster, way)),
                    glm::max(low - glm::max(far, glm::ivec2(0)), glm::ivec2(0)),
                    glm::min(high - glm::min(far, glm::ivec2(0)), raster.size - 1));
  const RasterSamples samples(raster);
  CastShadow shadow;
  for (int row = low.y; row <= high.y; ++row) {
    for (int column = low.x; column <= high.x; ++column) {
      const glm::ivec2 at(column, row);
      if (!samples.is_known(at) || !(lines.at_m(at) > samples.height_m(at))) continue;
      shadow.samples.push_back(at);
      shadow.most_m.push_back(static_cast<float>(lines.at_m(at) + sight.above_m));
    }
  }
  return shadow;
}

}  // namespace groundray
