#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/photo.hpp>

#include "core/error.h"
#include "reconstruction/dem/fill/dem_fill.h"

namespace groundray {
namespace {

// Telea's method is made for images: it adds up to two grey levels. Heights are scaled to so many
// that this does not matter.
constexpr double grey_levels = 1e5, least_span_m = 1e-3;

// Grey levels are (height - middle_m) * per_m. OpenCV's result depends on the values in holes; the
// middle of the range is the best choice.
struct GreyScale {
  double middle_m = 0, per_m = 1;

  explicit GreyScale(std::span<const float> heights_m) {
    double low_m = std::numeric_limits<double>::infinity(), high_m = -low_m;
    for (const float z : heights_m) {
      low_m = std::fmin(low_m, z);
      high_m = std::fmax(high_m, z);
    }
    if (!(low_m <= high_m)) return;
    middle_m = (low_m + high_m) / 2;
    per_m = grey_levels / std::max(high_m - low_m, least_span_m);
  }
  float grey(double height_m) const {
    return std::isnan(height_m) ? 0 : static_cast<float>((height_m - middle_m) * per_m);
  }
  float height_m(double grey) const { return static_cast<float>(grey / per_m + middle_m); }
};

}  // namespace

std::vector<float> fill_by_inpainting(glm::ivec2 size, std::span<const float> heights_m,
                                      Inpainting by) {
  if (std::ssize(heights_m) != std::int64_t{size.x} * size.y)
    throw Error("filling by inpainting: {} heights for {} x {} samples", heights_m.size(), size.x,
                size.y);
  constexpr double radius_cells = 3;
  constexpr int border = 4;
  cv::Mat heights(size.y, size.x, CV_32FC1), missing(size.y, size.x, CV_8UC1), filled;
  const GreyScale scale(heights_m);
  std::ranges::transform(heights_m, heights.begin<float>(),
                         [&scale](float z) { return scale.grey(z); });
  std::ranges::transform(heights_m, missing.begin<std::uint8_t>(),
                         [](float z) { return std::uint8_t{std::isnan(z)}; });
  try {
    // Some releases treat edges as holes.
    cv::copyMakeBorder(heights, heights, border, border, border, border, cv::BORDER_REPLICATE);
    cv::copyMakeBorder(missing, missing, border, border, border, border, cv::BORDER_REPLICATE);
    cv::inpaint(heights, missing, filled, radius_cells,
                by == Inpainting::Telea ? cv::INPAINT_TELEA : cv::INPAINT_NS);
  } catch (const cv::Exception& error) {
    throw Error("filling by inpainting: OpenCV failed: {}", error.what());
  }
  filled = filled(cv::Rect(border, border, size.x, size.y)).clone();
  std::vector<float> all_m(filled.begin<float>(), filled.end<float>());
  // Measured heights stay exact.
  std::ranges::transform(heights_m, all_m, all_m.begin(), [&scale](float was, float is) {
    return std::isnan(was) ? scale.height_m(is) : was;
  });
  return all_m;
}

}  // namespace groundray
