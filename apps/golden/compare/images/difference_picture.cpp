#include "apps/golden/compare/images/difference_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <span>
#include <vector>

#include "apps/colour_map.h"
#include "apps/golden/compare/error_figures.h"
#include "apps/golden/compare/error_map.h"
#include "apps/golden/html_text.h"
#include "core/image/srgb.h"
#include "core/math.h"

namespace groundray::golden {
namespace {

constexpr int most_px = 640;
const Colour blank(0.85);  // colour of pixels without a value

int step_of(const Image<double>& image) {
  return (std::max(image.width(), image.height()) + most_px - 1) / most_px;
}

Image<double> every(const Image<double>& image, int step) {
  Image<double> result((image.width() + step - 1) / step, (image.height() + step - 1) / step,
                       image.channels());
  for (int y = 0; y < result.height(); ++y) {
    for (int x = 0; x < result.width(); ++x)
      std::ranges::copy(image.at(x * step, y * step), result.at(x, y).begin());
  }
  return result;
}

/// Returns the value of largest magnitude in each square of `step` x `step` pixels; NaN if there is
/// none.
Image<double> largest(const Image<double>& image, int step) {
  Image<double> result((image.width() + step - 1) / step, (image.height() + step - 1) / step, 1);
  std::ranges::fill(result.values(), std::numeric_limits<double>::quiet_NaN());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double value = image.at(x, y)[0];
      double& now = result.at(x / step, y / step)[0];
      if (std::isnan(now) || std::abs(value) > std::abs(now)) now = value;
    }
  }
  return result;
}

std::string every_caption(int step) {
  return step > 1 ? fmt::format("; one pixel of {0} x {0}", step) : "";
}

/// Returns the scalar that false colours show, the length for vectors; NaN if the pixel has no
/// value.
double shown(const ImageLayer& layer, std::span<const double> value) {
  const double size = value.size() > 1 ? length_of(value) : value[0];
  const bool is_there = std::isfinite(size) && (layer.kind != LayerKind::Depth || is_depth(size));
  return is_there ? size : std::numeric_limits<double>::quiet_NaN();
}

/// Returns a unit with its leading blank as the end of a label.
std::string comma(const std::string& unit) { return unit.empty() ? "" : "," + unit; }

struct Scale {
  double low = 0, high = 1;
  bool is_logarithmic = false;

  double value_at(double share) const {
    return is_logarithmic ? low * math::pow(high / low, share) : low + share * (high - low);
  }
  double share(double value) const {
    if (is_logarithmic) return math::log(std::max(value, low) / low) / math::log(high / low);
    return (value - low) / (high - low);
  }
};

ColourBar bar_of(const Scale& scale, const std::string& label) {
  ColourBar bar{.label = label, .colours = {}, .marks = {}};
  constexpr int steps = 64, marks = 4;
  for (int i = 0; i < steps; ++i) bar.colours.push_back(range_colour(1 - (i + 0.5) / steps));
  for (int i = 0; i <= marks; ++i) {
    const double share = static_cast<double>(i) / marks;
    bar.marks.emplace_back(share, number_text(scale.value_at(share)));
  }
  return bar;
}

/// Returns the scale from the 1st to the 99th percentile. Depths are scaled logarithmically, so
/// that near ones remain distinguishable; for light, each colour counts separately.
Scale scale_of(const ImageLayer& layer, const Image<double>& image) {
  std::vector<double> values;
  for (std::size_t i = 0; i < image.values().size(); ++i) {
    const auto channels = static_cast<std::size_t>(image.channels());
    const bool is_light = layer.kind == LayerKind::Colour;
    if (!is_light && i % channels != 0) continue;
    const double value = shown(layer, image.values().subspan(i, is_light ? 1 : channels));
    if (!std::isnan(value)) values.push_back(value);
  }
  if (values.empty()) return {};
  Scale scale{quantile(values, 0.01), quantile(values, 0.99)};
  if (!(scale.high > scale.low)) scale.high = scale.low + 1;
  scale.is_logarithmic = layer.kind == LayerKind::Depth && scale.low > 0;
  return scale;
}

