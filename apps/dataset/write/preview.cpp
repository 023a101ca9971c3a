#include "apps/dataset/write/preview.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>
#include <vector>

#include "apps/colour_map.h"
#include "core/image/srgb.h"
#include "core/math.h"

namespace groundray {
namespace {

constexpr int preview_width = 900;
constexpr int gap = 8;

// Returns a quantile of the values that satisfy `counts`; 1 if there are none.
template <typename Values>
auto quantile_of(const Values& all, double share, bool (*counts)(typename Values::value_type)) {
  std::vector<typename Values::value_type> values;
  std::ranges::copy_if(all, std::back_inserter(values), counts);
  if (values.empty()) return typename Values::value_type{1};
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

// Rows of the range image: for a spinning head, a band per ring, from the highest to the lowest;
// otherwise elevations from the highest point to the lowest.
struct RangeRows {
  static constexpr int rows_of_elevations = 160;
  std::vector<int> places;  // index of the band, by ring
  int height = rows_of_elevations;
  int band = 1;
  double low_rad = 0, high_rad = 0;

  RangeRows(const PointCloud& scan, const PatternSpec& pattern) {
    if (const auto* spinning = std::get_if<SpinningPattern>(&pattern)) {
      std::vector<Beam> beams = spinning->beams;
      std::ranges::stable_sort(beams, std::ranges::greater{}, &Beam::elevation_rad);
      places.resize(std::ranges::max(beams, {}, &Beam::ring).ring + std::size_t{1});
      for (std::size_t i = 0; i < beams.size(); ++i) places[beams[i].ring] = static_cast<int>(i);
      band = std::max(2, rows_of_elevations / static_cast<int>(beams.size()));
      height = band * static_cast<int>(beams.size());
      return;
    }
    for (std::size_t i = 0; i < scan.rows(); ++i) {
      const double now_rad = elevation_rad(scan, i);
      low_rad = i == 0 ? now_rad : std::min(low_rad, now_rad);
      high_rad = i == 0 ? now_rad : std::max(high_rad, now_rad);
    }
  }

  static double elevation_rad(const PointCloud& scan, std::size_t i) {
    return math::atan2(scan.column<float>("z")[i],
                       math::hypot(scan.column<float>("x")[i], scan.column<float>("y")[i]));
  }
  int row(const PointCloud& scan, std::size_t i) const {
    if (!places.empty()) return places[scan.column<std::uint16_t>("ring")[i]] * band;
    const double span_rad = std::max(high_rad - low_rad, 1e-6);
    const double share = (high_rad - elevation_rad(scan, i)) / span_rad;
    return std::min(static_cast<int>(share * height), height - 1);
  }
};

void draw_ranges(Image8& image, const PointCloud& scan, const RangeRows& rows, double far_m) {
  const auto x = scan.column<float>("x");
  const auto y = scan.column<float>("y");
  const auto range_m = scan.column<double>("range_true");
  for (std::size_t i = 0; i < scan.rows(); ++i) {
    if (std::isnan(range_m[i])) continue;
    const double turn = 0.5 - math::atan2(y[i], x[i]) / (2 * std::numbers::pi);
    const int column = std::min(static_cast<int>(turn * preview_width), preview_width - 1);
    for (int k = 0; k < rows.band; ++k)
      paint(image, column, rows.row(scan, i) + k, range_colour(range_m[i] / far_m));
  }
}

// Square section of the map, north up.
struct MapWindow {
  glm::dvec2 centre_m;
  double half_m;
  int top;

  glm::dvec2 point(int x, int y) const {
    const glm::dvec2 share((x + 0.5) / preview_width * 2 - 1, 1 - (y + 0.5) / preview_width * 2);
    return centre_m + share * half_m;
  }
  glm::ivec2 pixel(glm::dvec2 p) const {
    const glm::dvec2 share = (p - centre_m) / half_m;
    return {static_cast<int>(std::floor((share.x + 1) / 2 * preview_width)),
            top + static_cast<int>(std::floor((1 - share.y) / 2 * preview_width))};
  }
};

// Heights on a lattice with the spacing of pixels, which extends beyond the window by `reach`
// pixels; NaN where there is no ground.
class HeightLattice {
 public:
  HeightLattice(const MapWindow& window, const Ground& ground, int reach)
      : reach_(reach), side_(preview_width + 2 * reach) {
    heights_m_.reserve(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_));
    for (int y = -reach; y < preview_width + reach; ++y) {
      for (int x = -reach; x < preview_width + reach; ++x) {
        heights_m_.push_back(ground.height_m_at(window.point(x, y))
                                 .value_or(std::numeric_limits<double>::quiet_NaN()));
      }
    }
  }
  double at(int x, int y) const {
    return heights_m_[static_cast<std::size_t>(y + reach_) * static_cast<std::size_t>(side_) +
                      static_cast<std::size_t>(x + reach_)];
  }

 private:
  int reach_, side_;
  std::vector<double> heights_m_;
};

void draw_hillshade(Image8& image, const MapWindow& window, const Ground& ground) {
  const glm::dvec3 sun = glm::normalize(glm::dvec3(-1, 1, 1.4));  // from the north-west, as on maps
  constexpr int farthest = 32;  // pixels; larger cells appear as facets
  const double pixel_m = 2 * window.half_m / preview_width;
  const int reach = static_cast<int>(std::clamp(
      std::ceil(0.5 * std::abs(ground.frame().step_m.x) / pixel_m), 1.0, double{farthest}));
  const HeightLattice heights_m(window, ground, reach);
  for (int y = 0; y < preview_width; ++y) {
    for (int x = 0; x < preview_width; ++x) {
      const glm::dvec3 up(heights_m.at(x - reach, y) - heights_m.at(x + reach, y),
                          heights_m.at(x, y + reach) - heights_m.at(x, y - reach),
                          2 * reach * pixel_m);
      Colour colour(0.12, 0.14, 0.2);  // no ground here
      if (std::isfinite(up.x + up.y))
        colour = Colour(0.25 + 0.6 * std::max(0.0, glm::dot(glm::normalize(up), sun)));
      paint(image, x, window.top + y, colour);
    }
  }
}

void draw_points(Image8& image, const MapWindow& window, const PointCloud& scan, double far_m) {
  const auto x = scan.column<double>("world_x");
  const auto y = scan.column<double>("world_y");
  const auto range_m = scan.column<double>("range_true");
  for (std::size_t i = 0; i < scan.rows(); ++i) {
    const glm::ivec2 at = window.pixel({x[i], y[i]});
    for (const glm::ivec2 step :
         {glm::ivec2(0, 0), glm::ivec2(1, 0), glm::ivec2(0, 1), glm::ivec2(1, 1)}) {
      if (at.y < window.top) continue;
      paint(image, at.x + step.x, at.y + step.y, range_colour(range_m[i] / far_m));
    }
  }
}

// Draws a red dot at the sensor, and a line in its forward direction.
void draw_sensor(Image8& image, const MapWindow& window, const Pose& X_DS) {
  const glm::dvec3 forward = X_DS.rotation * glm::dvec3(1, 0, 0);
  for (int step = 0; step <= 200; ++step) {
    const double ahead_m = window.half_m * 0.1 * step / 200;
    const glm::ivec2 at = window.pixel(glm::dvec2(X_DS.translation_m + forward * ahead_m));
    const int radius = step == 0 ? 4 : 1;
    for (int dy = -radius; dy <= radius; ++dy) {
      for (int dx = -radius; dx <= radius; ++dx) {
        if (dx * dx + dy * dy <= radius * radius)
          paint(image, at.x + dx, at.y + dy, {0.9, 0.1, 0.1});
      }
    }
  }
}

// ----- images

constexpr int largest_px = 640;  // longer side of a panel

using ColourAt = std::function<Colour(int, int)>;

float image_quantile(const ImageF& image, double share) {
  return quantile_of(image.values(), share,
                     [](float value) { return std::isfinite(value) && value > 0; });
}

// Draws the radiance, so bright that 1 % of the values of `exposed_for` are clipped to white.
ColourAt light_of(const ImageF& radiance, const ImageF& exposed_for) {
  const float white = image_quantile(exposed_for, 0.99);
  return [&radiance, white](int x, int y) {
    const auto rgb = radiance.at(x, y);
    const auto encoded = [&](float value) {
      return srgb_of_linear(std::clamp(static_cast<double>(value / white), 0.0, 1.0));
    };
    return Colour(encoded(rgb[0]), encoded(rgb[1]), encoded(rgb[2]));
  };
}

// Draws near as yellow, far as violet, on a logarithmic scale; the sky is black.
ColourAt depth_of(const ImageTruth& truth) {
  const float near_m = image_quantile(truth.depth_m, 0.01),
              far_m = image_quantile(truth.depth_m, 0.99);
  return [&truth, near_m, far_m](int x, int y) {
    const float depth_m = truth.depth_m.at(x, y)[0];
    if (!std::isfinite(depth_m) || depth_m <= 0) return Colour(0);
    const double span = math::log(static_cast<double>(std::max(far_m / near_m, 1.01f)));
    return range_colour(math::log(static_cast<double>(depth_m / near_m)) / span);
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
      return 0.55 + 0.4 * math::cos(2 * std::numbers::pi * (hue + shift));
    };
    return Colour(wave(0), wave(1 / 3.0), wave(2 / 3.0));
  };
}

}  // namespace

