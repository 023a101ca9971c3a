#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <unordered_map>

#include "apps/colour_map.h"
#include "apps/view/recorded/recorded_image.h"
#include "apps/view/rendering/colour_table.h"
#include "core/image/srgb.h"
#include "core/math.h"
#include "core/quantile.h"

namespace groundray {
namespace {

using Kind = ImageChannel::Kind;

constexpr std::size_t most_samples = 200'000;  // number of values from which a range is chosen
constexpr std::size_t most_categories = 32;
constexpr int legend_steps = 64;

using ColourAt = std::function<Colour(glm::ivec2)>;

// Returns finite values of a component that satisfy `counts`: all of them, or an even subsample.
std::vector<double> some_values(const PixelValues& values, int component,
                                const std::function<bool(double)>& counts) {
  const glm::ivec2 size_px = size_of(values);
  const auto pixels = static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y);
  const std::size_t stride = pixels / most_samples + 1;
  std::vector<double> found;
  for (std::size_t i = 0; i < pixels; i += stride) {
    const glm::ivec2 pixel(static_cast<int>(i % static_cast<std::size_t>(size_px.x)),
                           static_cast<int>(i / static_cast<std::size_t>(size_px.x)));
    const double value = number_at(values, pixel, component);
    if (std::isfinite(value) && counts(value)) found.push_back(value);
  }
  return found;
}

// Returns 0 and the value of full colour or, if that is not defined, the 1 % and 99 % quantiles.
std::pair<double, double> usual_range(const ImageChannel& channel) {
  if (channel.full) return {0, *channel.full};
  const bool is_distance = channel.kind == Kind::Distance;
  std::vector<double> values = some_values(channel.values, components_of(channel.values) - 1,
                                           [&](double value) { return !is_distance || value > 0; });
  if (values.empty()) return {is_distance ? 1 : 0, is_distance ? 10 : 1};
  const double low = quantile(values, 0.01), high = quantile(values, 0.99);
  if (low < high) return {low, high};
  return is_distance ? std::pair(low / 1.01, low * 1.01) : std::pair(low - 0.5, low + 0.5);
}

double length_at(const PixelValues& values, glm::ivec2 pixel, int components) {
  double square = 0;
  for (int k = 0; k < components; ++k) {
    const double value = number_at(values, pixel, k);
    square += value * value;
  }
  return std::sqrt(square);
}

// Returns the 99 % quantile of the vectors' lengths.
double usual_length(const ImageChannel& channel, int components) {
  const glm::ivec2 size_px = size_of(channel.values);
  const int stride = std::max(1, size_px.x / 400);
  std::vector<double> lengths;
  for (int y = 0; y < size_px.y; y += stride) {
    for (int x = 0; x < size_px.x; x += stride) {
      const double length = length_at(channel.values, {x, y}, components);
      if (std::isfinite(length) && length > 0) lengths.push_back(length);
    }
  }
  return lengths.empty() ? 1 : quantile(lengths, 0.99);
}

ImageLegend number_legend(const ImageChannel& channel,
                          std::optional<std::pair<double, double>> range) {
  const bool is_distance = channel.kind == Kind::Distance;
  const auto [low, high] = range ? *range : usual_range(channel);
  ImageLegend legend{.low = low,
                     .high = high,
                     .unit = channel.unit,
                     .is_logarithmic = is_distance && low > 0,
                     .colours = {},
                     .categories = {}};
  for (int i = 0; i < legend_steps; ++i) {
    const double share = i / (legend_steps - 1.0);
    legend.colours.push_back(range_colour(is_distance ? share : 1 - share));
  }
  return legend;
}

// Unknown values and the sky are black.
ColourAt number_colours(const ImageChannel& channel, const ImageLegend& legend) {
  const int component = components_of(channel.values) - 1;
  const bool is_distance = channel.kind == Kind::Distance;
  return [&channel, &legend, component, is_distance](glm::ivec2 pixel) {
    const double value = number_at(channel.values, pixel, component);
    if (!std::isfinite(value) || (is_distance && value <= 0)) return Colour(0);
    const double share = legend.is_logarithmic
                             ? math::log(value / legend.low) / math::log(legend.high / legend.low)
                             : (value - legend.low) / (legend.high - legend.low);
    return range_colour(is_distance ? share : 1 - share);
  };
}

ColourAt light_colours(const ImageChannel& channel, const ImageLegend& legend) {
  const bool is_grey = components_of(channel.values) < 3;
  return [&channel, &legend, is_grey](glm::ivec2 pixel) {
    const auto encoded = [&](int k) {
      const double value = number_at(channel.values, pixel, is_grey ? 0 : k) / legend.high;
      return std::isnan(value) ? 0 : srgb_of_linear(std::clamp(value, 0.0, 1.0));
    };
    return Colour(encoded(0), encoded(1), encoded(2));
  };
}

// Returns the stored value of white.
double full_of(const PixelValues& values) {
  if (std::holds_alternative<Image8>(values)) return 255;
  return std::holds_alternative<Image16>(values) ? 65535 : 1;
}

ColourAt picture_colours(const ImageChannel& channel, double exposure_ev) {
  const bool is_grey = components_of(channel.values) < 3;
  const double full = full_of(channel.values), gain = math::exp2(exposure_ev);
  return [&channel, is_grey, full, gain](glm::ivec2 pixel) {
    const auto value = [&](int k) {
      const double stored = number_at(channel.values, pixel, is_grey ? 0 : k) / full;
      if (gain == 1 || std::isnan(stored)) return stored;
      return srgb_of_linear(std::clamp(gain * linear_of_srgb(stored), 0.0, 1.0));
    };
    return Colour(value(0), value(1), value(2));
  };
}

ColourAt vector_colours(const ImageChannel& channel, const ImageLegend& legend) {
  return [&channel, &legend](glm::ivec2 pixel) {
    const auto value = [&](int k) { return number_at(channel.values, pixel, k); };
    const Colour v(value(0), value(1), value(2));
    return std::isfinite(v.x + v.y + v.z) ? (v / legend.high + 1.0) / 2.0 : Colour(0);
  };
}

// Returns the colour of a hue, in turns, and a saturation.
Colour hue_colour(double turns, double saturation) {
  const auto wave = [&](double shift) {
    return 1 - saturation * (0.5 - 0.5 * math::cos(2 * std::numbers::pi * (turns + shift)));
  };
  return {wave(0), wave(-1 / 3.0), wave(1 / 3.0)};
}

ColourAt flow_colours(const ImageChannel& channel, const ImageLegend& legend) {
  return [&channel, &legend](glm::ivec2 pixel) {
    const double u = number_at(channel.values, pixel, 0), v = number_at(channel.values, pixel, 1);
    if (!std::isfinite(u + v)) return Colour(0);
    return hue_colour(math::atan2(v, u) / (2 * std::numbers::pi),
                      std::min(math::hypot(u, v) / legend.high, 1.0));
  };
}

// Same colours as for labels elsewhere, except that 0 is black.
Colour category_colour(std::uint32_t number) {
  return number == 0 ? Colour(0) : colour_of_kind(static_cast<int>(number & 0x7fffffffU));
}

std::uint32_t whole_at(const PixelValues& values, glm::ivec2 pixel) {
  const double value = number_at(values, pixel, 0);
  return value >= 0 && value <= 4294967295.0 ? static_cast<std::uint32_t>(value) : 0;
}

ImageLegend category_legend(const ImageChannel& channel, const RecordedNames& names) {
  std::unordered_map<std::uint32_t, std::size_t> counts;
  const glm::ivec2 size_px = size_of(channel.values);
  for (int y = 0; y < size_px.y; ++y) {
    for (int x = 0; x < size_px.x; ++x) ++counts[whole_at(channel.values, {x, y})];
  }
  ImageLegend legend{.unit = channel.unit, .colours = {}, .categories = {}};
  for (const auto& [number, pixels] : counts) {
    const std::string name = name_of(channel, number, names);
    legend.categories.push_back(
        {number, name.empty() ? fmt::format("{}", number) : fmt::format("{} {}", number, name),
         category_colour(number), pixels});
  }
  std::ranges::sort(legend.categories, [](const auto& a, const auto& b) {
    return a.pixels != b.pixels ? a.pixels > b.pixels : a.number < b.number;
  });
  if (legend.categories.size() > most_categories) legend.categories.resize(most_categories);
  return legend;
}

// Returns the 99 % quantile of the positive values.
double white_of(const ImageChannel& channel) {
  const int components = components_of(channel.values);
  std::vector<double> all;
  for (int k = 0; k < std::min(components, 3); ++k) {
    const auto more = some_values(channel.values, k, [](double value) { return value > 0; });
    all.insert(all.end(), more.begin(), more.end());
  }
  return all.empty() ? 1 : quantile(all, 0.99);
}

ImageLegend legend_of(const ImageChannel& channel, const RecordedNames& names,
                      std::optional<std::pair<double, double>> range) {
  switch (channel.kind) {
    case Kind::Number:
    case Kind::Distance:
      return number_legend(channel, range);
    case Kind::Categories:
      return category_legend(channel, names);
    case Kind::Light:
    case Kind::Vector:
    case Kind::Flow:
    case Kind::AsStored:
      break;
  }
  ImageLegend legend{.unit = channel.unit, .colours = {}, .categories = {}};
  if (range)
    legend.high = range->second;
  else if (channel.full)
    legend.high = *channel.full;
  else if (channel.kind == Kind::Light)
    legend.high = white_of(channel);
  else if (channel.kind != Kind::AsStored)
    legend.high = usual_length(channel, channel.kind == Kind::Flow ? 2 : 3);
  return legend;
}

ColourAt channel_colours(const ImageChannel& channel, const ImageLegend& legend,
                         double exposure_ev) {
  switch (channel.kind) {
    case Kind::Number:
    case Kind::Distance:
      return number_colours(channel, legend);
    case Kind::Categories:
      return
          [&channel](glm::ivec2 pixel) { return category_colour(whole_at(channel.values, pixel)); };
    case Kind::Light:
      return light_colours(channel, legend);
    case Kind::Vector:
      return vector_colours(channel, legend);
    case Kind::Flow:
      return flow_colours(channel, legend);
    case Kind::AsStored:
      break;
  }
  return picture_colours(channel, exposure_ev);
}

}  // namespace

double automatic_exposure_ev(const ImageChannel& channel) {
  if (channel.kind != Kind::AsStored) return 0;
  const double white = linear_of_srgb(white_of(channel) / full_of(channel.values));
  return white > 0 && std::isfinite(white) ? -math::log2(white) : 0;
}

DrawnChannel draw_channel(const ImageChannel& channel, const RecordedNames& names,
                          std::optional<std::pair<double, double>> range, double exposure_ev) {
  const glm::ivec2 size_px = size_of(channel.values);
  DrawnChannel drawn{Image8(size_px.x, size_px.y, 3), legend_of(channel, names, range)};
  if (channel.kind == Kind::Light) drawn.legend.high /= math::exp2(exposure_ev);
  const ColourAt colour_at = channel_colours(channel, drawn.legend, exposure_ev);
  tbb::parallel_for(0, size_px.y, [&](int y) {
    for (int x = 0; x < size_px.x; ++x) paint(drawn.picture, x, y, colour_at({x, y}));
  });
  return drawn;
}

}  // namespace groundray