Colour colour_of(const ImageLayer& layer, std::span<const double> value, const Scale& scale) {
  if (layer.kind == LayerKind::Colour) {
    Colour colour;
    for (std::size_t k = 0; k < 3; ++k) {
      const double share = value[std::min(k, value.size() - 1)] / scale.high;
      colour[static_cast<glm::length_t>(k)] =
          layer.name == "Picture" ? share : srgb_of_linear(std::max(share, 0.0));
    }
    return colour;
  }
  if (layer.kind == LayerKind::Normal) return 0.5 + 0.5 * Colour(value[0], value[1], value[2]);
  const double value_shown = shown(layer, value);
  return std::isnan(value_shown) ? blank : range_colour(1 - scale.share(value_shown));
}

/// Returns a picture of the colours `colour_at(x, y)`.
template <typename ColourAt>
Image8 painted(glm::ivec2 size_px, const ColourAt& colour_at) {
  Image8 picture(size_px.x, size_px.y, 3);
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) paint(picture, x, y, colour_at(x, y));
  }
  return picture;
}

Image8 painted(const ImageLayer& layer, const Image<double>& values, const Scale& scale) {
  return painted({values.width(), values.height()}, [&](int x, int y) {
    const auto value = values.at(x, y);
    const bool is_there = std::ranges::all_of(value, [](double v) { return std::isfinite(v); });
    return is_there ? colour_of(layer, value, scale) : blank;
  });
}

constexpr int smallest_picture_px = 240;

}  // namespace

void draw_differences(const std::string& caption, const Image<double>& differences,
                      const std::string& unit, Section& into) {
  const int step = step_of(differences);
  const Image<double> values = largest(differences, step);
  const auto all = differences.values();
  const ErrorScale scale = error_scale_of({all.begin(), all.end()});
  Image8 picture = painted({values.width(), values.height()}, [&](int x, int y) {
    const double value = values.at(x, y)[0];
    return std::isfinite(value) ? scale.colour(value) : blank;
  });
  into.pictures.push_back(
      {.caption = caption + "; grey: no value" +
                  (step > 1 ? fmt::format("; the largest of {0} x {0} pixels", step) : ""),
       .image = std::move(picture),
       .shown = Shown::Errors,
       .bar = scale.bar("difference" + comma(unit))});
}

void draw_layers(const ImageLayer& reference, const ImageLayer& other,
                 const Image<double>& differences, const std::string& unit, Section& into) {
  const int step = step_of(reference.values);
  const Image<double> of_reference = every(reference.values, step);
  Scale scale = scale_of(reference, of_reference);
  const bool has_bar = reference.kind != LayerKind::Normal && reference.kind != LayerKind::Colour;
  std::string note;
  if (reference.kind == LayerKind::Normal) note = ", directions as colours";
  if (reference.kind == LayerKind::Colour) {
    if (reference.name == "Picture") scale.high = 1;
    note = reference.name == "Picture" ? "" : fmt::format(", white is {:.4g}", scale.high);
  }
  const auto add = [&](const std::string& whose, const Image<double>& values) {
    Picture picture{.caption = reference.name + whose + note + every_caption(step),
                    .image = painted(reference, values, scale)};
    if (has_bar) picture.bar = bar_of(scale, reference.name + comma(unit));
    into.pictures.push_back(std::move(picture));
  };
  const bool are_equal = std::ranges::equal(
      reference.values.values(), other.values.values(),
      [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); });
  add(are_equal ? ": both" : ": reference", of_reference);
  if (are_equal) return;
  add(": other", every(other.values, step));
  draw_differences(reference.name + ": other less reference", differences, unit, into);
}

void add_pixel_axes(const ImageLayer& layer, std::span<Picture> pictures) {
  for (Picture& picture : pictures) {
    const double first = layer.first_px.x, top = layer.first_px.y;
    picture.across = Axis{"column, px", first, first + layer.values.width()};
    picture.up = Axis{"row, px", top + layer.values.height(), top};
  }
}

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
  return painted(size_px * scale, [&](int x, int y) {
    const double value =
        values[static_cast<std::size_t>(y / scale) * static_cast<std::size_t>(size_px.x) +
               static_cast<std::size_t>(x / scale)];
    const double share = high > low ? (value - low) / (high - low) : 0;
    return std::isfinite(value) ? range_colour(1 - share) : Colour(1);
  });
}

}  // namespace groundray::golden
