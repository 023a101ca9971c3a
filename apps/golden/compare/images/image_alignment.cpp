#include "apps/golden/compare/images/image_alignment.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace groundray::golden {
namespace {

constexpr double much_nearer = 0.5;
constexpr double nearly_the_same = 1e-4;

/// Shift or reflection by which pixels of the other image are looked up.
struct Reading {
  std::string what;
  int x_half_px = 0, y_half_px = 0;  // shift of the content
  bool is_x_mirrored = false, is_y_mirrored = false;
};

std::vector<Reading> readings() {
  std::vector<Reading> all{{"mirrored left to right", 0, 0, true, false},
                           {"mirrored top to bottom", 0, 0, false, true},
                           {"turned by 180 degrees", 0, 0, true, true}};
  for (int y = -2; y <= 2; ++y) {
    for (int x = -2; x <= 2; ++x) {
      if (x != 0 || y != 0)
        all.push_back({fmt::format("moved by ({}, {}) px", x / 2.0, y / 2.0), x, y});
    }
  }
  return all;
}

/// Looks up values at whole and half pixels; NaN outside the image.
struct Lookup {
  const Image<double>& image;

  double operator()(int x_half, int y_half, std::size_t channel) const {
    const int x0 = (x_half - (x_half & 1)) / 2, x1 = x0 + (x_half & 1);
    const int y0 = (y_half - (y_half & 1)) / 2, y1 = y0 + (y_half & 1);
    if (x0 < 0 || y0 < 0 || x1 >= image.width() || y1 >= image.height())
      return std::numeric_limits<double>::quiet_NaN();
    return (image.at(x0, y0)[channel] + image.at(x1, y0)[channel] + image.at(x0, y1)[channel] +
            image.at(x1, y1)[channel]) /
           4;
  }
};

/// Returns the mean relative difference of values that are finite in both images; infinity if these
/// are fewer than half of all values.
double difference(const Image<double>& reference, const Image<double>& other,
                  const Reading& reading) {
  const Lookup lookup{other};
  double sum = 0;
  std::size_t count = 0;
  const auto channels = static_cast<std::size_t>(reference.channels());
  for (int y = 0; y < reference.height(); ++y) {
    const int from_y = reading.is_y_mirrored ? reference.height() - 1 - y : y;
    for (int x = 0; x < reference.width(); ++x) {
      const int from_x = reading.is_x_mirrored ? reference.width() - 1 - x : x;
      for (std::size_t k = 0; k < channels; ++k) {
        const double a = reference.at(x, y)[k];
        const double b = lookup(2 * from_x - reading.x_half_px, 2 * from_y - reading.y_half_px, k);
        if (!std::isfinite(a) || !std::isfinite(b)) continue;
        if (a != b) sum += std::abs(a - b) / (std::abs(a) + std::abs(b));
        ++count;
      }
    }
  }
  return 2 * count < reference.values().size() || count == 0
             ? std::numeric_limits<double>::infinity()
             : sum / static_cast<double>(count);
}

}  // namespace

std::optional<Misalignment> misalignment(const Image<double>& reference,
                                         const Image<double>& other) {
  const double as_it_is = difference(reference, other, {});
  if (!std::isfinite(as_it_is) || as_it_is < nearly_the_same) return std::nullopt;
  Misalignment best{.difference = std::numeric_limits<double>::infinity(), .as_it_is = as_it_is};
  for (const Reading& reading : readings()) {
    const double now = difference(reference, other, reading);
    if (now >= best.difference) continue;
    best.difference = now;
    best.what = reading.what;
  }
  if (best.difference > much_nearer * as_it_is) return std::nullopt;
  return best;
}

}  // namespace groundray::golden
