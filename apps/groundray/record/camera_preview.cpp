#include "apps/groundray/record/camera_preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <iterator>
#include <numbers>
#include <vector>

#include "apps/colour_map.h"
#include "core/image/luminance.h"
#include "core/image/srgb.h"

namespace groundray {
namespace {

constexpr int largest_px = 640;  // longer side of a panel
constexpr int panel_gap = 8;

using ColourAt = std::function<Colour(int, int)>;

// Returns a quantile of an image's finite and positive values; 1 if there are none.
float quantile(const ImageF& image, double share) {
  std::vector<float> values;
  std::ranges::copy_if(image.values(), std::back_inserter(values),
                       [](float value) { return std::isfinite(value) && value > 0; });
  if (values.empty()) return 1;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

// Draws the radiance, with 1 % of its values clipped to white.
ColourAt light_of(const Exposure& light) {
  const float white = quantile(light.radiance, 0.99);
  return [&light, white](int x, int y) {
    const auto rgb = light.radiance.at(x, y);
    const auto encoded = [&](float value) {
      return srgb_of_linear(std::clamp(static_cast<double>(value / white), 0.0, 1.0));
    };
    return Colour(encoded(rgb[0]), encoded(rgb[1]), encoded(rgb[2]));
  };
}

// Draws near as yellow, far as violet, on a logarithmic scale; the sky is black.
ColourAt depth_of(const ImageTruth& truth) {
  const float near_m = quantile(truth.depth_m, 0.01), far_m = quantile(truth.depth_m, 0.99);
  return [&truth, near_m, far_m](int x, int y) {
    const float depth_m = truth.depth_m.at(x, y)[0];
    if (!std::isfinite(depth_m) || depth_m <= 0) return Colour(0);
    const double span = std::log(static_cast<double>(std::max(far_m / near_m, 1.01f)));
    return range_colour(std::log(static_cast<double>(depth_m / near_m)) / span);
  };
}

ColourAt normal_of(const ImageTruth& truth) {
  return [&truth](int x, int y) {
    const auto n = truth.normal.at(x, y);
    if (std::isnan(n[0])) return Colour(0);
    return Colour(n[0] + 1, n[1] + 1, n[2] + 1) / 2.0;
  };
}

ColourAt label_of(const ImageTruth& truth) {
  return [&truth](int x, int y) {
    // Hues at multiples of the golden angle differ for any number of labels.
    const std::uint32_t label = truth.label.at(x, y)[0];
    if (label == 0) return Colour(0);
    const double hue = label * 0.6180339887498949;
    const auto wave = [&](double shift) {
      return 0.55 + 0.4 * std::cos(2 * std::numbers::pi * (hue + shift));
    };
    return Colour(wave(0), wave(1 / 3.0), wave(2 / 3.0));
  };
}

}  // namespace

Image8 draw_image_preview(const Exposure* light, const ImageTruth* truth) {
  std::vector<ColourAt> panels;
  if (light != nullptr) panels.push_back(light_of(*light));
  if (truth != nullptr) {
    for (const auto& panel : {depth_of(*truth), normal_of(*truth), label_of(*truth)})
      panels.push_back(panel);
  }
  const auto& [width, height] = light != nullptr
                                    ? std::pair(light->radiance.width(), light->radiance.height())
                                    : std::pair(truth->depth_m.width(), truth->depth_m.height());
  const int stride = (std::max(width, height) + largest_px - 1) / largest_px;
  const int w = (width + stride - 1) / stride, h = (height + stride - 1) / stride;
  const int columns = panels.size() > 2 ? 2 : static_cast<int>(panels.size());
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  Image8 picture(columns * (w + panel_gap) - panel_gap, rows * (h + panel_gap) - panel_gap, 3);
  std::ranges::fill(picture.values(), std::uint8_t{255});
  for (int i = 0; i < static_cast<int>(panels.size()); ++i) {
    const int left = i % columns * (w + panel_gap), top = i / columns * (h + panel_gap);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x)
        paint(picture, left + x, top + y,
              panels[static_cast<std::size_t>(i)](x * stride, y * stride));
    }
  }
  return picture;
}

}  // namespace groundray
