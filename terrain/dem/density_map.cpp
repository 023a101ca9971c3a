#include "terrain/dem/density_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <utility>

#include "core/error.h"
#include "terrain/dem/dem_warp.h"

namespace groundray {
namespace {

constexpr std::int64_t most_density_pixels = std::int64_t{1} << 30;

bool is_density(double per_m2) { return per_m2 >= 0 && std::isfinite(per_m2); }

}  // namespace

DensityMap::DensityMap(double per_m2) : max_per_m2_(per_m2) {
  if (!is_density(per_m2)) {
    throw Error("a density of {} plants per m2 must be 0 or more, and finite", per_m2);
  }
}

DensityMap::DensityMap(glm::ivec2 size, glm::dvec2 corner_m, glm::dvec2 step_m,
                       std::vector<float> per_m2)
    : size_(size),
      corner_m_(corner_m),
      pixels_per_m_(1.0 / step_m),
      per_m2_(std::move(per_m2)),
      area_{glm::min(corner_m, corner_m + glm::dvec2(size) * step_m),
            glm::max(corner_m, corner_m + glm::dvec2(size) * step_m)} {
  Violations broken("density map");
  const double pixels = static_cast<double>(size.x) * size.y;
  broken.unless(size.x >= 1 && size.y >= 1 && static_cast<double>(per_m2_.size()) == pixels,
                "{} densities do not fill {} x {} pixels", per_m2_.size(), size.x, size.y);
  broken.unless(std::isfinite(corner_m.x + corner_m.y) && std::isfinite(step_m.x + step_m.y) &&
                    step_m.x != 0 && step_m.y != 0,
                "its corner ({}, {}) m and step ({}, {}) m must be finite, the step not 0",
                corner_m.x, corner_m.y, step_m.x, step_m.y);
  broken.throw_if_any();
  for (float& density : per_m2_) {
    if (std::isnan(density)) density = 0;
    max_per_m2_ = std::max<double>(max_per_m2_, density);
    if (is_density(density)) continue;
    const auto index = static_cast<int>(&density - per_m2_.data());
    throw Error(
        "the density in column {}, row {} is {} per m2; it must be 0 or more, and finite; is that "
        "value nodata?",
        index % size.x, index / size.x, density);
  }
  const auto grown = std::ranges::count_if(per_m2_, [](float density) { return density > 0; });
  grown_m2_ = static_cast<double>(grown) * std::abs(step_m.x * step_m.y);
}

double DensityMap::per_m2_at(glm::dvec2 p) const noexcept {
  if (per_m2_.empty()) return max_per_m2_;
  const glm::dvec2 at = glm::floor((p - corner_m_) * pixels_per_m_);
  if (!(0 <= at.x && at.x < size_.x && 0 <= at.y && at.y < size_.y)) return 0;
  return per_m2_[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(size_.x) +
                 static_cast<std::size_t>(at.x)];
}

bool DensityMap::is_empty(const Area& area) const noexcept {
  if (per_m2_.empty()) return max_per_m2_ == 0;
  const glm::dvec2 a = glm::floor((area.low_m - corner_m_) * pixels_per_m_);
  const glm::dvec2 b = glm::floor((area.high_m - corner_m_) * pixels_per_m_);
  const glm::dvec2 last(size_ - 1);
  const glm::dvec2 low = glm::max(glm::min(a, b), glm::dvec2(0));
  const glm::dvec2 high = glm::min(glm::max(a, b), last);
  for (double row = low.y; row <= high.y; ++row) {
    const float* pixels = per_m2_.data() + static_cast<std::ptrdiff_t>(row) * size_.x;
    for (double column = low.x; column <= high.x; ++column) {
      if (pixels[static_cast<std::ptrdiff_t>(column)] > 0) return false;
    }
  }
  return true;
}

DensityMap load_density_map(const std::filesystem::path& path, const DensityOptions& options) {
  return about(path, [&] {
    if (!is_density(options.factor_per_m2)) {
      throw Error("factor_per_m2 = {} must be 0 or more, and finite", options.factor_per_m2);
    }
    PlacedRaster raster =
        load_placed_raster(path, options.nodata, options.crs_wkt, most_density_pixels);
    for (float& density : raster.values) {
      density = static_cast<float>(density * options.factor_per_m2);
    }
    return DensityMap(raster.size, raster.corner_w_m - glm::dvec2(options.origin_w_m),
                      raster.step_m, std::move(raster.values));
  });
}

}  // namespace groundray
