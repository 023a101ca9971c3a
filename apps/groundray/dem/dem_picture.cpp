#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <utility>

#include "apps/colour_map.h"
#include "apps/groundray/dem/dem_report.h"
#include "core/quantile.h"

namespace groundray {
namespace {

constexpr int panel_width = 600, gap = 8;
const Colour empty_colour(0.12, 0.14, 0.2), filled_colour(1, 0.6, 0.2);

// Maps pixels to samples: several pixels per sample for a small DEM, several samples per pixel for
// a large one.
class PanelLayout {
 public:
  explicit PanelLayout(const GridFrame& frame) : frame_(frame) {
    const double aspect = std::abs(frame.step_m.y / frame.step_m.x);
    const int most = std::max(frame.samples.x, static_cast<int>(frame.samples.y * aspect));
    per_pixel_ = static_cast<double>(most) / panel_width;
    size_ = glm::max(glm::ivec2(glm::dvec2(frame.samples) * glm::dvec2(1, aspect) / per_pixel_),
                     glm::ivec2(1));
    row_per_pixel_ = per_pixel_ / aspect;
  }

  glm::ivec2 size() const { return size_; }

  // Returns the sample that a pixel shows; the first pixel is in the north-west.
  glm::ivec2 sample(int x, int y) const {
    const glm::dvec2 at((x + 0.5) * per_pixel_, (y + 0.5) * row_per_pixel_);
    const glm::ivec2 last = frame_.samples - 1;
    const glm::ivec2 found = glm::clamp(glm::ivec2(at), glm::ivec2(0), last);
    return {frame_.step_m.x > 0 ? found.x : last.x - found.x,
            frame_.step_m.y < 0 ? found.y : last.y - found.y};
  }

 private:
  GridFrame frame_;
  glm::ivec2 size_{1};
  double per_pixel_ = 1, row_per_pixel_ = 1;
};

class Shading {
 public:
  Shading(const DemLayers& layers, bool with_filled) : layers_(layers), with_filled_(with_filled) {}

  float height_m(glm::ivec2 at) const {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    const glm::ivec2 samples = layers_.frame.samples;
    if (at.x < 0 || at.y < 0 || at.x >= samples.x || at.y >= samples.y) return nan;
    const std::size_t i = index(at);
    if (!with_filled_ && layers_.source[i] == HeightSource::Filled) return nan;
    return layers_.elevation_m[i];
  }

  // Returns the hillshade, lit from the north-west as on maps; nothing if the sample has no height.
  std::optional<double> light(glm::ivec2 at) const {
    const float here_m = height_m(at);
    if (std::isnan(here_m)) return std::nullopt;
    const glm::dvec3 sun = glm::normalize(glm::dvec3(-1, 1, 1.4));
    const double x = slope(here_m, at, {1, 0}, layers_.frame.step_m.x);
    const double y = slope(here_m, at, {0, 1}, layers_.frame.step_m.y);
    return 0.2 + 0.75 * std::max(0.0, glm::dot(glm::normalize(glm::dvec3(-x, -y, 1)), sun));
  }

  std::size_t index(glm::ivec2 at) const {
    return static_cast<std::size_t>(at.y) * static_cast<std::size_t>(layers_.frame.samples.x) +
           static_cast<std::size_t>(at.x);
  }

 private:
  // Returns the central difference, or a one-sided one if a neighbour has no height.
  double slope(float here_m, glm::ivec2 at, glm::ivec2 by, double step_m) const {
    const float after_m = height_m(at + by), before_m = height_m(at - by);
    if (std::isnan(after_m) && std::isnan(before_m)) return 0;
    if (std::isnan(after_m)) return (here_m - before_m) / step_m;
    if (std::isnan(before_m)) return (after_m - here_m) / step_m;
    return (after_m - before_m) / (2 * step_m);
  }

  const DemLayers& layers_;
  bool with_filled_;
};

// Returns the 95 % quantile of the absolute values.
double usual_size(const std::vector<float>& values) {
  std::vector<double> sizes;
  for (const float value : values)
    if (std::isfinite(value)) sizes.push_back(std::abs(value));
  const double size_m = quantile(std::move(sizes), 0.95);
  return size_m > 0 ? size_m : 1;
}

// Returns white for no error, red for too high, blue for too low.
Colour error_colour(double share) {
  const Colour full = share > 0 ? Colour(0.75, 0.1, 0.1) : Colour(0.1, 0.25, 0.75);
  return glm::mix(Colour(0.97), full, std::min(std::abs(share), 1.0));
}

std::vector<float> stated_sds_m(const DemLayers& layers) {
  std::vector<float> sds_m;
  for (std::size_t i = 0; i < layers.elevation_m.size(); ++i) {
    const bool is_filled = layers.source[i] == HeightSource::Filled;
    sds_m.push_back(is_filled ? layers.fill_sd_m[i] : std::sqrt(layers.variance_m2[i]));
  }
  return sds_m;
}

void draw_shades(Image8& image, const PanelLayout& layout, const DemLayers& layers, int left,
                 bool with_filled) {
  const Shading shading(layers, with_filled);
  for (int y = 0; y < layout.size().y; ++y) {
    for (int x = 0; x < layout.size().x; ++x) {
      const glm::ivec2 at = layout.sample(x, y);
      const auto light = shading.light(at);
      const bool is_filled = layers.source[shading.index(at)] == HeightSource::Filled;
      const Colour tint = is_filled ? filled_colour : Colour(1);
      paint(image, left + x, y, light ? *light * tint : empty_colour);
    }
  }
}

}  // namespace

Image8 draw_dem(const DemLayers& layers, const std::vector<float>& error_m, PictureScale& scale) {
  const PanelLayout layout(layers.frame);
  const int width = layout.size().x;
  Image8 image(3 * width + 2 * gap, layout.size().y, 3);
  std::ranges::fill(image.values(), std::uint8_t{255});
  draw_shades(image, layout, layers, 0, false);
  draw_shades(image, layout, layers, width + gap, true);
  const bool has_errors = !error_m.empty();
  const std::vector<float> values = has_errors ? error_m : stated_sds_m(layers);
  scale.most_m = usual_size(values);
  const Shading shading(layers, true);
  for (int y = 0; y < layout.size().y; ++y) {
    for (int x = 0; x < width; ++x) {
      const float value = values[shading.index(layout.sample(x, y))];
      Colour colour = empty_colour;
      if (std::isfinite(value))
        colour =
            has_errors ? error_colour(value / scale.most_m) : range_colour(value / scale.most_m);
      paint(image, 2 * (width + gap) + x, y, colour);
    }
  }
  return image;
}

}  // namespace groundray
