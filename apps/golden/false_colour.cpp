#include "apps/golden/false_colour.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/colour_map.h"

namespace groundray::golden {
namespace {

constexpr int smallest_picture_px = 240;

}  // namespace

std::pair<double, double> finite_range(const std::vector<double>& values) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) return {0, 1};
  return {low, high > low ? high : low + 1};
}

Image8 false_colour(const std::vector<double>& values, glm::ivec2 size_px, double low,
                    double high) {
  const int scale = std::max(1, smallest_picture_px / std::max(size_px.x, 1));
  Image8 picture(size_px.x * scale, size_px.y * scale, 3);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const double value =
          values[static_cast<std::size_t>(y / scale) * static_cast<std::size_t>(size_px.x) +
                 static_cast<std::size_t>(x / scale)];
      const double share = high > low ? (value - low) / (high - low) : 0;
      paint(picture, x, y, std::isfinite(value) ? range_colour(1 - share) : Colour(1));
    }
  }
  return picture;
}

}  // namespace groundray::golden