Image8 draw_preview(const PointCloud& scan, const PlacedLidar& lidar, const Ground& ground,
                    std::int64_t frame) {
  const RangeRows rows(scan, lidar.spec.lidar.pattern);
  Image8 image(preview_width, rows.height + gap + preview_width, 3);
  const auto range_m = scan.column<double>("range_true");
  const double far_m =
      std::max(quantile_of(range_m, 0.95, [](double value) { return !std::isnan(value); }), 1.0);
  const Pose X_DS = lidar.X_DS.pose_at(lidar.lidar.pattern().stamp(frame));
  const MapWindow window{glm::dvec2(X_DS.translation_m), std::max(far_m * 1.1, 10.0),
                         rows.height + gap};
  draw_ranges(image, scan, rows, far_m);
  draw_hillshade(image, window, ground);
  draw_points(image, window, scan, far_m);
  draw_sensor(image, window, X_DS);
  return image;
}

Image8 draw_image_preview(const Exposure* light, const ImageTruth* truth) {
  std::vector<ColourAt> panels;
  if (light != nullptr) panels.push_back(light_of(light->radiance, light->radiance));
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
  Image8 picture(columns * (w + gap) - gap, rows * (h + gap) - gap, 3);
  std::ranges::fill(picture.values(), std::uint8_t{255});
  for (int i = 0; i < static_cast<int>(panels.size()); ++i) {
    const int left = i % columns * (w + gap), top = i / columns * (h + gap);
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x)
        paint(picture, left + x, top + y,
              panels[static_cast<std::size_t>(i)](x * stride, y * stride));
    }
  }
  return picture;
}

Image8 draw_radiance(const ImageF& radiance, const ImageF& exposed_for) {
  const ColourAt colour = light_of(radiance, exposed_for);
  Image8 picture(radiance.width(), radiance.height(), 3);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) paint(picture, x, y, colour(x, y));
  return picture;
}

}  // namespace groundray
