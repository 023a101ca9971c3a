#include "core/geometry/height_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/geometry/surface_height.h"

namespace groundray {
namespace {

struct HeightRange {
  float low_m = std::numeric_limits<float>::infinity();
  float high_m = -std::numeric_limits<float>::infinity();
  std::size_t holes = 0;
};

HeightRange range_of(std::span<const float> heights_m) {
  HeightRange range;
  for (const float height_m : heights_m) {
    range.low_m = std::min(range.low_m, height_m);  // comparisons with NaN are false
    range.high_m = std::max(range.high_m, height_m);
    range.holes += std::isnan(height_m) ? 1 : 0;
  }
  return range;
}

void check_samples(Violations& broken, glm::ivec2 size, std::span<const float> heights_m,
                   const HeightRange& range) {
  broken.unless(size.x >= 2 && size.y >= 2, "{} x {} samples; a surface needs at least 2 x 2",
                size.x, size.y);
  broken.unless(
      size.x < 0 || size.y < 0 ||
          heights_m.size() == static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y),
      "{} heights for {} x {} samples", heights_m.size(), size.x, size.y);
  broken.unless(heights_m.empty() || range.holes == heights_m.size() ||
                    (std::isfinite(range.low_m) && std::isfinite(range.high_m)),
                "a height is infinite; mark samples without a height as NaN");
}

GridFrame checked_frame(glm::ivec2 size, glm::dvec2 origin_m, glm::dvec2 step_m,
                        std::span<const float> heights_m) {
  Violations broken("height grid");
  broken.unless(
      std::isfinite(step_m.x) && std::isfinite(step_m.y) && step_m.x != 0 && step_m.y != 0,
      "step = ({}, {}) m must be finite and not 0", step_m.x, step_m.y);
  broken.unless(std::isfinite(origin_m.x) && std::isfinite(origin_m.y),
                "origin = ({}, {}) m must be finite", origin_m.x, origin_m.y);
  check_samples(broken, size, heights_m, range_of(heights_m));
  broken.throw_if_any();
  return {size, origin_m, step_m, 1.0 / step_m};
}

}  // namespace

HeightArray::HeightArray(glm::ivec2 size, std::vector<float> heights_m) : size_(size) {
  const HeightRange range = range_of(heights_m);
  Violations broken("heights");
  check_samples(broken, size, heights_m, range);
  broken.throw_if_any();
  hole_count_ = range.holes;
  if (hole_count_ < heights_m.size()) {
    min_m_ = range.low_m;
    max_m_ = range.high_m;
  }
  heights_m_ = std::make_shared<const std::vector<float>>(std::move(heights_m));
  samples_ = heights_m_->data();
}

HeightGrid::HeightGrid(glm::ivec2 size, glm::dvec2 origin_m, glm::dvec2 step_m,
                       std::vector<float> heights_m)
    : frame_(checked_frame(size, origin_m, step_m, heights_m)),
      samples_(size, std::move(heights_m)) {}

std::optional<double> HeightGrid::height_m_at(glm::dvec2 p) const noexcept {
  return surface_height_m(frame_, p, [this](int column, int row) { return cell(column, row); });
}

}  // namespace groundray
